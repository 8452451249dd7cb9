"""Changes of all kinds in random order, with directions among them; see `sequences`."""

from pathlib import Path

import pytest

from tests.ext.fleet.sequences import PRESETS, sequence_faults
from tests.strategies import examples


@pytest.mark.parametrize("preset", PRESETS)
def test_a_building_that_changes_answers_as_one_made_anew(tmp_path: Path, preset: str) -> None:
    for seed in range(examples(5, 20)):
        assert list(sequence_faults(seed, preset, 12, tmp_path)) == []
