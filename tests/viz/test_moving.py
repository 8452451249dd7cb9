"""Pictures that move: frames, pages with a slider, and the command that writes them."""

import base64
import io
import json
import re

import numpy as np
import pytest
from PIL import Image, ImageSequence

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.octile import JumpSearch, build_jump_graph
from hybridnav.viz import plot_proof, save_growth, save_proof, save_search
from tests.cli.test_commands import FIGURE

START, GOAL = (5, 5), (25, 20)


@pytest.fixture(scope="module")
def grid():
    return hn.example_map("figure1")


def frames_of(file):
    with Image.open(file) as image:
        return [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(image)]


def test_a_pyramid_grows_by_a_frame_for_each_level(grid, tmp_path):
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0)
    save_growth(pyramid, tmp_path / "growth.gif", width_in=3.0)
    assert len(frames_of(tmp_path / "growth.gif")) == len(pyramid)


def test_searches_open_more_from_frame_to_frame(grid, tmp_path):
    free = grid.enterable()
    records = {"A*": GridSearch(free).watch(START, GOAL)}
    records["octile"] = JumpSearch(build_jump_graph(free)).watch(START, GOAL)
    save_search(grid, records, tmp_path / "search.gif", width_in=4.0)
    frames = frames_of(tmp_path / "search.gif")
    dark = np.array([59, 162, 178])  # `style.PLACES[0]`, within what 256 colours change
    counts = [(abs(frame.astype(int) - dark).max(axis=2) < 12).sum() for frame in frames]
    assert counts[0] < counts[-2]
    assert sorted(counts[:-1]) == counts[:-1]
    assert len(frames) > 8


def test_a_page_holds_the_frames_and_asks_for_nothing(grid, tmp_path):
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0)
    save_growth(pyramid, tmp_path / "growth.html", width_in=3.0)
    text = (tmp_path / "growth.html").read_text("utf-8")
    assert not re.search(r"https?:|src=|href=|import ", text)
    (values,) = re.findall(r'json">(.*?)</script>', text, re.DOTALL)
    held = json.loads(values)
    assert len(held["frames"]) == len(held["milliseconds"]) == len(pyramid)
    for frame in held["frames"]:
        with Image.open(io.BytesIO(base64.b64decode(frame.partition(",")[2]))) as image:
            image.verify()


def test_the_heights_of_a_proof_rise_to_the_length_of_the_path(grid, tmp_path):
    result = hn.plan(grid, (0.5, 0.5), (2.0, 2.5), preset="octile")
    proof = hn.prove(result)
    drawn = plot_proof(grid, proof).images[-1].get_array()
    assert drawn is not None
    shown = np.ma.filled(drawn, 0.0)
    assert shown.max() == pytest.approx(result.cost, abs=0.2)
    save_proof(grid, proof, tmp_path / "proof.gif", width_in=3.0)
    assert len(frames_of(tmp_path / "proof.gif")) > 10
    with pytest.raises(InvalidValueError, match="preset octile"):
        plot_proof(grid, hn.prove(hn.plan(grid, (0.5, 0.5), (2.0, 2.5))))


@pytest.mark.parametrize(
    ("what", "name"),
    [("growth", "g.html"), ("search", "s.gif"), ("search", "s.trace.json"), ("proof", "p.gif")],
)
def test_the_command_draws_what_is_watched(cli, tmp_path, what, name):
    done = cli("show", FIGURE, "--robot-radius", "0.1", "--watch", what, tmp_path / name)
    assert (done.code, done.err) == (0, "")
    data = (tmp_path / name).read_bytes()
    assert data.startswith(
        {".gif": b"GIF8", ".html": b"<!doc"}.get(name[1:], b'{"version":"1.4.0"')
    )


@pytest.mark.parametrize(
    ("what", "name", "words"),
    [
        ("grow", "g.gif", "growth, descent, search, proof"),
        ("growth", "g.png", ".gif, .html"),
        ("growth", "g.trace.json", ".gif, .html"),
        ("search", "s.json", ".gif, .html"),
    ],
)
def test_what_cannot_be_watched_is_refused(cli, tmp_path, what, name, words):
    assert cli("show", FIGURE, "--watch", what, tmp_path / name).refuses(2, words)
