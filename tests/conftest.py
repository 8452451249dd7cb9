"""Fixtures for every test."""

import json
import math
import os
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings

# Time is for benchmarks: a first call that imports or compiles is no failure. `make test` tries the
# same examples each time, so that it says something about the change; `make test-full` asks for
# more of them and hunts with new ones.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("new", deadline=None, print_blob=True)
settings.load_profile("new" if "HYBRIDNAV_EXAMPLES" in os.environ else "same")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run files of few tests first: these take long, and the last one leaves processors idle."""
    n_tests = Counter(item.path for item in items)
    items.sort(key=lambda item: n_tests[item.path])


@dataclass(frozen=True)
class Outcome:
    """What one command did."""

    code: object
    out: str
    err: str

    @property
    def answer(self):
        """The JSON object on stdout, read strictly: no NaN, no Infinity, one line."""
        assert self.out.count("\n") == 1
        return json.loads(self.out, parse_constant=pytest.fail)

    def refuses(self, code, *words):
        """Check that there is no result and one line that says why."""
        assert (self.code, self.out) == (code, "")
        assert self.err.startswith("hybridnav: ")
        assert self.err.count("\n") == 1
        assert self.err.strip().isprintable()
        for word in words:
            assert word in self.err
        return True


@pytest.fixture
def cli(monkeypatch, capsys):
    """Run the command line in this process, which does not tell how long it compiles."""
    from hybridnav.cli import main, warm

    monkeypatch.setattr(warm, "_PATIENCE_S", math.inf)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["hybridnav", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return Outcome(ended.value.code, *capsys.readouterr())

    return run


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the reference data; tests that need it are skipped where there is none."""
    folder = os.environ.get("HYBRIDNAV_DATA")
    if not folder:
        pytest.skip("HYBRIDNAV_DATA is not set")
    return Path(folder)


@pytest.fixture(autouse=True)
def _own_interrupts() -> Iterator[None]:
    """Leave Ctrl-C to pytest where a test ran the command, which handles it for its process."""
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)
