"""Fixtures of all tests of the harness."""

import pytest

from tests.harness.small_runs import run_here


@pytest.fixture
def here(monkeypatch):
    """Start no process, where none is what a test is about."""
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
