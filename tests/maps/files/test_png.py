"""Damaged PNGs: no flipped bit and no cut is read as another map; whole ones are not refused."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from hybridnav.errors import MapError
from hybridnav.maps.files.image import read_raster
from tests.strategies import examples

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


def _encoded(mode):
    stream, info = io.BytesIO(), PngInfo()
    info.add_text("Software", "a scanner")
    options = {"transparency": 7} if mode in ("L", "P") else {}
    _pixels(mode).save(stream, "PNG", pnginfo=info, **options)
    return stream.getvalue()


def _chunk(name, content):
    checksum = struct.pack(">I", zlib.crc32(name + content))
    return struct.pack(">I", len(content)) + name + content + checksum


def _file(shape, data, *, interlaced=0):
    header = struct.pack(">IIBBBBB", shape[1], shape[0], 8, 0, 0, 0, interlaced)
    return SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


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
    return first.white == second.white and all(
        np.array_equal(*pair) for pair in ((first.level, second.level), opaque)
    )


MODES = ("1", "L", "LA", "P", "RGB", "RGBA", "I;16")


@pytest.mark.parametrize("mode", MODES)
def test_no_flipped_bit_is_read_as_another_image(read, mode):
    content = _encoded(mode)
    whole = read(content)
    for bit in range(0, 8 * len(content), 11):  # eleven and eight share no factor: every bit's turn
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        found = read(bytes(flipped))
        assert found is None or _same(found, whole), f"bit {bit} of {8 * len(content)}"


@pytest.mark.parametrize("mode", MODES)
def test_no_cut_is_read(read, mode):
    content = _encoded(mode)
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
        (SIGNATURE + _chunk(b"tEXt", b"a\0b") + WHOLE[8:], "does not begin with its header"),
        (WHOLE[:-1] + b"\0", "chunk IEND does not match its checksum"),
    ],
    ids=["sum", "no sum", "short", "long", "no end", "name", "order", "chunk"],
)
def test_the_message_says_what_is_damaged(tmp_path, content, words):
    path = tmp_path / "m.png"
    path.write_bytes(content)
    with pytest.raises(MapError, match=words):
        read_raster(path, what="image", check_size=_any_size)
