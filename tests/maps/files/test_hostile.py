"""Damaged, hostile and huge files: one clear line, no other map, bounded memory."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import hybridnav as hn
from hybridnav._base.yaml_file import read_yaml
from hybridnav.cli.app import run
from hybridnav.errors import MapError, MapNotFoundError, PresetError, PresetNotFoundError
from hybridnav.harness.scenes import MapSpec, read_map
from hybridnav.maps.files import load_map
from hybridnav.maps.files.image import read_raster
from tests.strategies import examples

KEYS = "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def _encoded(size, kind="PNG", mode="L"):
    stream = io.BytesIO()
    Image.effect_noise(size, 80).convert(mode).save(stream, kind)
    return stream.getvalue()


def _png_header(width, height, depth=8, colour=0):
    def chunk(name, content):
        crc = struct.pack(">I", zlib.crc32(name + content))
        return struct.pack(">I", len(content)) + name + content + crc

    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    pixels = zlib.compress(bytes(100))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels)


@pytest.fixture
def load(tmp_path):
    """Load a map whose image consists of these bytes; the error's text when that fails."""

    def load(content, name="i.pgm"):
        (tmp_path / name).write_bytes(content)
        (tmp_path / "a.yaml").write_text(f"image: {name}\n{KEYS}")
        try:
            return load_map(tmp_path / "a.yaml")
        except MapError as error:
            text = str(error)
        assert text.isprintable()
        assert "a.yaml: image " in text
        assert name in text
        return text.replace(str(tmp_path), "")

    return load


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not an image"),
        (b"\x00\x1b\xff" * 1000, "not an image"),
        (b"P5", "damaged"),
        (b"P5\n", "damaged"),
        (b"P5\n4 4\n", "damaged"),
        (b"P5\n-4 4\n255\n" + bytes(16), "0 pixels"),
        (b"P5\n4 x\n255\n" + bytes(16), "damaged"),
        (b"P5\n4 4\n0\n" + bytes(16), "damaged"),
        (b"P5\n4 4\n65536\n" + bytes(16), "damaged"),
        (b"P5\n" + b"9" * 100_000, "damaged"),
        (b"P5\n0 0\n255\n", "0 pixels"),
        (b"P5\n0 5\n255\n", "0 pixels"),
        (b"P5\n4 4\n255\n" + bytes(15), "truncated"),
        (b"P5\n4 4\n100\n" + bytes(15), "truncated"),
        (b"P5\n4 4\n65535\n" + bytes(31), "truncated"),
        (b"P2\n2 2\n255\n1 2 3", "truncated"),
        (b"P2\n2 2\n255\n1 2 3 x", "damaged"),
        (b"P2\n2 2\n255\n1 2 3 -4", "damaged"),
        (b"P2\n2 2\n255\n1 2 3 256", "damaged"),
        (b"P2\n2 2\n255\n" + b"1" * 100_000, "damaged"),
        (b"P2\n9 9\n255\n" + b"#\n" * 20_000, "20000 comments"),
        (b"P5\n20000 15000\n255\n" + bytes(100), "too large"),
        (b"P2\n20000 15000\n255\n" + bytes(100), "too large"),
        (b"P5\n2000000000 2000000000\n255\n" + bytes(100), "too large"),
        (b"P5\n12000 14000\n255\n" + bytes(100), "do not fit in 119 bytes"),
        (b"P2\n12000 14000\n255\n" + bytes(100), "do not fit in 119 bytes"),
        (b"Pf\n2 2\n-1.0\n" + bytes(16), "floating point"),
        (_png_header(20_000, 15_000), "too large"),
        (_png_header(2**31 - 1, 2**31 - 1), "too large"),
        (_png_header(20_000, 15_000, colour=6), "too large"),
        (_png_header(12_000, 14_000), "do not fit"),
        (_png_header(30, 30), "truncated"),
        (_png_header(0, 0), "0 pixels"),
        (_png_header(5, 0), "0 pixels"),
        (_png_header(5, 5, depth=3), "not an image"),
        (_encoded((64, 64))[:1500], "truncated"),
        (_encoded((64, 64))[:30], "not an image"),
        (_encoded((64, 64), "BMP")[:1500], "truncated"),
        (_encoded((64, 64), "TIFF")[:1500], "damaged"),
        (_encoded((64, 64), "TIFF", "F"), "floating point"),
        (_encoded((64, 64), "TIFF", "I"), "32 bits"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n", "not an image"),
    ],
)
def test_a_bad_image_gives_one_line_that_names_yaml_and_image(load, content, words):
    assert words in load(content)


def test_a_tiff_whose_strips_do_not_cover_it_is_truncated(load):
    content = bytearray(_encoded((8, 8), "TIFF"))
    # The tag ImageLength (257), of type LONG.
    at = content.index(struct.pack("<HHI", 257, 4, 1)) + 8
    content[at : at + 4] = struct.pack("<I", 8_000_000)
    assert "does not hold all 8000000 rows" in load(bytes(content), "i.tif")


def test_the_limit_of_a_grid_holds_for_images_and_not_that_of_pillow(load, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 5)
    assert load(b"P5\n4 4\n255\n" + bytes(16)).shape == (4, 4)
    assert "too large" in load(b"P5\n20000 15000\n255\n" + bytes(100))
    assert Image.MAX_IMAGE_PIXELS == 5


SAMPLES = [
    _encoded((9, 7), kind, mode)
    for kind, modes in (
        ("PNG", ("1", "L", "LA", "P", "RGB", "RGBA")),
        ("PPM", ("1", "L", "RGB")),
        ("BMP", ("L", "RGB")),
        ("GIF", ("L",)),
    )
    for mode in modes
] + [b"P2\n# c\n3 2\n15\n0 1 2\n3 4 5\n"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_flipped_byte_and_no_cut_gets_past_the_one_line(load, data):
    content = bytearray(data.draw(st.sampled_from(SAMPLES)))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    load(bytes(content[: data.draw(st.integers(0, len(content)))]))


def _raises(path, kind=MapError):
    with pytest.raises(kind) as caught:
        load_map(path)
    text = str(caught.value)
    assert text.isprintable()
    return text


def test_missing_files_and_directories(tmp_path):
    path = tmp_path / "a.yaml"
    assert "a.yaml: no such file" in _raises(path, MapNotFoundError)
    with pytest.raises(FileNotFoundError):
        load_map(path)
    path.write_text(f"image: gone.pgm\n{KEYS}")
    text = _raises(path, MapNotFoundError)
    assert "a.yaml: image " in text
    assert "gone.pgm: no such file" in text
    path.write_text(f"image: .\n{KEYS}")
    assert "directory" in _raises(path)
    path.write_text(f"image: /dev/zero\n{KEYS}")
    assert "not a regular file" in _raises(path)
    for image in ("a\\nb.pgm", "a\\0b.pgm", "x" * 1000, "~nobody-of-this-name/i.pgm"):
        path.write_text(f'image: "{image}"\n{KEYS}')
        assert "a.yaml: image " in _raises(path)
    (tmp_path / "folder.yaml").mkdir()
    assert "directory" in _raises(tmp_path / "folder.yaml")
    assert "no such file" in _raises(path / "b.yaml")
    assert "no such file" in _raises(tmp_path / "two\nlines.yaml")


BOMB = "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "expected a mapping"),
        ("# nothing\n", "expected a mapping"),
        ("- 1\n- 2\n", "expected a mapping"),
        ("just text", "expected a mapping"),
        ("1: 2\n", "every key must be text"),
        (BOMB, "line 1: anchors and aliases"),
        ("a: *b\n", "line 1: anchors and aliases"),
        ("a: 1\nb: 2\na: 3\n", "line 3: key 'a' is given twice"),
        ("x:\n  - {a: 1, a: 2}\n", "line 2: key 'a' is given twice"),
        ("a: !!python/object/apply:os.system [ls]\n", "line 1: tags"),
        ("a: " + "[" * 100_000, "line 1: nested more than"),
        ("- " * 100_000, "line 1: nested more than"),
        ("{a: " * 50 + "}" * 50, "line 1: nested more than"),
        ("a:\n" + "- 1\n" * 20_000, "values"),
        ("a: " + "1" * 100_000, "line 1: a value has more than"),
        ("# " + "x" * 2**20, "more than 1048576 bytes"),
        ("a: [1,\n", "line 2: "),
        ("a: b\nc: d: e\n", "line 2: mapping values are not allowed here"),
        ("a: 2024-13-01\n", "line 1: month must be in 1..12"),
        ("a: 0x_\n", "line 1: "),
        ("a: !" + "x" * 10_000 + "!y 1\n", "line 1: "),
        ("a: 1\n---\nb: 2\n", "line 2: expected a single document"),
        (b"a: 1\nb: \xff\n", "line 2: not UTF-8"),
        ("a: 1".encode("utf-16"), "not UTF-8"),
        ("a: 1\nb: \x00\n", "line 2: not a YAML text"),
        (bytes(range(256)), "not UTF-8"),
    ],
)
def test_bad_yaml_gives_one_line_that_names_file_and_line(tmp_path, content, words):
    path = tmp_path / "a.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    text = _raises(path)
    assert "a.yaml" in text
    assert words in text
    assert len(text) < len(str(path)) + 300


def test_the_reader_serves_presets_in_their_own_words(tmp_path):
    path = tmp_path / "p.yaml"
    with pytest.raises(PresetNotFoundError, match=r"^preset .*p\.yaml: no such file$"):
        read_yaml(path, what="preset", error=PresetError, missing=PresetNotFoundError)
    path.write_text("\ufeffpyramid: {seed: 1, radius: .5}\nname: Büro\n", encoding="utf-8")
    values = read_yaml(path, what="preset", error=PresetError)
    assert values == {"pyramid": {"seed": 1, "radius": 0.5}, "name": "Büro"}
    path.write_text("- 1")
    with pytest.raises(PresetError, match=r"^preset .*mapping"):
        read_yaml(path, what="preset", error=PresetError)


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    path = tmp_path / "a.yaml"
    path.write_text(KEYS)

    def refuse(*_args, **_options):
        raise PermissionError(13, "Permission denied", str(path))

    # Tests may run as root, who may read everything.
    monkeypatch.setattr(type(path), "open", refuse)
    assert "a.yaml: Permission denied" in _raises(path)


def test_a_map_of_one_cell_loads(load):
    grid = load(b"P5\n1 1\n255\n\xff")
    np.testing.assert_array_equal(grid.probability, [[0]])


SIGNATURE = b"\x89PNG\r\n\x1a\n"
ADAM7 = (
    (0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1)
)  # fmt: skip
"""First row and column of each pass of an interlaced PNG, and the steps."""


def _any_size(cols, rows):
    """Accept every size."""


def _pixels(mode):
    rng = np.random.default_rng(5)
    if mode == "I;16":
        return Image.fromarray(rng.integers(0, 2**16, (7, 9), dtype=np.uint16))
    channels = {"LA": 2, "RGB": 3, "RGBA": 4}.get(mode)
    shape = (7, 9) if channels is None else (7, 9, channels)
    noise = Image.fromarray(rng.integers(0, 256, shape, dtype=np.uint8))
    return noise.quantize(16) if mode == "P" else noise.convert(mode)


def _png_of(mode):
    stream, info = io.BytesIO(), PngInfo()
    info.add_text("Software", "a scanner")
    options = {"transparency": 7} if mode in ("L", "P") else {}
    _pixels(mode).save(stream, "PNG", pnginfo=info, **options)
    return stream.getvalue()


def _png_chunk(name, content):
    checksum = struct.pack(">I", zlib.crc32(name + content))
    return struct.pack(">I", len(content)) + name + content + checksum


def _file(shape, data, *, interlaced=0):
    header = struct.pack(">IIBBBBB", shape[1], shape[0], 8, 0, 0, 0, interlaced)
    return (
        SIGNATURE
        + _png_chunk(b"IHDR", header)
        + _png_chunk(b"IDAT", data)
        + _png_chunk(b"IEND", b"")
    )


def _rows(levels):
    """The rows as a PNG stores them, without a filter."""
    return b"".join(b"\0" + row.tobytes() for row in levels)


@pytest.fixture
def read(tmp_path):
    """Read a PNG of these bytes; None when it is refused, in one line that names the file."""
    path = tmp_path / "m.png"

    def read(content):
        path.write_bytes(content)
        try:
            return read_raster(path, what="image", check_size=_any_size)
        except MapError as error:
            text = str(error)
        assert text.isprintable()
        assert str(path) in text
        return None

    return read


def _same(first, second):
    opaque = [np.ones(r.level.shape) if r.opaque is None else r.opaque for r in (first, second)]
    return first.level.dtype == second.level.dtype and all(
        np.array_equal(*pair) for pair in ((first.level, second.level), opaque)
    )


MODES = ("1", "L", "LA", "P", "RGB", "RGBA", "I;16")


@pytest.mark.parametrize("mode", MODES)
def test_no_flipped_bit_is_read_as_another_image(read, mode):
    content = _png_of(mode)
    whole = read(content)
    for bit in range(0, 8 * len(content), 11):  # eleven and eight share no factor: every bit's turn
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        found = read(bytes(flipped))
        assert found is None or _same(found, whole), f"bit {bit} of {8 * len(content)}"


@pytest.mark.parametrize("mode", MODES)
def test_no_cut_is_read(read, mode):
    content = _png_of(mode)
    assert all(read(content[:size]) is None for size in range(0, len(content), 3))
    assert _same(read(content + b"what follows the end"), read(content))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=examples(60))
@given(data=st.data())
def test_an_interlaced_image_is_whole_at_any_size(read, data):
    shape = data.draw(st.tuples(st.integers(1, 20), st.integers(1, 20)))
    levels = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    passes = [levels[row::down, col::right] for row, col, down, right in ADAM7]
    stored = b"".join(_rows(part) for part in passes if part.size)
    found = read(_file(shape, zlib.compress(stored), interlaced=1))
    np.testing.assert_array_equal(found.level, levels)
    assert read(_file(shape, zlib.compress(stored[:-1]), interlaced=1)) is None


def test_pixel_data_larger_than_what_is_inflated_at_a_time(read):
    levels = np.full((1, 2**20 - 1), 254, np.uint8)  # with its filter one piece, to the byte
    for rows in (1, 3):
        tall = np.repeat(levels, rows, axis=0)
        found = read(_file(tall.shape, zlib.compress(_rows(tall))))
        np.testing.assert_array_equal(found.level, tall)


LEVELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
STREAM = zlib.compress(_rows(LEVELS))
WHOLE = _file((3, 4), STREAM)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (_file((3, 4), STREAM[:-4] + b"\0\0\0\0"), "incorrect data check"),
        (_file((3, 4), STREAM[:-4]), "truncated"),
        (_file((4, 4), STREAM), "truncated"),
        (_file((2, 4), STREAM), "more pixel data than the image has pixels"),
        (WHOLE[:-12], "IEND"),
        (WHOLE.replace(b"IDAT", b"ID\0T"), "damaged"),
        (SIGNATURE + _png_chunk(b"tEXt", b"a\0b") + WHOLE[8:], "does not begin with its header"),
        (WHOLE[:-1] + b"\0", "chunk IEND does not match its checksum"),
    ],
    ids=["sum", "no sum", "short", "long", "no end", "name", "order", "chunk"],
)
def test_the_message_says_what_is_damaged(tmp_path, content, words):
    path = tmp_path / "m.png"
    path.write_bytes(content)
    with pytest.raises(MapError, match=words):
        read_raster(path, what="image", check_size=_any_size)


LIMIT = "more than the limit of 20,000,000; reading them takes about 0.4 GB of memory, planning "


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
    with pytest.raises(hn.errors.MapError, match="5000 x 5000 = 25,000,000 cells, ") as refused:
        hn.load_map(path)
    told = str(refused.value)
    assert LIMIT + "up to 7.5 GB" in told
    assert "--max-cells 25000000, in Python max_cells" in told
    assert "huge.png" in told
    assert told.isprintable()


def test_a_huge_movingai_map_is_refused_by_its_header(tmp_path):
    path = tmp_path / "huge.map"
    path.write_text("type octile\nheight 5000\nwidth 5000\nmap\n")
    with pytest.raises(hn.errors.MapError, match="5000 x 5000 = 25,000,000 cells, " + LIMIT):
        hn.load_map(path)


def test_the_limit_is_inclusive_and_may_be_raised_and_lowered(maps):
    for path in maps:
        assert hn.load_map(path, max_cells=600).shape == (20, 30)
        with pytest.raises(
            hn.errors.MapError, match="30 x 20 = 600 cells, more than the limit of 599;"
        ):
            hn.load_map(path, max_cells=599)
        with pytest.raises(
            hn.errors.InvalidValueError, match="max_cells must be a positive number"
        ):
            hn.load_map(path, max_cells=0)
        read_map.cache_clear()
        with pytest.raises(hn.errors.MapError, match="limit of 599"):
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
    with pytest.raises(hn.errors.RoomsError, match="image of 5000 x 5000 pixels, the map has"):
        hn.load_rooms(tmp_path / "rooms.yaml", grid)
