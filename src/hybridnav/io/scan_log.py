"""Logs of laser scans: what is damaged, or does not follow, is left out and counted."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._files import printable
from hybridnav.mapping import ScanSequence

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import PathLike
    from hybridnav.mapping import LaserScan

_LONGEST_PAUSE_S = 600.0


class ScanLog(ABC):
    """A log as an iterable of its laser scans, with counts of what was left out.

    Scans that do not follow from those before (see `ScanSequence`) are left out and counted, as are
    those that the format calls damaged.

    Parameters
    ----------
    path
        The log.
    size_bytes
        Its size.
    """

    expected: str
    """What the log must hold, for messages about one that holds no scan."""

    def __init__(self, path: PathLike, size_bytes: int) -> None:
        self._path = path
        self.size_bytes = size_bytes
        """Size of the log, for a progress bar."""
        self._start()

    def _start(self) -> None:
        self.n_scans = 0
        """Scans that were read and hold."""
        self.skipped: Counter[str] = Counter()
        """Scans that were left out, by fault."""
        self.notes: list[str] = []
        """What else is wrong with the log, in a few words each."""
        self.n_no_readings = 0
        """Readings of the scans that hold which are no finite length of 0 or more."""
        self.bytes_read = 0
        """Bytes of the log that were read so far."""
        self.duration_s = 0.0
        """Seconds from scan to scan, in all; without pauses of more than ten minutes, most of which
        are clocks that were set."""

    @abstractmethod
    def _read(self) -> Iterator[LaserScan | str]:
        """Yield the scans of the log, and in place of those that are damaged their fault."""

    def __iter__(self) -> Iterator[LaserScan]:
        """Yield the scans; a second iteration reads the log again."""
        self._start()
        time_s = np.nan
        for scan in self._followed():
            self.n_scans += 1
            readings = scan.ranges_m
            self.n_no_readings += int((~np.isfinite(readings) | (readings < 0)).sum())
            if 0 < scan.time_s - time_s < _LONGEST_PAUSE_S:
                self.duration_s += scan.time_s - time_s
            time_s = scan.time_s
            yield scan

    def _followed(self) -> Iterator[LaserScan]:
        """Yield the scans that follow from each other; count those that do not.

        The first scan waits for one that follows from it: it may be the wrong one.
        """
        sequence = ScanSequence()
        has_begun = False
        first: LaserScan | None = None
        refused: LaserScan | None = None
        for scan in self._read():
            fault = scan if isinstance(scan, str) else sequence.fault_of(scan)
            if isinstance(scan, str) or fault is not None:
                self.skipped[str(fault)] += 1
                refused = refused if isinstance(scan, str) else scan
            elif not has_begun:
                first, has_begun = scan, True
            else:
                if first is not None:
                    # If it follows from the refused one, that was a new beginning.
                    yield first if refused is None or _follows(first, scan) else refused
                    first = None
                yield scan
        if first is not None:
            yield first

    def leave_out(self, fault: str) -> None:
        """Count the scan that was yielded last among those that were left out.

        Parameters
        ----------
        fault
            Why, in a few words.
        """
        self.n_scans -= 1
        self.skipped[fault] += 1

    def summary(self) -> str:
        """Return one line on what was left out so far."""
        n_skipped = self.skipped.total()
        text = f"left out {n_skipped} of {self.n_scans + n_skipped} scans"
        if n_skipped:
            faults = sorted(self.skipped.items(), key=lambda item: (-item[1], item[0]))
            text += ": " + ", ".join(f"{count} {fault}" for fault, count in faults)
        if self.n_no_readings:
            text += f"; {self.n_no_readings} readings are no lengths"
        return "; ".join([text, *self.notes])

    def __repr__(self) -> str:
        return f"{type(self).__name__}({printable(self._path)!r})"


def _follows(before: LaserScan, after: LaserScan) -> bool:
    sequence = ScanSequence()
    sequence.fault_of(before)
    return sequence.fault_of(after) is None
