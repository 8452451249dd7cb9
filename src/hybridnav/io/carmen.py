"""Logs of CARMEN: the scans of a laser, read line by line from files that may be damaged.

Formats: CARMEN, the Carnegie Mellon Robot Navigation Toolkit, messages FLASER and ROBOTLASER1.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections import Counter
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from hybridnav._files import printable
from hybridnav.config.yaml_file import open_file
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.mapping import LaserScan, ScanSequence

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import FloatArray, PathLike

_GZIP = b"\x1f\x8b"
_MOST_BYTES = 2**20
"""Bytes of a line that are read; longer lines are damaged."""
_MOST_BEAMS = 100_000
_LONGEST_PAUSE_S = 600.0
_KNOWN_STEPS = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5, 400: 0.25, 401: 0.25}
"""Degrees between the beams of a SICK LMS by their number. FLASER does not state them."""
_CUT_OFF = "line cut off"
_NO_NUMBER = "no number"


class _DamagedLineError(Exception):
    """A line that is no scan; its text is the fault in a few words."""


class CarmenLog:
    r"""A log of CARMEN, as an iterable of its laser scans.

    FLASER and ROBOTLASER1 are read; if a log holds both, those of the kind that comes first. Poses
    are those of the laser, into which CARMEN has put its offset on the robot. The largest range is
    that of ROBOTLASER1, or of `robot_front_laser_max` among the parameters of the log.

    Lines that are cut off or hold no numbers, and scans that do not follow from those before (see
    `ScanSequence`), are left out and counted. The file is read line by line: memory does not grow
    with its size.

    Parameters
    ----------
    path
        The log, plain or compressed by gzip, whatever its name.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it cannot be opened.

    Examples
    --------
    >>> from pathlib import Path
    >>> ranges = " ".join(["2.0"] * 181)
    >>> line = f"FLASER 181 {ranges} 0 0 0 0 0 0 {{0}} robot {{0}}\n"
    >>> _ = Path("tiny.log").write_text(line.format(0.5) + line.format(1.5) + "FLASER 181 2.0 2.")
    >>> log = hn.CarmenLog("tiny.log")
    >>> [scan.time_s for scan in log]
    [0.5, 1.5]
    >>> log.summary()
    'left out 1 of 3 scans: 1 line cut off'
    """

    def __init__(self, path: PathLike) -> None:
        self._path = path
        with self._open() as file:
            self.size_bytes = file.seek(0, 2)
            """Size of the file, for a progress bar."""
        self._start()

    def _start(self) -> None:
        self.n_scans = 0
        """Scans that were read and hold."""
        self.skipped: Counter[str] = Counter()
        """Scans that were left out, by fault."""
        self.n_no_readings = 0
        """Readings of the scans that hold which are no finite length of 0 or more."""
        self.bytes_read = 0
        """Bytes of the file that were read so far."""
        self.duration_s = 0.0
        """Seconds from scan to scan, in all; without pauses of more than ten minutes, most of which
        are clocks that were set."""

    def _open(self) -> BinaryIO:
        return open_file(self._path, what="log", error=MapError, missing=MapNotFoundError)

    def __iter__(self) -> Iterator[LaserScan]:
        """Yield the scans; a second iteration reads the file again."""
        self._start()
        reader, sequence = _LineReader(), ScanSequence()
        time_s = math.nan
        with self._open() as file:
            for line in self._lines(file):
                try:
                    scan = reader.scan_of(line)
                except _DamagedLineError as fault:
                    self.skipped[str(fault)] += 1
                    continue
                if scan is None:
                    continue
                fault_or_none = sequence.fault_of(scan)
                if fault_or_none is not None:
                    self.skipped[fault_or_none] += 1
                    continue
                self.n_scans += 1
                readings = scan.ranges_m
                self.n_no_readings += int((~np.isfinite(readings) | (readings < 0)).sum())
                if 0 < scan.time_s - time_s < _LONGEST_PAUSE_S:
                    self.duration_s += scan.time_s - time_s
                time_s = scan.time_s
                yield scan

    def _lines(self, file: BinaryIO) -> Iterator[bytes]:
        """Yield the lines of the log, an empty one for each that is too long."""
        is_packed = file.read(2) == _GZIP
        file.seek(0)
        stream: BinaryIO = gzip.GzipFile(fileobj=file) if is_packed else file  # type: ignore[assignment]
        try:
            while line := stream.readline(_MOST_BYTES):
                self.bytes_read = file.tell()
                if len(line) < _MOST_BYTES or line.endswith(b"\n"):
                    yield line
                    continue
                self.skipped["line too long"] += 1
                while line and not line.endswith(b"\n"):
                    line = stream.readline(_MOST_BYTES)
        except (EOFError, OSError, zlib.error):
            self.skipped["rest of the file damaged"] += 1
        self.bytes_read = self.size_bytes

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
        return text

    def __repr__(self) -> str:
        return f"CarmenLog({printable(self._path)!r})"


class _LineReader:
    """The lines of one log, whose first scan and parameters decide how others are read."""

    def __init__(self) -> None:
        self._kind: bytes | None = None
        self._max_range_m = math.inf

    def scan_of(self, line: bytes) -> LaserScan | None:
        """Return the scan of a line, None if it holds none that is read."""
        words = line.split()
        if not words:
            return None
        if words[0] == b"PARAM":
            self._read_parameter(words)
        if words[0] not in _READERS:
            return None
        if self._kind is not None and words[0] != self._kind:
            return None
        try:
            scan = _READERS[words[0]](words, self._max_range_m)
        except IndexError:
            raise _DamagedLineError(_CUT_OFF) from None
        except (ValueError, OverflowError):
            raise _DamagedLineError(_NO_NUMBER) from None
        self._kind = words[0]
        return scan

    def _read_parameter(self, words: list[bytes]) -> None:
        if len(words) > 2 and words[1] == b"robot_front_laser_max":  # noqa: PLR2004 - name, value
            try:
                value = float(words[2])
            except ValueError:
                return
            if value > 0:
                self._max_range_m = value


def _readings(words: list[bytes], begin: int, *, after: int) -> tuple[FloatArray, int]:
    """Return the numbers of a list whose length stands before them, and the index behind them.

    Parameters
    ----------
    words
        The line.
    begin
        Index of the length.
    after
        Number of words that follow the list, at least.
    """
    count = int(words[begin])
    if not 0 <= count <= _MOST_BEAMS:
        raise ValueError(count)
    stop = begin + 1 + count
    if len(words) < stop + after:
        raise IndexError(stop)
    return np.array(words[begin + 1 : stop]).astype(np.float64), stop


def _pose(words: list[bytes]) -> tuple[float, float, float]:
    x_m, y_m, heading_rad = (float(word) for word in words)
    return x_m, y_m, heading_rad


def _flaser(words: list[bytes], max_range_m: float) -> LaserScan:
    """Read `FLASER n ranges, x y heading of the laser, the same of the robot, time host time`."""
    ranges_m, at = _readings(words, 1, after=9)
    count = len(ranges_m)
    step = _KNOWN_STEPS.get(count, 180.0 / max(count - 1, 1))
    view = 100.0 if step == _KNOWN_STEPS[400] and count in _KNOWN_STEPS else 180.0
    return _scan(ranges_m, _pose(words[at : at + 3]), (-view / 2, step), max_range_m, words[at + 6])


def _robotlaser(words: list[bytes], _: float) -> LaserScan:
    """Read `ROBOTLASER1 type, start, view, step, range, accuracy, remission mode, n ranges, m
    remissions, x y heading of the laser, the same of the robot, speeds and distances, times`."""
    start, view, step = (math.degrees(float(word)) for word in words[2:5])
    max_range_m = float(words[5])
    ranges_m, at = _readings(words, 8, after=1)
    at = _readings(words, at, after=14)[1]
    if not (math.isfinite(step) and step > 0):
        step = view / max(len(ranges_m) - 1, 1)
    far_m = max_range_m if max_range_m > 0 else math.inf
    return _scan(ranges_m, _pose(words[at : at + 3]), (start, step), far_m, words[at + 11])


def _scan(
    ranges_m: FloatArray,
    pose: tuple[float, float, float],
    angles_deg: tuple[float, float],
    max_range_m: float,
    time: bytes,
) -> LaserScan:
    start_deg, step_deg = angles_deg
    try:
        return LaserScan(
            ranges_m,
            pose,
            start_rad=math.radians(start_deg),
            step_rad=math.radians(step_deg),
            max_range_m=max_range_m,
            time_s=float(time),
        )
    except InvalidValueError:
        raise _DamagedLineError("pose, angle or count out of range") from None


_READERS = {b"FLASER": _flaser, b"ROBOTLASER1": _robotlaser}
