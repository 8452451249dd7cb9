"""Filter masks of Nav2: values of every mode, and layers of costs of them on a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.maps.files.ros import read_mask
from tests.layers import grid_of

if TYPE_CHECKING:
    from pathlib import Path

GREYS = [0, 50, 89, 90, 100, 101, 128, 204, 205, 206, 254, 255]


def mask_file(folder: Path, mode: str, **changes: Any) -> Path:
    """A mask of one row of greys, cells of 1 m."""
    (folder / "mask.pgm").write_bytes(b"P5 %d 1 255 " % len(GREYS) + bytes(GREYS))
    values = {
        "image": "mask.pgm",
        "mode": mode,
        "resolution": 1.0,
        "origin": "[0, 0, 0]",
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | changes
    path = folder / "mask.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in values.items()))
    return path


def values_by_nav2(mode: str) -> list[int]:
    """nav2_map_server/map_io.cpp: occupancy 1 - grey / 255, then by mode."""
    found = []
    for grey in GREYS:
        occupancy = (255 - grey) / 255
        if mode == "raw":
            found.append(grey if grey <= 100 else -1)
        elif occupancy >= 0.65:
            found.append(100)
        elif occupancy <= 0.196:
            found.append(0)
        elif mode == "scale":
            found.append(round((occupancy - 0.196) / (0.65 - 0.196) * 100))
        else:
            found.append(-1)
    return found


@pytest.mark.parametrize("mode", ["raw", "scale", "trinary"])
def test_values_are_those_of_map_server(tmp_path: Path, mode: str) -> None:
    values, frame = read_mask(mask_file(tmp_path, mode), max_cells=100)
    assert values.tolist() == [values_by_nav2(mode)]
    assert frame == hn.Frame(1.0)


def test_masks_become_layers_of_the_map(tmp_path: Path) -> None:
    grid = grid_of(np.zeros((2, 24)), hn.Frame(0.5, (0.0, 0.0)), robot_radius_m=0)
    path = mask_file(tmp_path, "raw")
    slow = hn.load_speed_mask(path, grid)
    # Values 0, 50, 89, 90 and 100: limits of none, 50, 11, 10 and 0 %, the last one none.
    expected = np.repeat([1, 2, 100 / 11, 10, 1, 1, 1, 1, 1, 1, 1, 1], 2)
    assert np.abs(slow.factors - expected).max() < 2**-14
    zones = hn.load_keepout_mask(path, grid)
    assert zones.keepout is not None
    assert zones.keepout.any(axis=0).tolist() == np.repeat(np.array(GREYS) == 100, 2).tolist()


def test_unreadable_masks_are_refused(tmp_path: Path) -> None:
    grid = grid_of(np.zeros((1, 12)), robot_radius_m=0)
    with pytest.raises(hn.MapNotFoundError):
        hn.load_speed_mask(tmp_path / "none.yaml", grid)
    with pytest.raises(hn.MapError, match="mode must be one of"):
        hn.load_keepout_mask(mask_file(tmp_path, "loud"), grid)
    with pytest.raises(hn.MapError, match="cells"):
        hn.load_keepout_mask(mask_file(tmp_path, "raw"), grid, max_cells=5)
    with pytest.raises(hn.InvalidValueError, match="full_speed_mps is needed"):
        hn.load_speed_mask(mask_file(tmp_path, "raw"), grid, unit="m/s")
