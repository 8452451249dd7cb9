"""Logs of scans that commands read: CARMEN's, and bags of ROS 1 and ROS 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.ext.live.files.scan_log import ScanLog

_BAGS = (".bag", ".mcap", ".db3")


def is_bag(path: Path) -> bool:
    """Return whether a path names a bag of ROS, by its ending, or a folder."""
    return path.suffix.lower() in _BAGS or path.is_dir()


def open_log(path: Path, topic: str | None = None, frame: str | None = None) -> ScanLog:
    """Open a log of scans.

    Parameters
    ----------
    path
        The file or folder.
    topic, frame
        As in `BagLog`, for bags.
    """
    if is_bag(path):
        return hn.ext.live.BagLog(path, topic=topic, frame=frame)
    if topic is not None or frame is not None:
        option = "--topic" if topic is not None else "--frame"
        raise UsageError(
            f"{option} is for bags of ROS, got the log {printable(path)}: leave it out"
        )
    return hn.ext.live.CarmenLog(path)
