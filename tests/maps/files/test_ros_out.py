"""ROS maps that are written: pixels, classes and frames survive."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

import hybridnav as hn
from tests.strategies import examples

MAPS = Path(__file__).parents[3] / "maps"
SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 6))


@st.composite
def thresholds(draw: st.DrawFn) -> tuple[float, float]:
    low = draw(st.floats(0.0, 0.9))
    return low, draw(st.floats(low + 0.01, 1.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


def written_again(path: Path, folder: Path) -> Path:
    grid = hn.load_map(path, robot_radius_m=0)
    target = folder / "again.yaml"
    hn.write_ros_map(grid, target)
    again = hn.load_map(target, robot_radius_m=0)
    assert again.frame == grid.frame
    assert np.array_equal(again.measured, grid.measured)
    return target.with_suffix(".pgm")


@given(
    arrays(np.uint8, SHAPES),
    st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.sampled_from([0.0, 3.14, -0.7])),
    st.sampled_from([0.05, 0.1, 1 / 3, 1e-4]),
    thresholds(),
)
@settings(max_examples=examples(100))
@pytest.mark.filterwarnings("ignore:.* cells have grey 205:hybridnav.MapWarning")
def test_an_image_of_8_bits_is_written_with_equal_pixels(
    folder: Path,
    pixels: np.ndarray,
    origin: tuple[float, float, float],
    side: float,
    limits: tuple[float, float],
) -> None:
    Image.fromarray(pixels).save(folder / "given.pgm")
    given_yaml = {
        "image": "given.pgm",
        "resolution": side,
        "origin": list(origin),
        "negate": 0,
        "free_thresh": limits[0],
        "occupied_thresh": limits[1],
    }
    (folder / "given.yaml").write_text(yaml.safe_dump(given_yaml), encoding="utf-8")
    again = np.asarray(Image.open(written_again(folder / "given.yaml", folder)))
    assert np.array_equal(again, pixels)


@pytest.mark.parametrize("name", ["figure1", "office"])
def test_our_maps_are_written_with_equal_pixels(name: str, tmp_path: Path) -> None:
    again = Image.open(written_again(MAPS / name / f"{name}.yaml", tmp_path))
    assert np.array_equal(np.asarray(again), np.asarray(Image.open(MAPS / name / f"{name}.pgm")))


@given(
    arrays(np.float32, SHAPES, elements=st.one_of(st.floats(0, 1, width=32), st.just(np.nan))),
    thresholds(),
)
@example(np.array([[0.1953125]], dtype=np.float32), (0.5, 1.0))
@settings(max_examples=examples(100))
def test_cells_keep_their_class_and_nearly_their_occupancy(
    folder: Path, probability: np.ndarray, limits: tuple[float, float]
) -> None:
    low, high = limits
    grid = hn.OccupancyGrid(
        probability, free_threshold=low, occupied_threshold=high, robot_radius_m=0
    )
    hn.write_ros_map(grid, folder / "any.yml")
    with warnings.catch_warnings():
        # A free cell may have the grey of unknown ones, which a reader is warned of.
        warnings.simplefilter("ignore", hn.MapWarning)
        again = hn.load_map(folder / "any.yml", robot_radius_m=0)
    assert np.array_equal(again.measured, grid.measured)
    known = ~np.isnan(probability)
    assert np.abs(again.probability - probability)[known].max(initial=0) < 1.01 / 255


def test_the_description_is_yaml_as_map_saver_writes_it(tmp_path: Path) -> None:
    frame = hn.Frame(0.05, (1e-7, -12.25), 0.5)
    grid = hn.OccupancyGrid(np.array([[0.0, np.nan], [1.0, 0.0]]), frame)
    hn.write_ros_map(grid, tmp_path / "müll: #1.yaml")
    values = yaml.safe_load((tmp_path / "müll: #1.yaml").read_text(encoding="utf-8"))
    assert values == {
        "image": "müll: #1.pgm",
        "mode": "trinary",
        "resolution": 0.05,
        "origin": [1e-7, -12.25, 0.5],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    pixels = np.asarray(Image.open(tmp_path / "müll: #1.pgm"))
    assert pixels.tolist() == [[0, 255], [255, 205]]


def test_a_map_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    grid = hn.example_map("figure1")
    with pytest.raises(hn.InvalidValueError, match="expected an OccupancyGrid"):
        hn.write_ros_map(grid.classes, tmp_path / "map.yaml")  # type: ignore[arg-type]
    with pytest.raises(hn.MapError, match=r"must be named \.yaml"):
        hn.write_ros_map(grid, tmp_path / "map.pgm")
    with pytest.raises(hn.MapError, match="cannot write"):
        hn.write_ros_map(grid, tmp_path / "none" / "map.yaml")
    narrow = hn.OccupancyGrid(
        np.array([[0.5]], np.float32), free_threshold=0.4999, occupied_threshold=0.5001
    )
    with pytest.raises(hn.MapError, match="leave no grey of 8 bits for unexplored cells"):
        hn.write_ros_map(narrow, tmp_path / "narrow.yaml")
    assert list(tmp_path.iterdir()) == []
