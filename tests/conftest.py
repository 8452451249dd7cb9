"""Fixtures for every test."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from tests.portal_memory import remember_portals

# Time is for benchmarks: a first call that imports or compiles is no failure.
settings.register_profile("hybridnav", deadline=None)
settings.load_profile("hybridnav")


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the reference data; tests that need it are skipped where there is none."""
    folder = os.environ.get("HYBRIDNAV_DATA")
    if not folder:
        pytest.skip("HYBRIDNAV_DATA is not set")
    return Path(folder)


@pytest.fixture(scope="session", autouse=True)
def _shared_portals() -> Iterator[None]:
    """Prepare the portals of a large map once for all tests of a process."""
    with pytest.MonkeyPatch.context() as patch:
        remember_portals(patch.setattr)
        yield


@pytest.fixture(autouse=True)
def _own_interrupts() -> Iterator[None]:
    """Leave Ctrl-C to pytest where a test ran the command, which handles it for its process."""
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)
