"""The commands of the core run where the wing, `hybridnav.ext`, is not installed."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

MAPS = Path(__file__).parents[2] / "maps"
FIGURE = str(MAPS / "figure1" / "figure1.yaml")
OFFICE = str(MAPS / "office" / "office.yaml")
RUNS = {
    "plan": ["plan", FIGURE, "--robot-radius", "0", "--start", "0.5,0.5", "--goal", "2.0,2.5"],
    "plan tour": ["plan", OFFICE, "--from", "room-3", "--to", "room-5", "--why"],
    "rooms": ["rooms", OFFICE, "--json"],
    "show": ["show", FIGURE, "--plot", "{tmp}/a.png"],
    "build": ["build", FIGURE, "-o", "{tmp}/a.hnm"],
    "evaluate": ["evaluate", FIGURE, "--pairs", "4", "-o", "{tmp}/run"],
}
NEEDS_THE_WING = {
    "export": ["export", OFFICE],
    "plan into a bag": [*RUNS["plan"], "--bag", "{tmp}/b.bag"],
    "evaluate a floor's graph": [*RUNS["evaluate"], "--graph", "g.lif.json", "--floor", "1"],
}
WITHOUT_WING = """
import contextlib, io, json, sys
import hybridnav._base.extension as registry

real = registry.extensions
def extensions(group):
    return {name: of for name, of in real(group).items() if not of.startswith("hybridnav.ext")}
registry.extensions = extensions
for package in ("agent", "fleet", "graphs", "live", "page"):
    sys.modules["hybridnav.ext." + package] = None  # importing it raises ImportError

from hybridnav.cli.app import run

for name, arguments in json.loads(sys.argv[1]).items():
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        code = run(arguments)
    print(json.dumps([name, code, out.getvalue()]))
"""


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Exit code and output of each command, by its name; they run in one process."""
    folder = str(tmp_path_factory.mktemp("runs"))
    runs = {
        name: [part.replace("{tmp}", folder) for part in arguments]
        for name, arguments in (RUNS | NEEDS_THE_WING).items()
    }
    command = [sys.executable, "-c", WITHOUT_WING, json.dumps(runs)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return {name: (code, out) for name, code, out in map(json.loads, told.splitlines())}


@pytest.mark.parametrize("name", RUNS)
def test_the_core_runs_without_the_wing(name, ended):
    code, out = ended[name]
    assert code == 0, out


@pytest.mark.parametrize("name", NEEDS_THE_WING)
def test_what_needs_the_wing_is_refused_in_one_line(name, ended):
    code, out = ended[name]
    assert code == 2
    assert "Traceback" not in out
    assert len(out.strip().splitlines()) == 1, out
