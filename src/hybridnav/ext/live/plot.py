"""Animations of replays: the map with its places, rooms and doors, growing together."""

from __future__ import annotations

from operator import attrgetter
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import ByteArray, IntArray, PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlineRooms, ReplayStep
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.viz import style
from hybridnav.viz.canvas import (
    Canvas,
    View,
    checked_animation,
    draw_cells,
    known_view,
    new_figure,
    save_frames,
)
from hybridnav.viz.labels import RoomWriter
from hybridnav.viz.room_map import DOOR_POINTS

_MARGINS_IN = (0.65, 0.5, 0.12, 0.3)
"""Left, below, right and above each map: its axes, their names, its title."""
_WIDE = 1.6
"""Width over height of a map from which on places and rooms lie one below the other."""
_LAST_PAUSE = 8
"""Frames for which the last one stays."""


class _Frame(NamedTuple):
    number: int
    grid: OccupancyGrid
    place_of: IntArray
    rooms: OnlineRooms


class _Panel(NamedTuple):
    """One of the maps of a frame."""

    title: str
    colours: _Colours
    grid: OccupancyGrid
    number_of: IntArray


class ReplayAnimation:
    """Frames of a replay, to be written as a GIF.

    A place or a room has one colour as long as it has its number; when it is born it
    takes the colour that is the least common beside it. Rooms have their names, doors that are no
    gaps are dots with their numbers; both are left out where there is no space for them. All
    frames have the extents of the last one.

    Parameters
    ----------
    most_frames
        The most frames that are kept, at least 2: of longer replays every second one, every fourth
        and so on, and the last.
    seconds_per_frame
        Time of a frame in seconds, from 0.02 to 10.
    width_in
        Width in inches, from 2 to 100; 100 pixels each.

    Raises
    ------
    InvalidValueError
        When a number is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live import replay
    >>> from hybridnav.ext.live import ReplayAnimation
    >>> cells = np.zeros((9, 21))
    >>> grids = [hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)] * 3
    >>> animation = ReplayAnimation()
    >>> for step in replay(grids):
    ...     animation.add(step)
    >>> animation.save("replay.gif")
    """

    def __init__(
        self, *, most_frames: int = 60, seconds_per_frame: float = 0.25, width_in: float = 11.0
    ) -> None:
        if most_frames < 2:  # noqa: PLR2004 - the first and the last map
            raise InvalidValueError(f"an animation has 2 or more frames, got {most_frames}")
        if not 0.02 <= seconds_per_frame <= 10:  # noqa: PLR2004
            raise InvalidValueError(
                f"a frame takes 0.02 to 10 seconds, got {seconds_per_frame}: choose a time between"
            )
        if not 2 <= width_in <= 100:  # noqa: PLR2004
            raise InvalidValueError(
                f"an animation is 2 to 100 inches wide, got {width_in}: choose a width between"
            )
        self._most, self._seconds, self._width_in = most_frames, seconds_per_frame, width_in
        self._frames: list[_Frame] = []
        self._last: _Frame | None = None
        self._every = 1
        self._of_places, self._of_rooms = _Colours(), _Colours()

    def add(self, step: ReplayStep) -> None:
        """Add a step of a replay, in order."""
        frame = _Frame(step.number, step.places.grid, step.places.number_of, step.rooms)
        self._last = frame
        self._of_places.learn(frame.place_of)
        if step.rooms_update is not None or step.update is None:
            self._of_rooms.learn(step.rooms.number_of)
        if step.number % self._every:
            return
        if len(self._frames) == self._most - 1:
            self._frames = self._frames[::2]
            self._every *= 2
        if step.number % self._every == 0:
            self._frames.append(frame)

    def save(self, path: PathLike) -> None:
        """Write the animation; an existing file is replaced.

        Parameters
        ----------
        path
            A file whose name ends in `.gif`.

        Raises
        ------
        InvalidValueError
            When there is no frame, the name has another ending or the file cannot be written.
        """
        file = checked_animation(path)
        frames = self._frames
        if self._last is None:
            raise InvalidValueError("an animation without frames cannot be written: add steps")
        if frames[-1].number != self._last.number:
            frames = [*frames, self._last]
        view = known_view(self._last.grid)
        times = [round(1000 * self._seconds)] * len(frames)
        times[-1] *= _LAST_PAUSE
        save_frames([self._drawn(frame, view) for frame in frames], times, file)

    def _panels(self, frame: _Frame) -> list[_Panel]:
        grid, rooms = frame.grid, frame.rooms
        is_free = grid.classes == CellClass.FREE
        n_places = len(np.unique(frame.place_of[is_free]))
        title = f"map {frame.number + 1}: {n_places:,} free places"
        panels = [_Panel(title, self._of_places, grid, frame.place_of)]
        n_doors = sum(not door.is_gap for door in rooms.doors.values())
        title = f"{len(rooms.numbers):,} rooms, {n_doors:,} doors"
        return [*panels, _Panel(title, self._of_rooms, rooms.grid, rooms.number_of)]

    def _drawn(self, frame: _Frame, view: View) -> Figure:
        """Draw all maps of a frame, one beside the other, or below it where the map is wide."""
        panels = self._panels(frame)
        left, below, right, above = _MARGINS_IN
        is_wide = view.size[0] > _WIDE * view.size[1]
        wide_in = self._width_in if is_wide else self._width_in / len(panels)
        map_in = wide_in - left - right
        map_high_in = map_in * float(view.size[1] / view.size[0])
        high_in = map_high_in + below + above
        tall_in = len(panels) * high_in if is_wide else high_in
        figure = new_figure(self._width_in, tall_in / self._width_in)
        for at, panel in enumerate(panels):
            x_in = left + (0 if is_wide else at * wide_in)
            y_in = below + ((len(panels) - 1 - at) * high_in if is_wide else 0)
            size = map_in / self._width_in, map_high_in / tall_in
            ax = figure.add_axes((x_in / self._width_in, y_in / tall_in, *size))
            canvas = Canvas.opened(ax, self._width_in, view)
            _draw_panel(canvas, panel)
            if at == len(panels) - 1:
                _write_rooms(canvas, frame.rooms)
        return figure


def _draw_panel(canvas: Canvas, panel: _Panel) -> None:
    """Draw the cells of a map in the colours of their numbers, with axes and a title."""
    is_free = panel.grid.measured == CellClass.FREE
    dense, table = panel.colours.table(np.where(is_free, panel.number_of, np.int32(-1)))
    draw_cells(canvas, panel.grid, dense, table)
    ax = canvas.ax
    ax.set_facecolor(style.UNEXPLORED)
    ax.set_title(panel.title, fontsize=9, loc="left", pad=4)
    ax.set_xlabel("x in metres", fontsize=8, labelpad=2)
    ax.set_ylabel("y in metres", fontsize=8, labelpad=2)
    ax.tick_params(labelsize=8)


def _write_rooms(canvas: Canvas, rooms: OnlineRooms) -> None:
    doors = [door for door in rooms.doors.values() if not door.is_gap]
    at = np.reshape([door.position for door in doors], (-1, 2))
    look = {"color": style.PATH, "marker": "o", "ls": "none", "zorder": 8, "gid": "doors"}
    canvas.add_line(at, ms=2 * DOOR_POINTS * canvas.sizes.line, **look)
    writer = RoomWriter(canvas, rooms.grid, rooms.labels)
    writer.labels.keep_free([door.position for door in doors], DOOR_POINTS * canvas.sizes.line)
    writer.write_names()
    writer.number_doors(sorted(doors, key=attrgetter("width_m"), reverse=True))


class _Colours:
    """Colours of numbers that stay what they are."""

    def __init__(self) -> None:
        self._colour_of: dict[int, int] = {}

    def learn(self, number_of: IntArray) -> None:
        """Choose colours for numbers that have none: those that are the least common beside."""
        pairs = [np.empty((0, 2), np.int64)]
        for tail, head in ((number_of[:, :-1], number_of[:, 1:]), (number_of[:-1], number_of[1:])):
            between = (tail != head) & (tail >= 0) & (head >= 0)
            pairs.append(np.stack([tail[between], head[between]], axis=1))
        beside: dict[int, set[int]] = {}
        for one, other in unique_rows(np.concatenate(pairs)).rows.tolist():
            beside.setdefault(one, set()).add(other)
            beside.setdefault(other, set()).add(one)
        numbers = np.flatnonzero(np.bincount(number_of.ravel() + 1)[1:])
        for number in numbers.tolist():
            if number not in self._colour_of:
                near = [self._colour_of.get(other) for other in beside.get(number, ())]
                counts = [near.count(colour) for colour in range(len(style.PLACES))]
                turn = number % len(counts)  # so that not all begin with the first colour
                order = [*range(turn, len(counts)), *range(turn)]
                self._colour_of[number] = min(order, key=lambda colour: counts[colour])

    def table(self, number_of: IntArray) -> tuple[IntArray, ByteArray]:
        """Return an index for each cell, and the colour of each index; -1 is unexplored.

        Cells below and left of another number are white: colours may meet again.
        """
        numbers, dense = np.unique(number_of, return_inverse=True)
        image = dense.reshape(number_of.shape).astype(np.int32)
        for here, beyond in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            one, other = number_of[here], number_of[beyond]
            image[here][(one != other) & (one >= 0) & (other >= 0)] = len(numbers)
        colours = style.rgb(*style.PLACES)
        chosen = [self._colour_of.get(number, 0) for number in numbers.tolist()]
        table = np.concatenate([colours[np.array(chosen, np.int64)], style.rgb(style.FREE)])
        table[:-1][numbers < 0] = style.rgb(style.UNEXPLORED)
        return image, table
