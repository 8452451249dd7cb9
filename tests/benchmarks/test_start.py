"""The table of starts: every line has its figure."""

from __future__ import annotations

import pytest

from benchmarks import start


@pytest.mark.full
def test_every_wait_is_measured(capsys: pytest.CaptureFixture[str]) -> None:
    assert start.main(["--cells", "10000", "--runs", "1"]) == 0
    lines = capsys.readouterr().out.strip().splitlines()[2:]
    assert len(lines) == 9
    assert all(cells.split("|")[2].strip()[0].isdigit() for cells in lines)
