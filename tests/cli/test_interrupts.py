"""Ctrl-C at any moment of a command: exit code 130, nothing on stderr, files old or new."""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hybridnav.cli.common import UsageError, check_writable

MAPS = Path(__file__).parents[2] / "maps"
FIGURE = MAPS / "figure1" / "figure1.yaml"
OFFICE = MAPS / "office" / "office.yaml"
PLAN = ("plan", OFFICE, "--start", "1.0,13.2", "--goal", "40.6,19.4", "--plot", "way.png")
ROOMS = ("rooms", OFFICE, "-o", "rooms.yaml", "--force", "--plot", "rooms.svg")

# Whoever runs the tests in the background has Ctrl-C ignored, and that is handed on.
_COMMAND = (
    "import signal\n"
    "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "from hybridnav.cli import main\n"
    "main()\n"
)


def started(folder: Path, *arguments: object) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", _COMMAND, *map(str, arguments)],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def strike(folder: Path, arguments: tuple[object, ...], count: int) -> int:
    """Interrupt a command at moments spread over its run; how many were struck."""
    began = time.perf_counter()
    with started(folder, *arguments) as whole:
        whole.communicate()
    duration_s = time.perf_counter() - began
    assert whole.returncode == 0
    left = {path.name: path.read_bytes() for path in folder.iterdir()}
    n_struck = 0
    # What comes before is Python's own start.
    for part in np.linspace(0.25, 0.95, count):
        began = time.perf_counter()
        with started(folder, *arguments) as process:
            try:
                process.wait(part * duration_s)
                duration_s = time.perf_counter() - began  # the run before was slower
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
            answer, complaint = process.communicate()
        assert complaint == b""
        assert process.returncode == 130 or (process.returncode == 0 and answer)
        n_struck += process.returncode == 130
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == left
    return n_struck


def test_ctrl_c_at_a_few_moments_of_a_command(tmp_path: Path) -> None:
    assert strike(tmp_path, ("rooms", FIGURE, "-o", "rooms.yaml", "--force"), 2) > 0


@pytest.mark.full
@pytest.mark.parametrize("arguments", [PLAN, ROOMS], ids=["plan", "rooms"])
def test_ctrl_c_at_many_moments_of_a_command(arguments: tuple[object, ...], tmp_path: Path) -> None:
    assert strike(tmp_path, arguments, 60) > 0


def ended_by_ctrl_c(script: str) -> tuple[int, str]:
    """Exit code and stderr of a command to which a script does something first."""
    script = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n" + script
    done = subprocess.run(
        [sys.executable, "-c", script, "show", str(OFFICE)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return done.returncode, done.stderr


# A callback whose exceptions Python prints and drops.
_IN_CALLBACK = """
import weakref
class Held: pass
held = Held()
weakref.finalize(held, signal.raise_signal, signal.SIGINT)
del held
"""
# A library that catches everything.
_CAUGHT = """
try: signal.raise_signal(signal.SIGINT)
except BaseException: pass
"""
# An import that turns it into another error.
_TURNED = """
try: signal.raise_signal(signal.SIGINT)
except BaseException as error: raise ImportError('half') from error
"""


@pytest.mark.parametrize("moment", [_IN_CALLBACK, _CAUGHT, _TURNED])
def test_ctrl_c_is_not_lost_where_exceptions_are(moment: str) -> None:
    body = moment.replace("\n", "\n    ")
    script = (
        "import hybridnav.maps.files.formats\n"
        f"def load_map(*_, **__):\n    {body}\n    raise SystemExit(7)\n"
        "hybridnav.maps.files.formats.load_map = load_map\n"
        "from hybridnav.cli import main\n"
        "main()\n"
    )
    assert ended_by_ctrl_c(script) == (130, "")


def test_whoever_ignores_ctrl_c_goes_on_ignoring_it(tmp_path: Path) -> None:
    script = _COMMAND.replace("default_int_handler", "SIG_IGN").replace(
        "main()\n", "signal.raise_signal(signal.SIGINT)\nmain()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "preset", "list"],
        capture_output=True,
        check=False,
        cwd=tmp_path,
    )
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_file_may_have_the_longest_name_of_any_letters(tmp_path: Path) -> None:
    file = tmp_path / ("房" * 83 + ".yaml")
    check_writable(file, "--out")


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_a_file_in_a_folder_that_takes_no_files_is_refused_before_anything_is_planned() -> None:
    file = Path("/proc/self/comm")
    assert os.access(file, os.W_OK)
    with pytest.raises(UsageError, match="--out: cannot write '/proc/self/comm'"):
        check_writable(file, "--out")


def test_a_trial_does_not_end_what_the_reader_of_a_pipe_gets(tmp_path: Path) -> None:
    pipe = tmp_path / "way.png"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_writable(pipe, "--plot")
        waiting = select.poll()
        waiting.register(reader, select.POLLIN)
        assert waiting.poll(0) == []
    finally:
        os.close(reader)


def test_a_folder_is_no_file_to_write(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Is a directory"):
        check_writable(tmp_path, "--out")
    assert not list(tmp_path.iterdir())
