"""The first start: who compiles what, the lines for the user, and what an interrupt leaves."""

import logging
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from hybridnav._base.threads import cores
from hybridnav.cli import warm
from hybridnav.cli.warm import notice_of_compiling
from hybridnav.planning import load_preset

ROOT = Path(__file__).parents[2]
OFFICE = ROOT / "maps" / "office" / "office.yaml"
PLAN = ("plan", str(OFFICE), "--start", "1.0,13.2", "--goal", "40.6,19.4")
KERNELS = logging.getLogger("hybridnav.kernels")

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled"
)

# Whoever runs the tests in the background has Ctrl-C ignored, and that is handed on.
_COMMAND = (
    "import signal, sys\n"
    "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "from hybridnav.cli import main\n"
    "main()\n"
)


def started(cache: Path, words: tuple[str, ...] = PLAN) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", _COMMAND, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache)},
    )


def compilers(cache: Path) -> list[int]:
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_bytes()
            environment = (process / "environ").read_bytes()
        except OSError:
            continue
        if b"hybridnav.cli.warm" in command and os.fsencode(cache) in environment:
            found.append(int(process.name))
    return found


def wait_until(is_so, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not is_so() and time.monotonic() < end:
        time.sleep(0.05)
    assert is_so()


def test_the_user_is_told_once_and_only_of_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    with notice_of_compiling():
        KERNELS.info("compiled", extra={"seconds": 1.5, "is_kept": True})
        assert capsys.readouterr().err == ""
        for _ in range(3):
            KERNELS.info("compiled", extra={"seconds": 1.5, "is_kept": True})
    told = capsys.readouterr().err
    # Another command may need others: "once" is said of each kernel, not of the installation.
    assert told.startswith(
        "hybridnav: compiling kernels that this command needs, up to two minutes, once"
    )
    assert told.count("\n") == 1
    KERNELS.warning("compiled", extra={"seconds": 9.0, "is_kept": True})
    assert capsys.readouterr().err == ""


def test_a_next_start_that_is_quick_is_not_promised_where_nothing_is_kept(capsys):
    with notice_of_compiling():
        KERNELS.info("compiled", extra={"seconds": 9.0, "is_kept": False})
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("preset", "processors", "start", "jobs"),
    [
        ("shortest", 2, "cold", ["search-shortest"]),
        ("ompl", 2, "cold", ["search-shortest"]),
        ("octile", 2, "cold", ["search-octile"]),
        ("robot", 2, "cold", []),
        ("shortest", 1, "cold", []),
        ("shortest", 2, "warm", []),
    ],
)
def test_a_second_process_compiles_what_a_first_plan_searches_with(
    monkeypatch: pytest.MonkeyPatch, preset: str, processors: int, start: str, jobs: list[str]
) -> None:
    begun: list[str] = []
    monkeypatch.setattr(warm, "cores", lambda: processors)
    monkeypatch.setattr(warm, "_is_kept", lambda _: start == "warm")
    monkeypatch.setattr(warm, "start", begun.append)
    with warm.compiling_beside(load_preset(preset)) as compiled:
        compiled()
    assert begun == jobs


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks for processes in /proc")
@pytest.mark.skipif(cores() == 1, reason="one processor compiles alone")
def test_ctrl_c_ends_the_process_that_compiles(tmp_path: Path) -> None:
    with started(tmp_path) as process:
        wait_until(lambda: compilers(tmp_path))
        process.send_signal(signal.SIGINT)
        answer, told = process.communicate()
    assert (process.returncode, answer) == (130, "")
    assert told.count("\n") <= 1
    wait_until(lambda: not compilers(tmp_path), 10.0)


@pytest.mark.full  # compiles all kernels of a first plan
def test_a_first_plan_leaves_nothing_to_compile(tmp_path: Path) -> None:
    for is_first in (True, False):
        kept = len(list(tmp_path.rglob("*.nbi")))
        with started(tmp_path) as process:
            answer, told = process.communicate()
        assert process.returncode == 0
        assert "42.51 m (any-angle)" in answer
        assert told.count("compiling kernels") == is_first
        assert told.count("\n") == is_first
        assert (len(list(tmp_path.rglob("*.nbi"))) > kept) == is_first
    assert not compilers(tmp_path)


@pytest.mark.full  # compiles all kernels of a model
def test_a_model_leaves_nothing_to_compile_for_plans_on_it(tmp_path: Path) -> None:
    model, cache = str(tmp_path / "office.hnm"), tmp_path / "kernels"
    built = ("build", PLAN[1], "--preset", "shortest", "--find-rooms", "-o", model)
    ends = ("--start", "1.0,13.2", "--goal", "40.6,19.4"), ("--from", "room-1", "--to", "room-5")
    counts = []
    for words in (built, *(("plan", model, *one) for one in ends)):
        with started(cache, words) as process:
            process.communicate()
        assert process.returncode == 0
        counts.append(len(list(cache.rglob("*.nbc"))))
    assert counts[0] > 0
    assert counts[1:] == counts[:1] * 2


def test_set_up_compiles_whole_plans_not_their_searches_alone(monkeypatch):
    done: dict[str, list[str]] = {"compile_plan": [], "compile_search": []}
    for name, jobs in done.items():
        monkeypatch.setattr(warm, name, jobs.append)
    monkeypatch.setattr(warm, "start", warm.compile_job)
    others = (warm.ROOMS, warm.MODEL, warm.HARNESS)
    for job in others:
        monkeypatch.setattr(warm, f"compile_{job}", partial(done["compile_plan"].append, job))
    warm.main([])
    assert done["compile_plan"] == ["pyramid", *warm.PRESETS, *others]
    assert done["compile_search"] == ["shortest", "octile", "grid-astar"]


@pytest.mark.full
@pytest.mark.parametrize("preset", [*warm.PRESETS, warm.ROOMS, warm.MODEL, warm.HARNESS])
def test_the_small_map_compiles_what_one_of_a_building_needs(tmp_path: Path, preset: str) -> None:
    # What set-up compiles before.
    search = [warm.SEARCH + preset] if preset in warm.SEARCHES else []
    words = [*PLAN, "--preset", preset]
    if preset == warm.ROOMS:
        search, words = ["pyramid"], ["rooms", PLAN[1], "--find"]
    elif preset == warm.MODEL:
        search = [warm.SEARCH + "shortest", "shortest", warm.ROOMS]
        words = ["build", PLAN[1], "--find-rooms", "-o", str(tmp_path / "office.hnm")]
    elif preset == warm.HARNESS:
        search = [warm.SEARCH + "shortest", "grid-astar", "paper"]
        file, out = str(ROOT / "maps/figure1/figure1.yaml"), str(tmp_path / "run")
        more = "--baseline=weighted-astar", "--baseline=simple-graph", "--robot-radius=0"
        words = ["evaluate", file, "--preset=paper", *more, "--pairs=5", "-o", out]
    code = (
        "import os\n"
        "from pathlib import Path\n"
        "from hybridnav.cli.warm import compile_job\n"
        "from hybridnav.cli.app import run\n"
        "kept = lambda: set(Path(os.environ['NUMBA_CACHE_DIR']).rglob('*.nbc'))\n"
        f"for job in {[*search, preset]!r}: compile_job(job)\n"
        "before = kept()\n"
        f"assert before and run({words!r}) == 0\n"
        "assert kept() == before, sorted(file.name for file in kept() - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=False,
        encoding="utf-8",
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper", "robot", "ompl"])
def test_compiled_kernels_of_a_plan_load_no_linear_algebra(preset: str) -> None:
    told = _COMMAND.replace(
        "main()",
        "import atexit\natexit.register(lambda: print('scipy.linalg' in sys.modules))\nmain()",
    )
    command = [sys.executable, "-c", told, *PLAN, "--preset", preset]
    for _ in range(2):  # the first may compile, which loads it
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.endswith("False\n")
