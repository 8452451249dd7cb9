"""Logs of laser scans: what is damaged, or does not follow, is left out and counted."""

import gzip
import io
import math
import zlib
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator
from typing import cast

import numpy as np
from typing_extensions import Buffer

from hybridnav._base.files import printable
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav._base.yaml_file import open_file
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.live.mapping import LaserScan, ScanSequence

_LONGEST_PAUSE_S = 600.0


class ScanLog(ABC):
    """A log as an iterable of its laser scans, with counts of what was left out.

    Scans that do not follow from those before (see `ScanSequence`) are left out and counted, as are
    those that the format calls damaged.
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

        `fault`: why, in a few words.
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


# Logs of CARMEN: the scans of a laser, read line by line from files that may be damaged.
#
# Formats: CARMEN, the Carnegie Mellon Robot Navigation Toolkit, messages FLASER and ROBOTLASER1.

_GZIP = b"\x1f\x8b"
_MOST_BYTES = 2**20
"""Bytes of a line that are read; longer lines are damaged."""
_MOST_UNPACKED = 2**26
"""Bytes that any packed log may unpack to."""
_MOST_TIMES = 50
"""How many times as large as the file that may be, where it is more; public logs unpack to 3 to 6
times their size, zeros to 1,000 times."""
_MOST_BEAMS = 100_000
_KNOWN_STEPS = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5, 400: 0.25, 401: 0.25}
"""Degrees between the beams of a SICK LMS by their number. FLASER does not state them."""
_CUT_OFF = "line cut off"
_NO_NUMBER = "no number"


class _DamagedLineError(Exception):
    """A line that is no scan; its text is the fault in a few words."""


class CarmenLog(ScanLog):
    r"""A log of CARMEN, as an iterable of its laser scans.

    FLASER and ROBOTLASER1 are read; if a log holds both, those of the kind that comes first. Poses
    are those of the laser, into which CARMEN has put its offset on the robot. The largest range is
    that of ROBOTLASER1, or of `robot_front_laser_max` among the parameters of the log.

    Lines that are cut off or hold no numbers, and scans that do not follow from those before (see
    `ScanSequence`), are left out and counted. The file is read line by line: memory does not grow
    with its size. A packed log that unpacks to more than 64 MiB, and to more than 50 times its
    size, is refused when it is read so far.

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
    >>> from hybridnav.ext.live import CarmenLog
    >>> from pathlib import Path
    >>> ranges = " ".join(["2.0"] * 181)
    >>> line = f"FLASER 181 {ranges} 0 0 0 0 0 0 {{0}} robot {{0}}\n"
    >>> _ = Path("tiny.log").write_text(line.format(0.5) + line.format(1.5) + "FLASER 181 2.0 2.")
    >>> log = CarmenLog("tiny.log")
    >>> [scan.time_s for scan in log]
    [0.5, 1.5]
    >>> log.summary()
    'left out 1 of 3 scans: 1 line cut off'
    """

    expected = "lines FLASER or ROBOTLASER1"

    def __init__(self, path: PathLike) -> None:
        self._path = path
        with self._open() as file:
            super().__init__(path, file.seek(0, 2))

    def _open(self) -> io.BufferedReader:
        file = open_file(self._path, what="log", error=MapError, missing=MapNotFoundError)
        return cast("io.BufferedReader", file)

    def _read(self) -> Iterator[LaserScan | str]:
        reader = _LineReader()
        with self._open() as file:
            for line in self._lines(file):
                try:
                    scan = reader.scan_of(line)
                except _DamagedLineError as fault:
                    yield str(fault)
                    continue
                if scan is not None:
                    yield scan

    def _lines(self, file: io.BufferedReader) -> Iterator[bytes]:
        is_packed = file.read(2) == _GZIP
        file.seek(0)
        most = max(_MOST_UNPACKED, _MOST_TIMES * self.size_bytes) if is_packed else self.size_bytes
        readable = _Readable(gzip.GzipFile(fileobj=file) if is_packed else file, most)
        stream = io.BufferedReader(readable)
        while line := stream.readline(_MOST_BYTES):
            self.bytes_read = file.tell()
            if len(line) < _MOST_BYTES or line.endswith(b"\n"):
                yield line
                continue
            self.skipped["line too long"] += 1
            while line and not line.endswith(b"\n"):
                line = stream.readline(_MOST_BYTES)
        if readable.is_cut:
            raise MapError(
                f"log {printable(self._path)}: unpacks to more than {most / 2**20:,.0f} MiB, "
                f"expected at most that for a file of {self.size_bytes / 2**20:,.1f} MiB: unpack "
                "it by gunzip if it is sound"
            )
        if readable.is_damaged:
            self.notes.append("the rest of the file is damaged")
        self.bytes_read = self.size_bytes


class _Readable(io.RawIOBase):
    """The bytes of a file as far as they can be read, and no more than a number of them."""

    def __init__(self, file: io.BufferedReader | gzip.GzipFile, most_bytes: int) -> None:
        self._file, self._left = file, most_bytes
        self.is_damaged = False
        self.is_cut = False
        """Whether there are more bytes."""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Buffer) -> int:
        """Fill a buffer; return the number of bytes, 0 at the end and where damage begins."""
        there = memoryview(buffer)
        try:
            some = self._file.read1(len(there))  # what is there before damage, too
        except (EOFError, OSError, zlib.error):
            self.is_damaged, some = True, b""
        self._left -= len(some)
        if self._left < 0:
            self.is_cut, some = True, b""
        there[: len(some)] = some
        return len(some)


class _LineReader:
    """The lines of one log, whose first scan and parameters decide how others are read."""

    def __init__(self) -> None:
        self._kind: bytes | None = None
        self._max_range_m = math.inf

    def scan_of(self, line: bytes) -> LaserScan | None:
        words = line.split()
        if not words:
            return None
        if words[0] == b"PARAM":
            self._read_parameter(words)
        if words[0] not in _READERS:
            if not line.endswith(b"\n") and any(kind.startswith(line) for kind in _READERS):
                raise _DamagedLineError(_CUT_OFF)
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

    `begin`: index of the length; `after`: number of words that follow the list, at least.
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
