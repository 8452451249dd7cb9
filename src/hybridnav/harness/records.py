"""Records: a JSON line for each query and method, append-only, resumable after any kill."""

import importlib.metadata
import json
import os
import platform
import re
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from typing_extensions import Self

import hybridnav
from hybridnav._base.moves import STEPS
from hybridnav._base.typing import LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.names import BASELINES, REFERENCE, MethodSpec
from hybridnav.harness.scenes import Pair
from hybridnav.harness.yardstick import Fault, Kind, contradiction
from hybridnav.maps.cells import MAX_CELLS

try:
    import fcntl
except ImportError:  # not a POSIX system: no lock there
    fcntl = None  # type: ignore[assignment]

Record = dict[str, Any]
QueryKey = tuple[str, tuple[int, ...], tuple[int, ...]]

RECORDS_FILE, RUNS_FILE = "records.jsonl", "runs.jsonl"

_KEYS = ("id", "type", "map", "map_sha", "method", "method_sha", "status")
_LIBRARIES = ("numpy", "scipy", "numba")


def pair_id(map_sha: str, spec: MethodSpec, pair: Pair) -> str:
    """Return the id of the record of one query: the same for equal map, settings and pair."""
    return f"{map_sha[:12]}/{spec.name}-{spec.digest}/{pair.key}"


def preparation_id(map_sha: str, spec: MethodSpec) -> str:
    """Return the id of the record of a method's preparation for a map."""
    return f"{map_sha[:12]}/{spec.name}-{spec.digest}/preparation"


def query_key(record: Record) -> QueryKey:
    """Return the key that the records of all methods share for one query on a map."""
    return record["kind"], tuple(record["start"]), tuple(record["goal"])


def fault_fields(faults: Iterable[Fault]) -> Record:
    """Return the fields that hold the faults of a record, one text for each kind, and the kinds."""
    of_kind: dict[str, list[str]] = {}
    for kind, text in faults:
        of_kind.setdefault(kind, []).append(text)
    texts = ["; ".join(each) for each in of_kind.values()]
    return {"faults": texts, **({"fault_kinds": list(of_kind)} if texts else {})}


def environment() -> dict[str, str]:
    """Return versions and host, a part of every preparation's record."""
    versions = {name: importlib.metadata.version(name) for name in _LIBRARIES}
    return {
        "hybridnav": hybridnav.__version__,
        "python": platform.python_version(),
        **versions,
        "host": platform.node(),
        "processor": _processor(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
    }


@cache
def _processor() -> str:
    """Return the name of the processor, as far as the system knows it."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def who_of(record: Record) -> str:
    """Return what has the name of a preparation's method; see `MethodSpec.who`."""
    return str(record.get("settings_sha", record["method"]))


class _Names:
    """The names of methods in one folder. A class is called what it calls itself where no other
    method is, and `module:class` where it never came to say a name.

    `specs`: methods whose names no class takes; one that two classes give themselves is nobody's.
    """

    def __init__(self, specs: Iterable[MethodSpec] = ()) -> None:
        given = {spec.digest: spec for spec in specs}
        called = Counter(spec.label for spec in given.values())
        self._whose = {label: "" for label, count in called.items() if count > 1}
        self._whose |= {name: name for name in BASELINES}
        self._whose |= {spec.name: spec.who for spec in given.values()}
        self._of: dict[str, str] = {}
        for digest, spec in given.items():
            if spec.label:
                self._call(digest, spec.label, spec.who)

    def _call(self, sha: str, own: str, who: str) -> None:
        """Note what a method calls itself, unless another one has that name."""
        if self._whose.setdefault(own, who) == who:
            self._of[sha] = own

    def lay(self, record: Record) -> None:
        sha, own = record["method_sha"], record.pop("label", record["method"])
        is_said = sha not in self._of or own != record.get("made_by", own)
        if record["type"] == "preparation" and is_said:
            self._call(sha, own, who_of(record))
        record["method"] = self._of.get(sha, record["method"])


class RecordFile:
    """The records of one run. Opening it drops a last line that a kill cut short.

    `folder`: folder of `records.jsonl`, which may be missing; `specs`: the methods of the run.
    Raises `InvalidValueError` when the file holds a line that is no record.
    """

    def __init__(self, folder: Path, specs: Iterable[MethodSpec] = ()) -> None:
        self.path = folder / RECORDS_FILE
        self.ids: set[str] = set()
        _drop_cut_line(self.path)
        self._names = _Names(specs)
        there = read_records(folder)
        for record in there:
            self._names.lay(record)
        self.ids = {record["id"] for record in there}
        made = (record for record in there if record["type"] == "preparation")
        self.costs = {str(record.get("costs", "")) for record in made}
        """Costs of the runs in this folder, as texts; empty for lengths."""
        self.failed: set[tuple[str, str]] = set()
        """Hashes of map and method of the preparations that failed."""
        self._note_failed(there)
        self._stream = self.path.open("ab")
        _lock(self._stream, folder)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stream.close()

    def append(self, records: Iterable[Record]) -> None:
        """Write records that are missing; they are on disk when this returns."""
        fresh = [record for record in records if record["id"] not in self.ids]
        for record in fresh:
            self._names.lay(record)
        lines = [json.dumps(record, allow_nan=False, separators=(",", ":")) for record in fresh]
        if not lines:
            return
        self._stream.write("".join(f"{line}\n" for line in lines).encode())
        self._stream.flush()
        os.fsync(self._stream.fileno())
        self.ids.update(record["id"] for record in fresh)
        self._note_failed(fresh)

    def _note_failed(self, records: Iterable[Record]) -> None:
        for record in records:
            if record["type"] == "preparation" and record["status"] != "ready":
                self.failed.add((record["map_sha"], record["method_sha"]))


def _lock(stream: BinaryIO, folder: Path) -> None:
    """Keep a second run out of the file; the lock ends with the process."""
    if fcntl is None:
        return
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        stream.close()
        raise InvalidValueError(f"another run is writing into folder {folder}") from None


def _drop_cut_line(path: Path) -> None:
    if not path.exists():
        return
    content = path.read_bytes()
    whole = content.rfind(b"\n") + 1
    if whole < len(content):
        with path.open("r+b") as stream:
            stream.truncate(whole)


def _runs(folder: Path) -> list[Record]:
    path = folder / RUNS_FILE
    runs = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        with suppress(ValueError):  # a line that a kill cut short
            runs.append(json.loads(line))
    return runs


def latest_sources(folder: Path) -> dict[str, str]:
    """Return by method the hash of the source of each class of others that its last run had."""
    latest: dict[str, str] = {}
    for run in _runs(folder):
        latest |= run.get("sources", {})
    return latest


def commands_of(folder: Path) -> list[str]:
    """Return the command lines of the runs into a folder, each once."""
    return list(dict.fromkeys(run["command"] for run in _runs(folder) if "command" in run))


def loads_of(folder: Path) -> list[float]:
    """Return the loads of the machine when the runs into a folder began, as far as known."""
    return [run["load"] for run in _runs(folder) if run.get("load") is not None]


def read_records(folder: Path) -> list[Record]:
    """Return all whole records of a run in the order written; none without a file.

    Their methods have the names that tables show. Their faults are all that is known: what the
    judge found of the answer, and what the reference of the same run contradicts, one text for each
    kind. All counts of contradictions are counts of them.

    Raises `InvalidValueError` when the file cannot be read, or a line of it is no record, or one of
    an older version whose any-angle length is not proved to be shortest.
    """
    path = folder / RECORDS_FILE
    records: list[Record] = []
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return records
    except OSError as error:
        raise InvalidValueError(f"records {path}: {error.strerror}") from None
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        try:
            record = json.loads(line)
        except ValueError:
            record = None
        if not isinstance(record, dict) or not all(
            isinstance(record.get(key), str) for key in _KEYS
        ):
            raise InvalidValueError(f"records {path}, line {number}: no record of this harness")
        if record.get("any_angle_exact") is False:
            raise InvalidValueError(
                f"records {path}, line {number}: its any-angle length is of an older version and "
                "no optimum: take a new folder"
            )
        records.append(record)
    _lay_names(records)
    optima = {
        (record["map_sha"], query_key(record)): record
        for record in records
        if record["type"] == "pair" and record["method"] == REFERENCE
    }
    for record in records:
        if record["type"] == "pair":
            _lay_contradiction(record, optima.get((record["map_sha"], query_key(record))))
        elif record["type"] == "preparation":
            _lay_contradiction(record, None)
    return records


def _lay_names(records: list[Record]) -> None:
    """Name the methods of records of one folder. Those of older versions say what a class calls
    itself in the `label` of its preparations alone."""
    names, made = _Names(), [record for record in records if record["type"] == "preparation"]
    for record in (*sorted(made, key=lambda one: "label" in one), *records):
        names.lay(record)


def _lay_contradiction(record: Record, reference: Record | None) -> None:
    """Add the contradiction by the reference to the faults of a record, unless it has one of that
    kind. Records of older versions have several texts of a kind, or no kinds.
    """
    texts = record.get("faults", ())
    usual: Kind = "regions" if record["type"] == "preparation" else "paths"
    faults = list(map(Fault, record.get("fault_kinds") or [usual] * len(texts), texts))
    wrong = None if reference is None else contradiction(record, reference)
    if wrong is not None and wrong.kind not in {fault.kind for fault in faults}:
        faults.append(wrong)
    record |= fault_fields(faults)


# One for each direction, counter-clockwise from east; anything else is written as cells.
_LETTERS = "abcdefgh"
_LETTER_OF = {tuple(step): letter for step, letter in zip(STEPS.tolist(), _LETTERS, strict=True)}
_RUN = re.compile(r"([a-h])(\d{1,9})|\((-?\d{1,18}),(-?\d{1,18})\)")


def encode_path(cells: LongArray) -> str:
    """Write a path's moves, such as "a12b3": twelve steps east, three north-east.

    `cells`: int64 (n, 2), n >= 1. A step that leads to no neighbour is written as "(rows,cols)".
    """
    steps = np.diff(cells, axis=0)
    ends = np.flatnonzero((steps[1:] != steps[:-1]).any(axis=1)) + 1
    starts = np.concatenate([[0], ends]) if len(steps) else np.empty(0, dtype=np.int64)
    counts = np.diff(np.concatenate([starts, [len(steps)]]))
    text = []
    for at, count in zip(starts.tolist(), counts.tolist(), strict=True):
        rows, cols = steps[at].tolist()
        letter = _LETTER_OF.get((rows, cols))
        text.append(f"{letter}{count}" if letter else f"({rows},{cols})" * count)
    return "".join(text)


def path_steps(text: str) -> int:
    """Return the steps of a path written by `encode_path`; a cell that comes twice is none."""
    runs = _RUN.finditer(text)
    return sum(int(run[2]) if run[1] else run[0] != "(0,0)" for run in runs)


def decode_path(start: tuple[int, int], text: str) -> LongArray:
    """Return the cells of a path from its first cell and its moves.

    Raises `InvalidValueError` when the text is no path.
    """
    runs = []
    end = total = 0
    for run in _RUN.finditer(text):
        letter, count, rows, cols = run.groups()
        total += int(count or 1)
        if run.start() != end or total > MAX_CELLS:
            break
        end = run.end()
        step = STEPS[[_LETTERS.index(letter)]] if letter else np.array([[int(rows), int(cols)]])
        runs.append((step, int(count or 1)))
    if end != len(text):
        raise InvalidValueError(f"no path: {text[end : end + 20]!r:.80} at character {end}")
    steps = [np.repeat(step, times, axis=0) for step, times in runs]
    return np.cumsum(np.concatenate([np.array([start]), *steps]), axis=0)
