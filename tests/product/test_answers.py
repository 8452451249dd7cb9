"""The answers file: whatever is planned, built and written stays what it is, bit for bit."""

import json
import os
from pathlib import Path

import pytest

from benchmarks.subjects._study_maps import maps_of
from benchmarks.subjects.answers import (
    ANSWERS,
    command_answers,
    differences,
    file_answers,
    map_answers,
)

DATA = os.environ.get("HYBRIDNAV_DATA")
EXPECTED = json.loads(ANSWERS.read_text())
MAPS = {} if DATA is None else {m.path.relative_to(DATA).as_posix(): m for m in maps_of(Path(DATA))}


@pytest.mark.full
@pytest.mark.parametrize("part", [file_answers, command_answers])
def test_files_and_commands_are_what_they_were(part):
    assert list(differences(part(), EXPECTED)) == []


@pytest.mark.full
@pytest.mark.parametrize("name", MAPS)
@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
def test_pyramids_rooms_and_plans_of_a_map_are_what_they_were(name):
    assert list(differences(map_answers(MAPS[name], name), EXPECTED)) == []
