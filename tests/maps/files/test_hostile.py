"""Damaged and hostile files: one clear line, and no more memory than the file can be worth."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from hybridnav._base.yaml_file import read_yaml
from hybridnav.errors import MapError, MapNotFoundError, PresetError, PresetNotFoundError
from hybridnav.maps.files import load_map

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


def test_an_image_between_pillows_warning_and_its_error_loads_quietly(load, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 5)
    assert load(b"P5\n3 3\n255\n" + bytes(9)).shape == (3, 3)
    assert "too large" in load(b"P5\n4 4\n255\n" + bytes(16))
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", None)
    assert "truncated, 20000 x 15000" in load(b"P5\n20000 15000\n255\n" + bytes(100))
    whole = io.BytesIO()
    Image.new("1", (20000, 15000)).save(whole, "PNG")
    assert "20000 x 15000 cells, a grid holds at most" in load(whole.getvalue(), "i.png")


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
