"""Large maps: the header is read first, and the limit is named before memory is taken."""

import io

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.cli.app import run
from hybridnav.harness.scenes import MapSpec, read_map

KEYS = "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
LIMIT = "more than the limit of 20,000,000; reading them takes about 1.2 GB of memory, planning "


@pytest.fixture
def maps(tmp_path):
    """A ROS map and a MovingAI map of 30 x 20 cells, all free."""
    Image.fromarray(np.full((20, 30), 254, np.uint8)).save(tmp_path / "m.png")
    (tmp_path / "a.yaml").write_text(f"image: m.png\n{KEYS}")
    rows = "type octile\nheight 20\nwidth 30\nmap\n" + ("." * 30 + "\n") * 20
    (tmp_path / "a.map").write_text(rows)
    return tmp_path / "a.yaml", tmp_path / "a.map"


def _huge(folder):
    """A PNG of 25 million white cells, a few kilobytes, cut after its header and a map of it."""
    stream = io.BytesIO()
    Image.new("L", (5000, 5000), 255).save(stream, "PNG")
    (folder / "huge.png").write_bytes(stream.getvalue())
    path = folder / "huge.yaml"
    path.write_text(f"image: huge.png\n{KEYS}")
    return path


def test_a_huge_map_is_refused_with_its_cells_its_memory_and_the_option(tmp_path, monkeypatch):
    path = _huge(tmp_path)
    monkeypatch.setattr(Image.Image, "convert", lambda *_: pytest.fail("pixels were read"))
    with pytest.raises(hn.MapError, match="5000 x 5000 = 25,000,000 cells, ") as refused:
        hn.load_map(path)
    told = str(refused.value)
    assert LIMIT + "up to 7.5 GB" in told
    assert "--max-cells 25000000, in Python max_cells" in told
    assert "huge.png" in told
    assert told.isprintable()


def test_a_huge_movingai_map_is_refused_by_its_header(tmp_path):
    path = tmp_path / "huge.map"
    path.write_text("type octile\nheight 5000\nwidth 5000\nmap\n")
    with pytest.raises(hn.MapError, match="5000 x 5000 = 25,000,000 cells, " + LIMIT):
        hn.load_map(path)


def test_the_limit_is_inclusive_and_may_be_raised_and_lowered(maps):
    for path in maps:
        assert hn.load_map(path, max_cells=600).shape == (20, 30)
        with pytest.raises(hn.MapError, match="30 x 20 = 600 cells, more than the limit of 599;"):
            hn.load_map(path, max_cells=599)
        with pytest.raises(hn.InvalidValueError, match="max_cells must be a positive number"):
            hn.load_map(path, max_cells=0)
        read_map.cache_clear()
        with pytest.raises(hn.MapError, match="limit of 599"):
            read_map(MapSpec(str(path), 0.0, max_cells=599))


@pytest.mark.parametrize("command", ["plan", "tour", "show", "rooms", "evaluate"])
def test_every_command_takes_the_limit(maps, tmp_path, capsys, command):
    more = {
        "plan": ["--start", "0.5,0.5", "--goal", "1,0.5"],
        "tour": ["--from", "0.5,0.5", "--to", "room-1"],
        "evaluate": ["-o", str(tmp_path / "out")],
    }.get(command, [])
    name = "plan" if command == "tour" else command
    for path in maps:
        assert run([name, str(path), *more, "--max-cells", "599"]) == 3
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err.count("\n") == 1
        assert "600 cells, more than the limit of 599" in told.err
    assert run([name, str(maps[0]), *more, "--max-cells", "0"]) == 2
    assert "--max-cells" in capsys.readouterr().err


def test_a_label_image_of_another_size_is_refused_by_its_header(maps, tmp_path, monkeypatch):
    grid = hn.load_map(maps[0])
    _huge(tmp_path)
    (tmp_path / "rooms.yaml").write_text("locations: [hall]\ndata: huge.png\n")
    monkeypatch.setattr(Image.Image, "convert", lambda *_: pytest.fail("pixels were read"))
    with pytest.raises(hn.RoomsError, match="image of 5000 x 5000 pixels, the map has"):
        hn.load_rooms(tmp_path / "rooms.yaml", grid)
