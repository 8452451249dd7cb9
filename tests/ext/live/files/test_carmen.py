"""Logs of CARMEN: lines written by hand, and files damaged in every way."""

import gzip
import math
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.live.mapping import LaserScan, Mapper
from tests.strategies import tried


def flaser(ranges: list[Any], pose: tuple[Any, Any, Any] = (1.0, 2.0, 0.5), time: Any = 7.5) -> str:
    x, y, heading = pose
    readings = " ".join(map(str, ranges))
    return f"FLASER {len(ranges)} {readings} {x} {y} {heading} 9 9 9 {time} host {time}\n"


def log_of(folder: Path, *lines: str, packed: bool = False) -> hn.ext.live.CarmenLog:
    text = "".join(lines).encode()
    path = folder / "a.log"
    path.write_bytes(gzip.compress(text) if packed else text)
    return hn.ext.live.CarmenLog(path)


def angles_of(scan: LaserScan) -> tuple[float, float]:
    """Direction of the first and of the last beam, in degrees."""
    last = scan.start_rad + (len(scan.ranges_m) - 1) * scan.step_rad
    return math.degrees(scan.start_rad), math.degrees(last)


@pytest.mark.parametrize("packed", [False, True])
def test_a_flaser_line_is_read(tmp_path: Path, *, packed: bool) -> None:
    ranges = [1.5, 2.25, *[3.0] * 178]
    log = log_of(tmp_path, "# made by hand\n", "ODOM 1 2 3\n", flaser(ranges), packed=packed)
    (scan,) = log
    assert scan.ranges_m.tolist() == ranges
    assert scan.pose == (1.0, 2.0, 0.5)
    assert scan.time_s == 7.5
    assert scan.max_range_m == math.inf
    assert angles_of(scan) == pytest.approx((-90, 89))
    assert log.summary() == "left out 0 of 1 scans"
    assert log.bytes_read == log.size_bytes


@pytest.mark.parametrize(
    ("count", "first", "last"),
    [
        (180, -90, 89),
        (181, -90, 90),
        (360, -90, 89.5),
        (361, -90, 90),
        (401, -50, 50),
        (5, -90, 90),
    ],
)
def test_the_number_of_beams_tells_their_angles(tmp_path, count, first, last):
    (scan,) = log_of(tmp_path, flaser([2.0] * count))
    assert angles_of(scan) == pytest.approx((first, last))


def robotlaser(n: int, *, remissions: int = 0, step: float = 0.5, far: float = 40.0) -> str:
    words: list[Any] = [
        0,
        -1.0,
        2.0,
        step,
        far,
        0.01,
        0,
        n,
        *[2.5] * n,
        remissions,
        *[100] * remissions,
    ]
    words += [3.0, 4.0, 0.25, 2.9, 4.0, 0.25, 0, 0, 0.1, 0.2, 0.3, 12.5, "host", 12.6]
    return f"ROBOTLASER1 {' '.join(map(str, words))}\n"


@pytest.mark.parametrize("remissions", [0, 5])
def test_a_robotlaser_line_states_its_angles_and_range(tmp_path: Path, remissions: int) -> None:
    (scan,) = log_of(tmp_path, robotlaser(5, remissions=remissions))
    assert scan.ranges_m.tolist() == [2.5] * 5
    assert scan.pose == (3.0, 4.0, 0.25)
    assert (scan.start_rad, scan.step_rad, scan.max_range_m) == pytest.approx((-1.0, 0.5, 40.0))
    assert scan.time_s == 12.5


def test_a_robotlaser_line_without_a_step_spreads_its_beams(tmp_path: Path) -> None:
    (scan,) = log_of(tmp_path, robotlaser(5, step=0.0, far=0.0))
    assert (scan.step_rad, scan.max_range_m) == pytest.approx((0.5, math.inf))


def test_of_two_kinds_of_lines_the_first_is_read(tmp_path: Path) -> None:
    log = log_of(tmp_path, robotlaser(5), flaser([1.0] * 5), robotlaser(5))
    assert [scan.time_s for scan in log] == [12.5, 12.5]
    assert log.summary() == "left out 0 of 2 scans"


def test_the_parameters_state_the_greatest_range(tmp_path: Path) -> None:
    lines = ["PARAM robot_front_laser_max 8.0 host 0\n", "PARAM robot_front_laser_max far\n"]
    (scan,) = log_of(tmp_path, *lines, "PARAM\n", flaser([1.0, 9.0]))
    assert scan.max_range_m == 8.0


GOOD = [1.0, 2.0, 3.0]
DAMAGED = {
    flaser(GOOD)[:-30] + "\n": "line cut off",
    "FLASER 3 1.0 2.\n": "line cut off",
    "FLASER\n": "line cut off",
    "FLASER 100000 1 1 1 0 0 0 0 0 0 1 host 1\n": "line cut off",
    "FLASER -3 1 1 1 0 0 0 0 0 0 1 host 1\n": "no number",
    "FLASER 99999999999999 1 1 1 0 0 0 0 0 0 1 host 1\n": "no number",
    "FLASER three 1 1 1 0 0 0 0 0 0 1 host 1\n": "no number",
    flaser([1.0, "2.x", 3.0]): "no number",
    flaser(GOOD, time="noon"): "no number",
    flaser(GOOD, ("nan", 0, 0)): "pose, angle or count out of range",
    flaser(GOOD, (0, "inf", 0)): "pose, angle or count out of range",
    flaser(GOOD, (0, 0, "1e300")): "pose, angle or count out of range",
    flaser([]): "pose, angle or count out of range",
    flaser([1.0]): "other number of beams",
    flaser(GOOD, (500.0, 0, 0)): "pose jumps",
    flaser(GOOD, time=7.0): "time runs back",
    "FLASER " + "1 " * 600_000 + "\n": "line too long",
}


@pytest.mark.parametrize(("line", "fault"), DAMAGED.items(), ids=range(len(DAMAGED)))
def test_a_damaged_line_is_left_out_and_counted(tmp_path: Path, line: str, fault: str) -> None:
    log = log_of(tmp_path, flaser(GOOD), line, flaser(GOOD, time=8.5))
    assert [scan.time_s for scan in log] == [7.5, 8.5]
    assert log.summary() == f"left out 1 of 3 scans: 1 {fault}"
    assert [scan.time_s for scan in log] == [7.5, 8.5]  # counted anew
    assert log.skipped == {fault: 1}


FIRST = {
    "pose jumps": flaser(GOOD, (500.0, 0, 0), 1.0),
    "time runs back": flaser(GOOD, time=900.0),
    "other number of beams": flaser([1.0], time=1.0),
}


@pytest.mark.parametrize(("fault", "line"), FIRST.items())
def test_a_wrong_first_scan_is_left_out(tmp_path: Path, fault: str, line: str) -> None:
    good = [flaser(GOOD, time=time) for time in (2.0, 3.0, 4.0)]
    log = log_of(tmp_path, line, *good)
    assert [scan.time_s for scan in log] == [2.0, 3.0, 4.0]
    assert log.summary() == f"left out 1 of 4 scans: 1 {fault}"
    assert len(list(log_of(tmp_path, line))) == 1  # nothing speaks against it


def test_readings_that_are_no_lengths_are_counted_and_mark_no_cell(tmp_path: Path) -> None:
    bad = ["nan", "inf", "-inf", -1.0, "1e999", 0.0]
    log = log_of(tmp_path, flaser([2.0, *bad]), flaser([2.0, *[0.0] * len(bad)], time=8))
    with_bad, without = (Mapper(resolution_m=0.1), Mapper(resolution_m=0.1))
    first, second = log
    with_bad.add(first)
    without.add(second)
    assert log.summary() == "left out 0 of 2 scans; 5 readings are no lengths"
    found, expected = with_bad.to_grid().probability, without.to_grid().probability
    assert np.array_equal(found, expected, equal_nan=True)


def test_a_packed_log_that_is_cut_off_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "a.log.gz"
    rng = np.random.default_rng(0)
    lines = [flaser(rng.random(50).tolist(), time=k) for k in range(400)]
    text = "".join(lines).encode()
    whole = gzip.compress(text)
    packed = whole[: len(whole) // 2]
    path.write_bytes(packed)
    log = hn.ext.live.CarmenLog(path)
    n_read = len(list(log))
    there = zlib.decompressobj(31).decompress(packed)
    assert n_read == there.count(b"\n")
    assert log.summary() == (
        f"left out 1 of {n_read + 1} scans: 1 line cut off; the rest of the file is damaged"
    )
    damaged = bytearray(whole)
    damaged[len(whole) // 2 :] = rng.bytes(len(whole) - len(whole) // 2)
    path.write_bytes(bytes(damaged))
    assert len(list(log)) >= 100


@pytest.mark.parametrize("content", [b"\0", b"#" * 1000 + b"\n"], ids=["zeros", "lines"])
def test_a_packed_log_is_unpacked_no_further_than_a_limit(tmp_path: Path, content: bytes) -> None:
    """200 MB in a file of 0.2 to 1 MB: 64 MiB of them are read."""
    path, block = tmp_path / "a.log", content * (2**20 // len(content))
    with gzip.open(path, "wb", compresslevel=1) as file:
        for _ in range(200):
            file.write(block)
    log = hn.ext.live.CarmenLog(path)
    tracemalloc.start()
    with pytest.raises(
        hn.errors.MapError, match="unpacks to more than 64 MiB, expected at most"
    ) as error:
        for _ in log:
            pass
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**23
    assert log.bytes_read < log.size_bytes * 0.5
    assert "\n" not in str(error.value)
    assert "gunzip" in str(error.value)


def test_a_small_log_may_unpack_to_any_multiple(tmp_path: Path) -> None:
    lines = [flaser([2.0] * 1000, time=k) for k in range(500)]
    log = log_of(tmp_path, *lines, packed=True)
    assert log.size_bytes * 50 < sum(map(len, lines))
    assert len(list(log)) == 500


@pytest.mark.parametrize("cut", [1, 4, 8, -10])
def test_damage_behind_the_last_scan_leaves_out_none(tmp_path: Path, cut: int) -> None:
    packed = gzip.compress("".join(flaser(GOOD, time=k) for k in range(5)).encode())
    path = tmp_path / "a.log.gz"
    path.write_bytes(packed[:-cut] if cut > 0 else packed + b"more bytes")
    log = hn.ext.live.CarmenLog(path)
    assert len(list(log)) == 5
    assert log.summary() == "left out 0 of 5 scans; the rest of the file is damaged"


@pytest.mark.parametrize("line", [flaser([1.0, 2.0, 3.0]), robotlaser(3)])
def test_a_log_may_be_cut_off_anywhere_in_its_last_line(tmp_path: Path, line: str) -> None:
    for cut in range(1, len(line)):
        log = log_of(tmp_path, line, line[:cut])
        n_read = len(list(log))
        assert n_read + log.skipped.total() == 2, line[:cut]
        assert n_read == 1 or cut > line.index("host") + len("host "), line[:cut]


@tried(100, noise=st.binary(max_size=300), at=st.integers(0, 200), packed=st.booleans())
def test_any_bytes_end_in_scans_or_counts(tmp_path_factory, *, noise, at, packed):
    text = "".join(flaser(GOOD, time=k) for k in range(5)).encode()
    content = gzip.compress(text) if packed else text
    path = tmp_path_factory.mktemp("log") / "noise.log"
    path.write_bytes(content[:at] + noise + content[at:])
    log = hn.ext.live.CarmenLog(path)
    mapper = Mapper(resolution_m=1.0, max_cells=10_000)
    for scan in log:
        mapper.add(scan)
    assert "\n" not in log.summary()
    if mapper.has_cells:
        probability = mapper.to_grid().probability
        assert np.nanmin(probability) >= 0.019
        assert np.nanmax(probability) <= 0.981


def test_time_adds_up_without_long_pauses(tmp_path: Path) -> None:
    times = [0.0, 10.0, 25.0, 1e9, 1e9 + 5]
    log = log_of(tmp_path, *(flaser(GOOD, time=f"{time:.1f}") for time in times))
    assert len(list(log)) == 5
    assert log.duration_s == 30.0


def test_a_log_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(hn.errors.MapNotFoundError, match=r"log .*none\.log: no such file"):
        hn.ext.live.CarmenLog(tmp_path / "none.log")
    with pytest.raises(hn.errors.MapError, match="directory"):
        hn.ext.live.CarmenLog(tmp_path)
