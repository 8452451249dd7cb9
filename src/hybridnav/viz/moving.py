"""Pictures that move: of a pyramid that grows, of searches, of a proof. Public: `save_growth`,
`save_search`, `save_proof`; `plot_proof` is the last picture of the latter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav import check_proof
from hybridnav.errors import InvalidValueError
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, checked_animation, draw_cells, known_view, save_frames
from hybridnav.viz.layout import add_title, frame_axes
from hybridnav.viz.levels import panels
from hybridnav.viz.maps import plot_map
from hybridnav.viz.places import Places

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hybridnav._base.typing import AnyArray, ByteArray, FloatArray, PathLike
    from hybridnav.maps import OccupancyGrid
    from hybridnav.pyramid import DualGraphPyramid
    from hybridnav.search.watched import SearchRecord

_FRAME_MS, _LAST_MS = 150, 3000
_LEVEL_MS = 700
_FRAMES = 30
_MANY = 3000
"""Vertices from which on their colours are pale: they would be confetti."""
_EXPANDED, _REACHED = style.PLACES[0], style.PLACES[1]
_FEW, _SPOT = 2000, 300
"""Cells up to which each is drawn as a spot, and the share of a map's longer side of its half."""
_BANDS = 16
"""Frames in which heights rise."""
_LEFT_OUT = 9
"""Mark of cells that the tree of a proof leaves out: their heights are those of an empty map."""


def save_growth(
    pyramid: DualGraphPyramid, path: PathLike, *, width_in: float = style.FULL_WIDTH_IN
) -> None:
    """Write how a pyramid grows: a frame for each level, from the cells to the apex.

    Parameters
    ----------
    pyramid
        The pyramid.
    path
        A file whose name ends in `.gif`, or in `.html` for a page with a slider; an existing one is
        replaced.
    width_in
        Width in inches; 100 pixels each.

    Raises
    ------
    InvalidValueError
        When the name has another ending, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.viz import save_growth
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> save_growth(pyramid, "growth.gif", width_in=3.0)
    """
    file = checked_animation(path)
    save_frames(_levels(pyramid, width_in), [_LEVEL_MS] * (len(pyramid) - 1) + [_LAST_MS], file)


def _levels(pyramid: DualGraphPyramid, width_in: float) -> Iterator[Figure]:
    view = known_view(pyramid.grid)
    for level in pyramid:
        words = [f"level {level.index}: {level.n_vertices:,} vertices, {level.n_arcs:,} arcs"]
        (ax,) = panels(view, [words], 1, width_in)
        canvas = Canvas.opened(ax, width_in, view)
        drawn, none = Places(level), np.zeros(level.n_vertices, np.bool_)
        colours = drawn.colours(none) if level.n_vertices > _MANY else drawn.colours()
        draw_cells(canvas, pyramid.grid, level.field_of, colours)
        frame_axes(canvas)
        add_title(canvas, words)
        yield ax.figure.figure


def save_search(
    grid: OccupancyGrid,
    records: Mapping[str, SearchRecord],
    path: PathLike,
    *,
    width_in: float = style.FULL_WIDTH_IN,
) -> None:
    """Write how searches open cells, beside each other, at one pace: that of their f.

    Expanded cells are dark, those only reached pale. All cells of equal f appear together.

    Parameters
    ----------
    grid
        The map. The pictures are cropped to its known part.
    records
        By the name of each search what it reached, from `GridSearch.watch` or `JumpSearch.watch`.
    path, width_in
        As for `save_growth`.

    Raises
    ------
    InvalidValueError
        When there is no record, the name has another ending, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.search.grid_search import GridSearch
    >>> from hybridnav.viz import save_search
    >>> grid = hn.example_map("figure1")
    >>> record = GridSearch(grid.enterable()).watch((5, 5), (25, 20))
    >>> save_search(grid, {"A*": record}, "search.gif", width_in=3.0)
    """
    file = checked_animation(path)
    if not any(len(record.cells) for record in records.values()):
        raise InvalidValueError("no search reached a cell: choose other ends")
    save_frames(_spread(grid, records, width_in), [_FRAME_MS] * _FRAMES + [_LAST_MS], file)


def _spread(
    grid: OccupancyGrid, records: Mapping[str, SearchRecord], width_in: float
) -> Iterator[Figure]:
    view, columns = known_view(grid), len(records)
    every = np.concatenate([record.f for record in records.values()])
    colours = style.class_rgb(_REACHED, _EXPANDED)
    # As many cells of all searches together in each frame.
    limits = np.quantile(every, np.linspace(0, 1, _FRAMES))
    for number in range(_FRAMES + 1):
        limit, is_last = limits[min(number, _FRAMES - 1)], number == _FRAMES
        titles = []
        for name, record in records.items():
            n = int((record.expanded & (record.f <= limit)).sum())
            titles.append([name, f"{n:,} expanded"])
        for ax, words, (_, record) in zip(
            panels(view, titles, columns, width_in), titles, records.items(), strict=True
        ):
            canvas = Canvas.opened(ax, width_in / columns, view)
            draw_cells(canvas, grid, *_opened(grid, record, limit, colours))
            if is_last and len(record.path):
                way, width = grid.frame.points_of(record.path), 1.8 * canvas.sizes.line
                canvas.add_line(way, color=style.PATH, lw=width, zorder=5)
            frame_axes(canvas)
            add_title(canvas, words)
        yield ax.figure.figure


def _opened(
    grid: OccupancyGrid, record: SearchRecord, limit: float, colours: ByteArray
) -> tuple[AnyArray, ByteArray]:
    """Return an index of colours for each cell: its class, or 3 and 4 once it is reached."""
    index = grid.classes.astype(np.int64)
    shown = record.f <= limit
    few = len(record.cells) < _FEW
    for is_expanded in (False, True):  # dark over pale
        chosen = record.cells[shown & (record.expanded == is_expanded)]
        if few:  # single corner cells of a large map would be lost on the page
            side = max(1, max(grid.shape) // _SPOT)
            around = np.indices((2 * side + 1,) * 2).reshape(2, -1).T - side
            chosen = (chosen[:, None] + around).reshape(-1, 2).clip(0, np.array(grid.shape) - 1)
        index[tuple(chosen.T)] = 3 + is_expanded
    return index, colours


class _Heights(NamedTuple):
    """The potential of a proof on a part of the map."""

    metres: FloatArray
    """float64 (rows, cols), NaN where the proof states none."""
    extent: tuple[float, float, float, float]
    """Its left, right, lower and upper side in the map frame, metres."""
    path: FloatArray
    """float64 (n, 2), points of the path, metres."""


def plot_proof(
    grid: OccupancyGrid,
    proof: dict[str, Any],
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the heights of a proof, a line every two metres, and the path that climbs them.

    No move climbs by more than it costs, and the goal lies as high as the path is long. So every
    path is at least as long.

    Parameters
    ----------
    grid
        The map of the proof, without yaw.
    proof
        That of a path of cells by lengths, from `hybridnav.prove`.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the range of heights; empty for none.
    width_in
        Width of a new figure in inches.

    Raises
    ------
    InvalidValueError
        When the proof is of another kind, or the map is turned.

    Examples
    --------
    >>> from hybridnav.viz import plot_proof
    >>> grid = hn.example_map("figure1")
    >>> proof = hn.prove(hn.plan(grid, (0.5, 0.5), (2.0, 2.5), preset="octile"))
    >>> plot_proof(grid, proof).get_title()
    'heights from 0 (dark) to 2.7 m (yellow)'
    """
    heights = _flat(grid, proof)
    words = f"heights from 0 (dark) to {proof['bound']:.1f} m (yellow)" if title is None else title
    ax = plot_map(grid, ax=ax, title=words, width_in=width_in)
    _draw_heights(ax, heights, np.inf)
    ax.plot(*heights.path.T, color=style.PATH, linewidth=1.5, zorder=4)
    return ax


def save_proof(
    grid: OccupancyGrid,
    proof: dict[str, Any],
    path: PathLike,
    *,
    width_in: float = style.FULL_WIDTH_IN,
) -> None:
    """Write how the heights of a proof rise from the start to the goal; see `plot_proof`.

    Parameters
    ----------
    grid, proof
        As for `plot_proof`.
    path, width_in
        As for `save_growth`.

    Raises
    ------
    InvalidValueError
        As `plot_proof`, or when the name has another ending, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.viz import save_proof
    >>> grid = hn.example_map("figure1")
    >>> proof = hn.prove(hn.plan(grid, (0.5, 0.5), (2.0, 2.5), preset="octile"))
    >>> save_proof(grid, proof, "proof.gif", width_in=3.0)
    """
    file, heights = checked_animation(path), _flat(grid, proof)

    def frames() -> Iterator[Figure]:
        for number in range(1, _BANDS + 1):
            limit = proof["bound"] * number / _BANDS
            ax = plot_map(grid, title=f"heights up to {limit:.1f} m", width_in=width_in)
            _draw_heights(ax, heights, limit)
            yield ax.figure.figure
        yield plot_proof(grid, proof, width_in=width_in).figure.figure

    save_frames(frames(), [_FRAME_MS] * _BANDS + [_LAST_MS], file)


def _flat(grid: OccupancyGrid, proof: dict[str, Any]) -> _Heights:
    """Return the heights of a map whose rows lie along x."""
    if proof.get("kind") != "cells" or proof.get("costs") is not None or grid.frame.yaw_rad:
        raise InvalidValueError(
            "heights are drawn of a path of cells by lengths, on a map that is not turned, got a "
            f"proof of kind {proof.get('kind')!r:.40}: plan by the preset octile"
        )
    return heights_of(grid, proof)


def heights_of(grid: OccupancyGrid, proof: dict[str, Any]) -> _Heights:
    """Return the heights of a proof of cells by lengths as `check_proof` computes and checks
    them."""
    walls = np.pad(~grid.enterable(allow_unexplored=proof["allow_unexplored"]), 1)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    for first, end in proof["closed"]:
        rows, cols = np.divmod(np.arange(first, end), grid.shape[1])
        walls[rows + 1, cols + 1] = True
    way = check_proof.walk(*proof["path"])
    bars = check_proof.bars_of(walls.shape, proof)
    factors, bound = np.full(walls.shape, check_proof.ONE), proof["bound"] / grid.resolution_m
    p, tree = check_proof.check_cells(walls, factors, proof, way[[0, -1]], bound * (1 - 1e-9), bars)
    per_unit = grid.resolution_m / check_proof.UNIT
    inside = ~check_proof.boxed(walls, proof) & ((tree != _LEFT_OUT) | (p >= 0))
    metres = np.where(inside, p * per_unit, np.nan)
    low = np.array(proof["box"][:2]) - 1
    (x, y), (x_end, y_end) = grid.frame.points_of_grid(np.array([low, low + metres.shape]))
    return _Heights(metres, (x, x_end, y, y_end), grid.frame.points_of(way - 1))


def _draw_heights(ax: Axes, heights: _Heights, limit: float) -> None:
    """Draw the heights up to a limit, in metres."""
    metres, (x, x_end, y, y_end), _ = heights
    view, top = (ax.get_xlim(), ax.get_ylim()), float(np.nanmax(metres))
    shown = np.where(metres <= limit, metres, np.nan)
    look: dict[str, Any] = {"vmin": 0.0, "vmax": top, "cmap": "viridis", "zorder": 2}
    ax.imshow(shown, origin="lower", extent=heights.extent, **look)
    rows, cols = metres.shape
    at = np.linspace(x, x_end, cols), np.linspace(y, y_end, rows)
    if np.isfinite(shown).any():
        levels = np.arange(0.0, top, 2.0)
        ax.contour(*at, shown, levels=levels, colors="white", linewidths=0.5, zorder=3)
    ax.set(xlim=view[0], ylim=view[1])
