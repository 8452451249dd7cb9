"""Animations of replays: frames, lasting colours, hostile input."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.online import replay
from hybridnav.viz import ReplayAnimation

if TYPE_CHECKING:
    from pathlib import Path


def steps(count: int) -> list[hn.online.ReplayStep]:
    """Replay two rooms in which a pallet moves, far from the second room."""
    grids = []
    for at in range(count):
        probability = np.zeros((12, 25), np.float32)
        probability[:, 12], probability[4:7, 12] = 1.0, 0.0
        probability[2 + at % 5, 3] = 1.0
        grids.append(hn.OccupancyGrid(probability, hn.Frame(0.25), robot_radius_m=0))
    return list(replay(grids, merge_distance_m=1.5))


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
        assert np.abs(frame[second] - frames[0][second]).max() <= 8  # GIFs round colours
    left = np.s_[int(0.6 * height) : int(0.85 * height), int(0.2 * width) : int(0.4 * width)]
    middle = [np.median(frames[0][part].reshape(-1, 3), axis=0) for part in (left, second)]
    assert np.abs(middle[0] - middle[1]).max() > 20


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
