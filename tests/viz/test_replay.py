"""Animations of replays: frames, lasting colours, hostile input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import ReplayAnimation, replay
from hybridnav.viz.canvas import known_view

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.ext.live import ReplayStep


def steps(count: int, **options: Any) -> list[ReplayStep]:
    """Replay two rooms in which a pallet moves, far from the second room."""
    grids = []
    for at in range(count):
        probability = np.zeros((12, 25), np.float32)
        probability[:, 12], probability[4:7, 12] = 1.0, 0.0
        probability[2 + at % 5, 3] = 1.0
        grids.append(hn.OccupancyGrid(probability, hn.Frame(0.25), robot_radius_m=0))
    return list(replay(grids, merge_distance_m=1.5, **options))


def frames_of(path: Path) -> list[np.ndarray]:
    with Image.open(path) as image:
        frames = []
        for at in range(image.n_frames):  # type: ignore[attr-defined]
            image.seek(at)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
        return frames


def test_colours_last_where_nothing_changes(tmp_path: Path) -> None:
    animation = ReplayAnimation()
    for step in steps(4):
        animation.add(step)
    animation.save(tmp_path / "replay.gif")
    frames = frames_of(tmp_path / "replay.gif")
    assert len(frames) == 4
    height, width, _ = frames[0].shape
    # The map of rooms lies below that of places: its right half is the second room.
    second = np.s_[int(0.6 * height) : int(0.85 * height), int(0.6 * width) : int(0.9 * width)]
    for frame in frames[1:]:
        # GIFs round colours, most of all at the rims of letters.
        assert (np.abs(frame[second] - frames[0][second]) > 16).mean() < 0.01
    left = np.s_[int(0.6 * height) : int(0.85 * height), int(0.2 * width) : int(0.4 * width)]
    middle = [np.median(frames[0][part].reshape(-1, 3), axis=0) for part in (left, second)]
    assert np.abs(middle[0] - middle[1]).max() > 20


def test_rooms_have_names_and_doors_have_numbers() -> None:
    labels = np.zeros((12, 25), np.int32)
    labels[:, 12:] = 1
    rooms = hn.RoomLabels(("kitchen", "lab"), labels, {}, {7: (3.1, 1.4)})
    animation = ReplayAnimation()
    for step in steps(3, rooms=rooms, most_cells=40):
        animation.add(step)
    frame = animation._last
    assert frame is not None
    places, regions, of_rooms = animation._drawn(frame, known_view(frame.grid)).axes
    assert places.get_title(loc="left").startswith("map 3")
    assert "free regions" in regions.get_title(loc="left")
    assert of_rooms.get_title(loc="left") == "2 rooms, 1 doors"
    written = {text.get_gid(): text.get_text() for text in of_rooms.findobj(Text)}
    assert (written["room-0"], written["room-1"], written["door-7"]) == ("kitchen", "lab", "7")
    (dots,) = (line for line in of_rooms.lines if line.get_gid() == "doors")
    assert np.array_equal(dots.get_xydata(), [frame.rooms.doors[7].position])
    assert not any(text.get_gid() for text in regions.findobj(Text))


def test_long_replays_keep_few_frames_and_the_last(tmp_path: Path) -> None:
    animation = ReplayAnimation(most_frames=4, width_in=3.0)
    for step in steps(11):
        animation.add(step)
    animation.save(tmp_path / "replay.gif")
    assert len(frames_of(tmp_path / "replay.gif")) in {3, 4}


def test_hostile_input_ends_in_one_line(tmp_path: Path) -> None:
    empty, full = ReplayAnimation(), ReplayAnimation(width_in=3.0)
    full.add(steps(1)[0])
    for ask, message in (
        (lambda: ReplayAnimation(most_frames=1), "2 or more frames"),
        (lambda: ReplayAnimation(seconds_per_frame=float("nan")), "choose a time"),
        (lambda: ReplayAnimation(width_in=-1.0), "choose a width"),
        (lambda: empty.save(tmp_path / "a.gif"), "without frames"),
        (lambda: full.save(tmp_path / "a.png"), "must end in .gif"),
        (lambda: full.save(tmp_path / "none" / "a.gif"), "cannot write"),
    ):
        with pytest.raises(InvalidValueError, match=message) as error:
            ask()
        assert "\n" not in str(error.value)
