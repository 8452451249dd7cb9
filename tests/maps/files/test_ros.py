"""ROS maps: every pixel of every kind of image under every kind of YAML, and what is written."""

import csv
import math
import re
import struct
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import example
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, MapWarning
from hybridnav.maps import CellClass
from hybridnav.maps.files import load_map as load_inflated
from tests.strategies import tried

load_map = partial(load_inflated, robot_radius_m=0)
"""Values of the file, cell by cell."""

FREE, OCCUPIED, UNEXPLORED = CellClass.FREE, CellClass.OCCUPIED, CellClass.UNEXPLORED
DEFAULTS = {
    "image": "i.png",
    "resolution": "0.05",
    "origin": "[0, 0, 0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


@pytest.fixture
def write(tmp_path):
    """Write a map: an image, or bytes of one, and the YAML with some keys changed."""

    def write(image, name="i.png", /, *, yaml="a.yaml", **changes):
        if isinstance(image, bytes):
            (tmp_path / name).write_bytes(image)
        else:
            image.save(tmp_path / name)
        values = DEFAULTS | {"image": name} | changes
        lines = [f"{key}: {value}\n" for key, value in values.items() if value is not None]
        (tmp_path / yaml).write_text("".join(lines))
        return tmp_path / yaml

    return write


def _picture(rows, mode="L", dtype=np.uint8):
    return Image.fromarray(np.array(rows, dtype=dtype)).convert(mode)


GREYS = [[0, 100, 205], [254, 255, 90]]
GREY_CLASSES = [[FREE, FREE, UNEXPLORED], [OCCUPIED, UNEXPLORED, UNEXPLORED]]
"""What the defaults make of GREYS, row 0 at the bottom; 90 is occupied from 0.647 on."""


def _text(rows, maxval=255):
    height, width = np.shape(rows)
    pixels = "\n".join(" ".join(str(value) for value in row) for row in rows)
    return f"P2\n# a comment\n{width} {height}\n{maxval}\n{pixels}\n".encode()


def _wide(rows):
    """16-bit PGM."""
    values = np.array(rows, dtype=">u2") * 257
    height, width = values.shape
    return f"P5\n{width} {height}\n65535\n".encode() + values.tobytes()


@pytest.mark.parametrize(
    ("name", "image"),
    [
        ("i.png", _picture(GREYS)),
        ("i.png", _picture(GREYS, "RGB")),
        ("i.png", _picture(GREYS, "RGBA")),
        ("i.png", _picture(GREYS, "LA")),
        ("i.png", _picture(GREYS, "P")),
        ("i.png", Image.fromarray(np.array(GREYS, dtype=np.uint16) * 257)),
        ("i.pgm", _picture(GREYS)),
        ("i.ppm", _picture(GREYS, "RGB")),
        ("i.pgm", _text(GREYS)),
        ("i.pgm", _text(GREYS).replace(b"100", b"100 # in a row\n")),
        ("i.pgm", _text(GREYS).replace(b"\n", b"\r\n")),
        ("i.pgm", _text(np.array(GREYS) * 257, 65535)),
        ("i.pgm", _wide(GREYS)),
        ("i.bmp", _picture(GREYS)),
        ("i.tif", _picture(GREYS)),
        ("i.tif", Image.fromarray(np.array(GREYS, dtype=np.uint16) * 257)),
        ("i.gif", _picture(GREYS)),
        ("i.webp", _picture(GREYS, "RGBA")),
    ],
    ids=lambda value: getattr(value, "mode", None) or (value if isinstance(value, str) else "raw"),
)
def test_grey_means_the_same_in_every_format(write, name, image):
    if name == "i.webp":  # lossy unless told otherwise, unlike the rest
        path = write(_picture(GREYS), name)
        image.save(path.parent / name, lossless=True)
    else:
        path = write(image, name)
    grid = load_map(path)
    np.testing.assert_array_equal(grid.classes, GREY_CLASSES)
    expected = 1 - np.array(GREYS[::-1]) / 255
    np.testing.assert_allclose(grid.probability, expected, atol=1e-6)


def test_a_bilevel_image(write):
    grid = load_map(write(_picture([[0, 255], [255, 255]], "1")))
    np.testing.assert_array_equal(grid.classes, [[FREE, FREE], [OCCUPIED, FREE]])


def test_maxval_is_white(write):
    for image in (_text([[0, 50, 100]], 100), b"P5\n3 1\n100\n" + bytes([0, 50, 100])):
        grid = load_map(write(image, "i.pgm"))
        np.testing.assert_allclose(grid.probability, [[1, 0.5, 0]], atol=0.002)


def test_a_colour_has_the_grey_of_graphicsmagick(write):
    # Printed by Nav2's calls (navigation2, branch jazzy, nav2_map_server/src/map_io.cpp) with
    # GraphicsMagick 1.3.40 (Debian 12): Rec. 601 in 16 bits, cut off to 8 bits.
    greys = {
        (255, 0, 0): 76,
        (0, 255, 0): 149,
        (0, 0, 255): 29,
        (255, 255, 0): 225,
        (10, 20, 30): 18,
        (200, 100, 50): 124,
        (205, 205, 205): 205,
        (128, 127, 126): 127,
    }
    grid = load_map(write(Image.fromarray(np.array([list(greys)], dtype=np.uint8))))
    np.testing.assert_allclose(255 * (1 - grid.probability), [list(greys.values())], atol=1e-4)


def test_arithmetic_is_that_of_nav2(write):
    # map_io.cpp (jazzy): 1.0f - grey / 255.0f in float32; 1 - 153/255 is 0.39999998, below 0.4f.
    grid = load_map(write(_picture([[153, 152, 204]])), free_threshold=0.1, occupied_threshold=0.4)
    np.testing.assert_array_equal(grid.classes, [[UNEXPLORED, OCCUPIED, UNEXPLORED]])
    grid = load_map(write(_picture([[204, 203, 255]])), free_threshold=0, occupied_threshold=0.2)
    np.testing.assert_array_equal(grid.classes, [[UNEXPLORED, OCCUPIED, FREE]])


def test_where_thresholds_are_equal_a_cell_on_both_is_free(write):
    # map_io.cpp (jazzy) marks occupied cells, then free ones.
    path = write(_picture([[127, 128, 51]]), free_thresh=0.5, occupied_thresh=0.5)
    grid = load_map(path)
    np.testing.assert_array_equal(grid.classes, [[OCCUPIED, FREE, OCCUPIED]])
    grid = load_map(path, free_threshold=0.8, occupied_threshold=0.8)
    np.testing.assert_array_equal(grid.classes, [[FREE, FREE, FREE]])
    hn.write_ros_map(grid, path.parent / "again.yaml")
    np.testing.assert_array_equal(load_map(path.parent / "again.yaml").classes, grid.classes)


@pytest.mark.parametrize("samples", [2, 4])
def test_the_extra_sample_of_a_tiff_is_opacity(write, samples):
    # GraphicsMagick, and so map_saver, writes ExtraSamples (338) as 0, which Pillow drops.
    values = np.array([[[127, 0], [255, 255], [0, 255], [255, 254]]], dtype=np.uint8)
    mode = {2: "LA", 4: "RGBA"}[samples]
    path = write(Image.fromarray(values, "LA").convert(mode), "i.tif")
    image = path.parent / "i.tif"
    tag = struct.pack("<HHI", 338, 3, 1)
    data = image.read_bytes()
    assert data.count(tag) == 1
    image.write_bytes(data.replace(tag + b"\2", tag + b"\0"))
    np.testing.assert_array_equal(
        load_map(path).classes, [[UNEXPLORED, FREE, OCCUPIED, UNEXPLORED]]
    )


def test_a_threshold_may_be_stated_by_the_option_alone(write):
    path = write(_picture(GREYS), free_thresh=None)
    with pytest.raises(
        MapError, match=r"lacks free_thresh, .* 0\.196, or state it by --free-threshold"
    ):
        load_map(path)
    np.testing.assert_array_equal(load_map(path, free_threshold=0.196).classes, GREY_CLASSES)


@pytest.mark.parametrize("image", ["/home/someone/maps/i.png", "C:\\maps\\i.png"])
def test_an_image_that_lies_beside_the_file_is_named(write, image):
    path = write(_picture(GREYS))
    path.write_text(path.read_text().replace("image: i.png", f"image: {image}"))
    with pytest.raises(MapError, match=r"lies beside the map: write `image: i\.png`"):
        load_map(path)


@pytest.mark.parametrize(
    ("greys", "words"),
    [
        ([[255, 255]], "no cell is occupied at the thresholds 0.196 and 0.65"),
        ([[0, 128]], "no cell is free"),
        # Cartographer's probabilities: unknown is 128.
        ([[128] * 9, [150, 160, 170, 180, 190, 100, 110, 255, 0]], "7 cells have greys between"),
    ],
)
def test_doubtful_thresholds_warn(write, greys, words):
    with pytest.warns(MapWarning, match=words):
        load_map(write(_picture(greys)))


def _palette():
    image = Image.new("P", (3, 1))
    image.putpalette([254, 254, 254, 0, 0, 0, 255, 255, 255])
    image.putdata([0, 1, 2])
    return image


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_what_is_not_opaque_was_never_measured(write, mode):
    pixels = [[[255, 255], [255, 254], [0, 255], [0, 0]]]
    for image in (
        Image.fromarray(np.array(pixels, dtype=np.uint8), "LA"),
        Image.fromarray(np.array(pixels, dtype=np.uint8), "LA").convert("RGBA"),
    ):
        path = write(image, mode=mode)
        for low, high in ((None, None), (0.98, 0.99)):
            grid = load_map(path, free_threshold=low, occupied_threshold=high)
            np.testing.assert_array_equal(grid.classes, [[FREE, UNEXPLORED, OCCUPIED, UNEXPLORED]])
            np.testing.assert_array_equal(np.isnan(grid.probability), [[0, 1, 0, 1]])


def test_a_transparent_value_of_a_palette_or_of_a_grey_image_was_never_measured(write):
    def classes(image, transparent):
        path = write(image)
        image.save(path.parent / "i.png", transparency=transparent)
        return load_map(path).classes

    np.testing.assert_array_equal(classes(_palette(), 0), [[UNEXPLORED, OCCUPIED, FREE]])
    grey = _picture([[254, 0, 255]])
    np.testing.assert_array_equal(classes(grey, 254), [[UNEXPLORED, OCCUPIED, FREE]])
    deep = Image.fromarray(np.array([[65000, 0, 65535]], dtype=np.uint16))
    np.testing.assert_array_equal(classes(deep, 65000), [[UNEXPLORED, OCCUPIED, FREE]])
    np.testing.assert_array_equal(load_map(write(_palette())).classes, [[FREE, OCCUPIED, FREE]])


@pytest.mark.parametrize("negate", ["1", "true", "True", "'1'", "'true'", "yes", "y"])
def test_negate_makes_white_occupied(write, negate):
    grid = load_map(write(_picture([[0, 255]]), negate=negate))
    np.testing.assert_array_equal(grid.classes, [[FREE, OCCUPIED]])


@pytest.mark.parametrize("negate", ["0", "false", "'0'", "no", "n"])
def test_without_negate_black_is_occupied(write, negate):
    grid = load_map(write(_picture([[0, 255]]), negate=negate))
    np.testing.assert_array_equal(grid.classes, [[OCCUPIED, FREE]])


@pytest.mark.parametrize("name", ["i.png", "i.tif"])
@pytest.mark.parametrize("negate", ["0", "1"])
def test_raw_values_are_percent_and_know_neither_negate_nor_opacity(write, name, negate):
    values = np.array([[0, 19, 20, 64, 65, 100, 101, 255]], dtype=np.uint8)
    image = Image.merge("LA", [Image.fromarray(values), Image.fromarray(values // 2)])
    grid = load_map(write(image, name, mode="raw", negate=negate))
    expected = [0, 0.19, 0.2, 0.64, 0.65, 1, math.nan, math.nan]
    np.testing.assert_allclose(grid.probability, [expected], atol=1e-6)
    classes = [FREE, FREE, UNEXPLORED, UNEXPLORED, OCCUPIED, OCCUPIED, UNEXPLORED, UNEXPLORED]
    np.testing.assert_array_equal(grid.classes, [classes])


def test_16_bits_are_cut_off_to_8(write):
    # GraphicsMagick 1.3.40, magick/image.h: ScaleQuantumToChar is the quantum / 257, whole.
    values = np.array([[50 * 257 + 256, 51 * 257, 65535]], dtype=np.uint16)
    grid = load_map(write(Image.fromarray(values), mode="RAW"))
    np.testing.assert_allclose(grid.probability, [[0.5, 0.51, math.nan]], atol=1e-6)
    grid = load_map(write(Image.fromarray(values)))
    np.testing.assert_allclose(255 * (1 - grid.probability), [[50, 51, 255]], atol=1e-4)


def test_thresholds_are_inclusive(write):
    # 1 - 204/255 is 0.2 and 1 - 51/255 is 0.8, on paper and in float32.
    with pytest.warns(MapWarning):
        grid = load_map(
            write(_picture([[203, 204, 205, 51, 52]]), free_thresh=0.2, occupied_thresh=0.8)
        )
    np.testing.assert_array_equal(grid.classes, [[UNEXPLORED, FREE, FREE, OCCUPIED, UNEXPLORED]])


def test_overrides_replace_the_thresholds_of_the_file(write):
    path = write(_picture([[0, 128, 255]]))
    grid = load_map(path, free_threshold=0.5, occupied_threshold=0.9)
    np.testing.assert_array_equal(grid.classes, [[OCCUPIED, FREE, FREE]])
    assert (grid.free_threshold, grid.occupied_threshold) == (0.5, 0.9)
    for low, high in ((0.7, None), (None, 0.1)):
        with pytest.raises(InvalidValueError, match="thresh"):
            load_map(path, free_threshold=low, occupied_threshold=high)
    with pytest.raises(InvalidValueError, match="radius"):
        load_map(path, robot_radius_m=math.nan)


@pytest.mark.parametrize("negate", ["0", "1"])
@pytest.mark.parametrize("mode", ["L", "RGBA", "I;16"])
def test_unknown_grey_called_free_is_a_warning(write, negate, mode):
    threshold = 0.25 if negate == "0" else 0.81
    image = (
        Image.fromarray(np.array([[0, 205 * 257, 205 * 257]], dtype=np.uint16))
        if mode == "I;16"
        else _picture([[0, 205, 205]], mode)
    )
    path = write(image, negate=negate, free_thresh=threshold, occupied_thresh=0.9)
    with pytest.warns(MapWarning, match=r"a\.yaml.*2 cells.*205.*free_threshold") as caught:
        grid = load_map(path)
    assert str(caught[0].message).isprintable()
    np.testing.assert_array_equal(grid.classes[0, 1:], [FREE, FREE])
    # Overridden thresholds count, either way (warnings are errors here).
    grid = load_map(path, free_threshold=0.19)
    np.testing.assert_array_equal(grid.classes[0, 1:], [UNEXPLORED, UNEXPLORED])
    path = write(image, negate=negate, free_thresh=0.19, occupied_thresh=0.9)
    load_map(path)
    with pytest.warns(MapWarning):
        load_map(path, free_threshold=threshold)


def test_no_warning_without_such_pixels_where_they_are_transparent_or_in_raw_mode(write):
    grid = load_map(write(_picture([[0, 204, 206]]), free_thresh=0.25))
    assert grid.shape == (1, 3)
    load_map(write(_picture([[0, 205]]), free_thresh=0.25, mode="raw"))
    hidden = Image.fromarray(np.array([[[205, 10], [0, 255]]], dtype=np.uint8), "LA")
    load_map(write(hidden, free_thresh=0.25))


def test_origin_is_the_lower_left_corner_and_yaw_turns_about_it(write):
    path = write(_picture(GREYS), resolution="5e-2", origin="[1e1, -2, '1.5707963267948966']")
    frame = load_map(path).frame
    assert frame.resolution_m == 0.05
    assert frame.origin_m == (10.0, -2.0)
    np.testing.assert_allclose(frame.points_of([0, 2]), [10 - 0.025, -2 + 0.125])


def test_inflation_is_in_metres(write):
    rows = np.full((11, 11), 255)
    rows[5, 5] = 0
    grid = load_map(write(_picture(rows)), robot_radius_m=0.25)
    # Lattice points within 5 of the centre.
    assert grid.class_counts() == {"free": 40, "unexplored": 0, "occupied": 1, "blocked": 80}


def test_keys_that_nav2_does_not_know_are_let_be(write):
    grid = load_map(write(_picture(GREYS), map_type="occupancy", note="{a: [1, 2]}"))
    np.testing.assert_array_equal(grid.classes, load_map(write(_picture(GREYS))).classes)


def test_the_image_may_be_anywhere(write, tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    picture = _picture(GREYS)
    picture.save(tmp_path / "home" / "h.png")
    (tmp_path / "sub").mkdir()
    picture.save(tmp_path / "sub" / "s.png")
    for image in ("~/h.png", str(tmp_path / "home" / "h.png"), "sub/s.png", "./sub/../sub/s.png"):
        path = write(picture, "other.png", image=image)
        assert load_map(path).shape == (2, 3)
    monkeypatch.chdir(tmp_path / "sub")
    assert load_map("../a.yaml").name == "a"


def test_a_map_is_named_after_its_file_or_else_its_folder(write, tmp_path, monkeypatch):
    assert load_map(write(_picture(GREYS), yaml="office.yaml")).name == "office"
    write(_picture(GREYS), yaml="map.yml")
    monkeypatch.chdir(tmp_path)
    assert load_map("map.yml").name == tmp_path.name


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image": None}, "lacks image"),
        ({"image": "''"}, "image must"),
        ({"image": "[a.png]"}, "image must"),
        ({"resolution": None, "origin": None}, "lacks resolution, origin"),
        ({"negate": None}, "lacks negate"),
        ({"resolution": ".nan"}, "resolution must"),
        ({"resolution": "nan"}, "resolution must"),
        ({"resolution": ".inf"}, "resolution must"),
        ({"resolution": "0"}, "resolution must"),
        ({"resolution": "-0.05"}, "resolution must"),
        ({"resolution": "true"}, "resolution must"),
        ({"resolution": "5 cm"}, "resolution must"),
        ({"resolution": ""}, "resolution must"),
        ({"resolution": "1" * 2000}, "resolution must"),
        ({"origin": "[0, 0]"}, "origin must"),
        ({"origin": "[0, 0, 0, 0]"}, "origin must"),
        ({"origin": "0"}, "origin must"),
        ({"origin": "[0, 0, .nan]"}, "origin must"),
        ({"origin": "[0, [0], 0]"}, "origin must"),
        ({"negate": "maybe"}, "negate must"),
        ({"negate": "0.5"}, "negate must"),
        ({"mode": "binary"}, "mode must be one of trinary, scale, raw, got 'binary'"),
        ({"mode": ""}, "mode must"),
        ({"mode": "[raw]"}, "mode must"),
        ({"free_thresh": "0.7"}, "free_thresh must be at most occupied_thresh"),
        ({"free_thresh": "-0.1"}, "free_thresh must"),
        ({"free_thresh": ".nan"}, "free_thresh must"),
        ({"occupied_thresh": "65"}, "occupied_thresh must"),
        ({"occupied_thresh": None}, "lacks occupied_thresh"),
    ],
)
def test_a_wrong_value_gives_one_line_that_names_key_and_file(write, changes, words):
    with pytest.raises(MapError) as caught:
        load_map(write(_picture(GREYS), **changes))
    text = str(caught.value)
    assert "a.yaml" in text
    assert words in text
    assert text.isprintable()
    assert len(text) < 300 + len(str(caught.value).split(":", maxsplit=1)[0])


def test_a_bare_image_or_another_kind_of_file_is_told_what_to_do(write, tmp_path):
    write(_picture(GREYS))
    with pytest.raises(MapError, match=r"i\.png: pass the YAML"):
        load_map(tmp_path / "i.png")
    for name in ("a.bag", "noextension"):
        with pytest.raises(MapError, match=r"\.yaml.*\.map"):
            load_map(tmp_path / name)


def test_every_reference_map_loads_or_fails_with_one_line(data):
    with (data / "maps.tsv").open() as table:
        kinds = {row["yaml"]: row["kind"] for row in csv.DictReader(table, delimiter="\t")}
    assert sum(kind == "map" for kind in kinds.values()) == 43
    for name, kind in kinds.items():
        if kind == "broken":
            with pytest.raises(MapError, match=re.escape(name)) as caught:
                load_map(data / name)
            assert str(caught.value).isprintable()
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MapWarning)
            counts = load_map(data / name).class_counts()
        assert kind != "map" or min(counts["free"], counts["occupied"]) > 0, name


def test_the_traps_of_the_reference_data(data):
    with pytest.raises(MapNotFoundError, match=r"porto\.yaml: image .*map\.pgm: no such file"):
        load_map(data / "f1tenth_simulator" / "porto.yaml")

    frame = load_map(data / "f1tenth_simulator" / "stata_basement.yaml").frame
    assert frame.yaw_rad == 3.14
    # Half a turn: the map lies to the lower left of its origin.
    assert (frame.points_of([1299, 1729]) < frame.origin_m).all()

    assert load_map(data / "f1tenth_simulator" / "columbia.yaml").shape == (350, 435)  # ASCII

    depot = data / "nav2" / "maps" / "depot.yaml"
    with pytest.warns(MapWarning, match=r"8894 cells"):
        assert load_map(depot).class_counts()["unexplored"] == 0
    assert load_map(depot, free_threshold=0.196).class_counts()["unexplored"] == 8894

    speed_limits = load_map(data / "fetch_maps" / "3_1_16_limit.yaml")  # raw
    assert np.nanmax(speed_limits.probability) <= 1
    assert np.isnan(speed_limits.probability).any()

    colour = load_map(data / "aws_small_warehouse" / "005" / "map.yaml")
    assert colour.class_counts()["free"] > 0


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


@tried(
    100,
    arrays(np.uint8, SHAPES),
    st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.sampled_from([0.0, 3.14, -0.7])),
    st.sampled_from([0.05, 0.1, 1 / 3, 1e-4]),
    thresholds(),
)
@pytest.mark.filterwarnings("ignore:.* cells have grey 205:hybridnav.errors.MapWarning")
def test_an_image_of_8_bits_is_written_with_equal_pixels(folder, pixels, origin, side, limits):
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


@tried(
    100,
    arrays(np.float32, SHAPES, elements=st.one_of(st.floats(0, 1, width=32), st.just(np.nan))),
    thresholds(),
)
@example(np.array([[0.1953125]], dtype=np.float32), (0.5, 1.0))
def test_cells_keep_their_class_and_nearly_their_occupancy(folder, probability, limits):
    low, high = limits
    grid = hn.OccupancyGrid(
        probability, free_threshold=low, occupied_threshold=high, robot_radius_m=0
    )
    hn.write_ros_map(grid, folder / "any.yml")
    with warnings.catch_warnings():
        # A free cell may have the grey of unknown ones, which a reader is warned of.
        warnings.simplefilter("ignore", hn.errors.MapWarning)
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
    with pytest.raises(hn.errors.InvalidValueError, match="expected an OccupancyGrid"):
        hn.write_ros_map(grid.classes, tmp_path / "map.yaml")  # type: ignore[arg-type]
    with pytest.raises(hn.errors.MapError, match=r"must be named \.yaml"):
        hn.write_ros_map(grid, tmp_path / "map.pgm")
    with pytest.raises(hn.errors.MapError, match="cannot write"):
        hn.write_ros_map(grid, tmp_path / "none" / "map.yaml")
    narrow = hn.OccupancyGrid(
        np.array([[0.5]], np.float32), free_threshold=0.4999, occupied_threshold=0.5001
    )
    with pytest.raises(hn.errors.MapError, match="leave no grey of 8 bits for unexplored cells"):
        hn.write_ros_map(narrow, tmp_path / "narrow.yaml")
    assert list(tmp_path.iterdir()) == []
