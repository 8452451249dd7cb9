"""The maps of the study: twelve of ROS, four raw ones of SLAM, twelve of MovingAI."""

import fnmatch
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hybridnav.errors import InvalidValueError

ROS_MAPS = (
    "aws_small_warehouse/002/map.yaml",
    "bwi_gdc/2/2.yaml",
    "bwi_gdc/3/3.yaml",
    "cob_environments/ipa-apartment/map.yaml",
    "fetch_maps/3_1_16_localization.yaml",
    "fetch_maps/4_26_15.yaml",
    "giraff_homes/UMA_236.yaml",
    "nav2/maps/depot.yaml",
    "nav2/maps/tb3_sandbox.yaml",
    "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
)
"""Maps as their owners publish them, most of them tidied by hand."""

RAW_MAPS = (
    "radish_grids/belgioioso.yaml",
    "radish_grids/freiburg-101.yaml",
    "radish_grids/intel.yaml",
    "radish_grids/orebro.yaml",
)
"""Counting grids of laser logs, untouched: hundreds of specks each."""

MOVINGAI_FOLDERS = ("bg512", "cities", "da2", "dao", "mazes", "random", "rooms", "sc1")
N_MOVINGAI = 12

KINDS = {"ROS": "a ROS map", "SLAM": "a raw SLAM map", "MovingAI": "a MovingAI map"}


@dataclass(frozen=True)
class StudyMap:
    """One map of the study."""

    path: Path
    kind: str
    """A key of `KINDS`."""
    scenarios: str = ""
    """Scenario file of its pairs; empty where they are sampled."""


def maps_of(data: Path, globs: Sequence[str] = ()) -> list[StudyMap]:
    """Return the maps of the study that are in a folder, or those of them whose paths fit.

    Raises
    ------
    InvalidValueError
        When none is there, or none fits.
    """
    maps = [StudyMap(data / name, "ROS") for name in ROS_MAPS]
    maps += [StudyMap(data / name, "SLAM") for name in RAW_MAPS]
    maps = [one for one in maps if one.path.is_file()]
    maps += [StudyMap(path, "MovingAI", f"{path}.scen") for path in _movingai_maps(data)]
    if not maps:
        raise InvalidValueError(f"no map of the study is in {data}: python -m benchmarks fetch")
    fit = [one for one in maps if not globs or _fits(one.path.relative_to(data), globs)]
    if not fit:
        raise InvalidValueError(f"no map of the study fits {' or '.join(globs)}")
    return fit


def lost_of(data: Path) -> list[str]:
    """Return what of the study is not in a folder, one line each."""
    lost = [name for name in (*ROS_MAPS, *RAW_MAPS) if not (data / name).is_file()]
    n_lost = N_MOVINGAI - len(_movingai_maps(data))
    return lost + ([f"{n_lost} maps of MovingAI with scenarios"] if n_lost else [])


def _fits(path: Path, globs: Sequence[str]) -> bool:
    return any(fnmatch.fnmatch(path.as_posix(), glob) for glob in globs)


def _movingai_maps(data: Path) -> list[Path]:
    """Return twelve maps, or all, the folders in turn, each in alphabetical order."""
    by_folder = [sorted((data / "movingai" / name).rglob("*.map")) for name in MOVINGAI_FOLDERS]
    with_pairs = [[m for m in maps if m.with_name(f"{m.name}.scen").exists()] for maps in by_folder]
    turns = max(map(len, with_pairs))
    order = [maps[turn] for turn in range(turns) for maps in with_pairs if turn < len(maps)]
    return order[:N_MOVINGAI]
