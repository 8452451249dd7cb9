"""What several commands share: reading settings and maps, and messages."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console

import hybridnav as hn
from hybridnav.cli.errors import UsageError
from hybridnav.config import load_preset

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from hybridnav.config import Preset


def complain(message: str) -> None:
    """Print one line on stderr."""
    sys.stderr.write(f"hybridnav: {message}\n")


@contextmanager
def stage(text: str, seconds: dict[str, float], key: str) -> Iterator[None]:
    """Time a stage, with a spinner on stderr while it runs where that is a terminal."""
    began = time.perf_counter()
    with Console(stderr=True).status(text):
        yield
    seconds[key] = time.perf_counter() - began


def read_settings(
    preset: str, overrides: list[str] | None, radius_m: float | None, seed: int | None
) -> Preset:
    """A preset with the settings of the command line, which win over it.

    An error in a preset file is the file's; one in an override is the caller's.
    """
    plain = load_preset(preset)
    settings = list(overrides or ())
    if radius_m is not None:
        settings.append(f"pyramid.robot_radius_m={radius_m!r}")
    if seed is not None:
        settings.append(f"pyramid.seed={seed}")
    try:
        return load_preset(plain, overrides=settings)
    except hn.PresetError as error:
        raise UsageError(str(error)) from None


def grow_topology(path: Path, preset: Preset, seconds: dict[str, float]) -> hn.TopologicalMap:
    """Load a map and build its pyramid as a preset says."""
    settings = preset.pyramid
    with stage(f"reading {path}", seconds, "load"):
        grid = hn.load_map(path, robot_radius_m=settings.robot_radius_m)
    with stage("building the pyramid", seconds, "pyramid"):
        pyramid = hn.DualGraphPyramid.build(
            grid,
            merge_distance_m=settings.merge_distance_m,
            linkage=settings.linkage,
            seed=settings.seed,
        )
    return hn.TopologicalMap(pyramid)
