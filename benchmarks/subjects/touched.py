"""What a plan touches in memory: lines of 64 bytes and pages, each once, by what they hold.

    python -m benchmarks touched --data FOLDER --preset shortest octile

A process plans, warm, and runs one instruction at a time (`ptrace`: Linux on x86-64). Where an
instruction stands, and what it reads and writes, is noted. With cold caches each line is a miss,
and each page a walk through the tables of the system: no hardware counters are needed. Medians over
`--pairs`. Takes half a minute a plan.
"""

import bisect
import ctypes
import os
import signal
import statistics
import sys
from argparse import Namespace
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.options import NEEDED_DATA, option
from benchmarks.tables import print_head, print_row

_CHILD = """
import os, signal, sys, warnings
import numpy as np
import hybridnav as hn
warnings.simplefilter("ignore")
path, preset, n_pairs = sys.argv[1], sys.argv[2], int(sys.argv[3])
grid = hn.load_map(path, robot_radius_m=0.25)
planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), preset=preset)
planner.prepare()
free, rng = np.argwhere(grid.classes == 1), np.random.default_rng(0)
pairs = [grid.frame.points_of(rng.choice(free, 2)) for _ in range(8 + n_pairs)]
def ask(pair):
    path = planner.plan(*pair).path
    return path and (path.points if preset == "shortest" else path.cells)
for pair in pairs:
    ask(pair)
search = planner.method.prepared
places = search.arrays, getattr(search, "engine", [()])[0], vars(getattr(search, "graph", None))
held, left = {}, [places, getattr(search, "_polygon_at", None), grid.classes]
while left:
    part = left.pop()
    if isinstance(part, np.ndarray):
        held[part.ctypes.data] = part.nbytes
    elif isinstance(part, (tuple, dict)):
        left += part.values() if isinstance(part, dict) else part
print(" ".join(f"{at} {size}" for at, size in held.items()), flush=True)
for pair in pairs[8:]:
    os.kill(os.getpid(), signal.SIGUSR1)
    ask(pair)
    os.kill(os.getpid(), signal.SIGUSR1)
"""
_TRACEME, _CONT, _STEP, _GETREGS = 0, 7, 9, 12
_NAMES = "R15 R14 R13 R12 RBP RBX R11 R10 R9 R8 RAX RCX RDX RSI RDI ORIG RIP CS FLAGS RSP SS FS"
_RCX, _RIP, _FS_BASE = 11, 16, 21
"""Places in `user_regs_struct` of Linux."""
_SHOWN = {
    "interpreter": "code of Python",
    "kernels": "code of kernels",
    "libraries": "code of numpy, numba, C",
    "arrays": "arrays of the map and its graph",
    "objects": "objects, types, stack, work",
}

_LIBC: Any = ctypes.CDLL(None)
_LIBC.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]


class _Decoder:
    """What the instructions at addresses access, by the disassembler of iced."""

    def __init__(self) -> None:
        self._iced: Any = import_module("iced_x86")
        self._info, self._known = self._iced.InstructionInfoFactory(), dict[int, Any]()
        self._at = {
            getattr(self._iced.Register, name): k
            for k, name in enumerate(_NAMES.split()) if hasattr(self._iced.Register, name)
        }  # fmt: skip

    def accesses(self, memory: int, registers: list[int]) -> Iterator[tuple[int, int]]:
        """Return address and bytes of an instruction, and of all that it reads and writes."""
        at = registers[_RIP]
        if at not in self._known:
            one = self._iced.Decoder(64, os.pread(memory, 15, at), ip=at).decode()
            parts = [
                (self._at.get(part.base), self._at.get(part.index), part.scale, part.displacement,
                 part.segment == self._iced.Register.FS,
                 self._iced.MemorySizeInfo(part.memory_size).size or 8)
                for part in self._info.info(one).used_memory() if part.access
            ]  # fmt: skip
            self._known[at] = one.len, parts, one.has_rep_prefix or one.has_repe_prefix
        size, parts, is_repeated = self._known[at]
        yield at, size
        for base, index, scale, offset, is_local, width in parts:
            place = offset + (registers[_FS_BASE] if is_local else 0)
            place += 0 if base is None else registers[base]
            place += 0 if index is None else registers[index] * scale
            yield place & (1 << 64) - 1, width * (registers[_RCX] if is_repeated else 1)


def plans(path: str, preset: str, n_pairs: int) -> Iterator[dict[str, int]]:
    """Return the counts of each plan of a process."""
    end, begin = os.pipe()
    child = os.fork()
    if not child:
        os.dup2(begin, 1)
        _LIBC.ptrace(_TRACEME, 0, None, None)
        words = [sys.executable, "-c", _CHILD, path, preset, str(n_pairs)]
        os.execv(sys.executable, words)  # noqa: S606 - in place of the fork, which is traced
    os.close(begin)
    decoder, registers = _Decoder(), (ctypes.c_ulonglong * 27)()
    while os.WIFSTOPPED(status := os.waitpid(child, 0)[1]):
        stopped_by = os.WSTOPSIG(status)
        if stopped_by == signal.SIGUSR1:
            with Path(f"/proc/{child}/mem").open("rb", buffering=0) as memory:
                touched = set[int](), set[int]()
                while True:
                    _LIBC.ptrace(_STEP, child, None, None)
                    if os.WSTOPSIG(os.waitpid(child, 0)[1]) == signal.SIGUSR1:
                        break
                    _LIBC.ptrace(_GETREGS, child, None, registers)
                    steps = decoder.accesses(memory.fileno(), list(registers))
                    for k, (at, size) in enumerate(steps):
                        touched[k > 0].update(range(at >> 6, (at + max(size, 1) - 1 >> 6) + 1))
            if "arrays" not in locals():
                arrays = sorted(zip(*[map(int, os.read(end, 1 << 16).split())] * 2, strict=True))
            yield counted(child, arrays, *touched)
        passed_on = 0 if stopped_by in {signal.SIGTRAP, signal.SIGUSR1} else stopped_by
        _LIBC.ptrace(_CONT, child, None, passed_on)


def counted(
    child: int, arrays: list[tuple[int, int]], code: set[int], data: set[int]
) -> dict[str, int]:
    """Return the lines of each kind, and the pages of all."""
    maps = Path(f"/proc/{child}/maps").read_text(encoding="utf-8")
    parts = [line.split() for line in maps.splitlines()]
    starts = [int(part[0].partition("-")[0], 16) for part in parts]
    counts = dict.fromkeys(_SHOWN, 0)
    for line in code:
        file = parts[bisect.bisect(starts, line << 6) - 1][5:]
        name = "kernels" if not file else "libraries"
        counts[
            "interpreter" if file and "python3" in file[0].rpartition("/")[2][:14] else name
        ] += 1
    for line in data:
        at, size = arrays[bisect.bisect(arrays, ((line + 1) << 6, 0)) - 1]
        counts["arrays" if at + size > line << 6 else "objects"] += 1
    return {**counts, "lines": len(code) + len(data), "pages": len({at >> 6 for at in code | data})}


OPTIONS = [
    NEEDED_DATA,
    option("--map", default="bwi_gdc/3/3.yaml", help="a map in the folder"),
    option("--preset", nargs="*", default=["shortest", "octile"]),
    option("--pairs", type=int, default=3),
]


def main(given: Namespace) -> None:
    """Print a table."""
    print_head("preset", *_SHOWN.values(), "lines in all", "pages")
    for preset in given.preset:
        found = list(plans(str(given.data / given.map), preset, given.pairs))
        print_row(preset, *(f"{statistics.median(one[k] for one in found):.0f}" for k in found[0]))
