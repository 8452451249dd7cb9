"""Records of the harness: append-only, resumable after a kill, ids that last."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.harness.methods import baseline_spec, preset_spec
from hybridnav.harness.names import MethodSpec
from hybridnav.harness.records import (
    RECORDS_FILE,
    RecordFile,
    pair_id,
    preparation_id,
    read_records,
)
from hybridnav.harness.scenes import Pair, map_digest
from tests.strategies import drawn, occupancy_grid

GRID = occupancy_grid(drawn("..#", "...", "#.."))


def record(name, **further):
    known = dict.fromkeys(("type", "map", "map_sha", "method", "method_sha", "status"), "x")
    return {"id": name, **known, **further}


def test_records_are_appended_and_none_twice(tmp_path):
    with RecordFile(tmp_path) as records:
        records.append([record("a"), record("b")])
        first = (tmp_path / RECORDS_FILE).read_bytes()
        records.append([record("b", status="other"), record("c")])
        assert records.ids == {"a", "b", "c"}
    with RecordFile(tmp_path) as records:
        assert records.ids == {"a", "b", "c"}
        records.append([record("c"), record("d")])
    assert (tmp_path / RECORDS_FILE).read_bytes().startswith(first)
    assert [one["id"] for one in read_records(tmp_path)] == ["a", "b", "c", "d"]
    assert read_records(tmp_path)[1]["status"] == "x"


def test_a_record_is_on_disk_when_it_is_appended(tmp_path):
    with RecordFile(tmp_path) as records:
        records.append([record("a")])
        assert [one["id"] for one in read_records(tmp_path)] == ["a"]


def test_a_line_cut_short_anywhere_is_dropped(tmp_path):
    path = tmp_path / RECORDS_FILE
    with RecordFile(tmp_path) as records:
        records.append([record("a"), record("é")])
    content = path.read_bytes()
    whole = content.index(b"\n") + 1
    for cut in range(whole, len(content)):
        path.write_bytes(content[:cut])
        assert [one["id"] for one in read_records(tmp_path)] == ["a"]
        with RecordFile(tmp_path) as records:
            assert records.ids == {"a"}
            records.append([record("b")])
        assert [one["id"] for one in read_records(tmp_path)] == ["a", "b"]


@pytest.mark.parametrize(
    "line",
    [b"{", b"[]", b'{"id": 3}', b'{"id": "a"}', b"null", b"", b"\xff\xfe", b"\x00\x00", b'"id"'],
)
def test_a_damaged_line_before_the_last_is_named(tmp_path, line):
    lines = [json.dumps(record("a")).encode(), line, json.dumps(record("b")).encode()]
    (tmp_path / RECORDS_FILE).write_bytes(b"\n".join(lines) + b"\n")
    with pytest.raises(InvalidValueError, match="line 2: no record") as caught:
        RecordFile(tmp_path)
    assert "\n" not in str(caught.value)
    with pytest.raises(InvalidValueError, match="line 2"):
        read_records(tmp_path)
    # What is there stays there: it may be worth more than a run.
    assert (tmp_path / RECORDS_FILE).read_bytes() == b"\n".join(lines) + b"\n"


def test_a_folder_without_records_has_none(tmp_path):
    assert read_records(tmp_path) == []
    assert read_records(tmp_path / "nowhere") == []
    (tmp_path / RECORDS_FILE).mkdir()
    with pytest.raises(InvalidValueError, match=r"records\.jsonl"):
        read_records(tmp_path)


def test_equal_settings_have_equal_ids_and_others_have_others():
    pair = Pair((0, 0), (1, 1))
    spec, sha = preset_spec("paper"), map_digest(GRID)
    same = MethodSpec(spec.name, json.loads(json.dumps(spec.preset)), dict(spec.pyramid))
    assert pair_id(sha, same, replace(pair)) == pair_id(sha, spec, pair)
    turned = MethodSpec(spec.name, spec.preset, dict(reversed(spec.pyramid.items())))
    assert preparation_id(sha, turned) == preparation_id(sha, spec)
    others = [
        pair_id(map_digest(replace(GRID, corner_cutting=True)), spec, pair),
        pair_id(map_digest(replace(GRID, robot_radius_m=1.0)), spec, pair),
        pair_id(sha, preset_spec("paper", merge_distance_m=3.0), pair),
        pair_id(sha, preset_spec("paper", seed=3), pair),
        pair_id(sha, baseline_spec("simple-graph"), pair),
        pair_id(sha, spec, Pair((1, 1), (0, 0))),
        pair_id(sha, spec, Pair((0, 0), (1, 1), "lattice")),
        pair_id(sha, spec, pair),
        preparation_id(sha, spec),
    ]
    assert len(set(others)) == len(others)


def test_ids_are_the_same_in_every_process():
    code = (
        "from hybridnav.harness.methods import preset_spec\n"
        "from hybridnav.harness.scenes import Pair\n"
        "from hybridnav.harness.records import pair_id\n"
        "from hybridnav.harness.scenes import map_digest\n"
        "from tests.harness.test_records import GRID\n"
        "print(pair_id(map_digest(GRID), preset_spec('paper'), Pair((0, 0), (1, 1))))\n"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "4", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, env=environment
    )
    spec = preset_spec("paper")
    assert done.stdout.strip() == pair_id(map_digest(GRID), spec, Pair((0, 0), (1, 1)))


def test_a_description_is_no_setting():
    preset = preset_spec("paper").preset
    assert preset is not None
    assert "description" not in preset


def test_an_unknown_baseline_is_named_with_those_that_there_are():
    with pytest.raises(InvalidValueError, match=r"'a-stern'.*grid-astar.*thrun"):
        baseline_spec("a-stern")
