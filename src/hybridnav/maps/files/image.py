"""Map images of any format: brightness and opacity of each pixel."""

from __future__ import annotations

import os
import struct
import threading
import warnings
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, UnidentifiedImageError

from hybridnav._base.files import printable
from hybridnav._base.typing import BoolArray, ByteArray, PathLike
from hybridnav._base.yaml_file import open_file
from hybridnav.errors import MapError, MapNotFoundError
from hybridnav.maps import MAX_CELLS

_FORMATS = ("PNG", "PPM", "BMP", "TIFF", "GIF", "JPEG", "WEBP", "TGA", "PCX")
"""Raster formats; some of Pillow's others start programs (EPS) or hold whole documents."""
_MOST_PIXELS_PER_BYTE = {"PPM": 8, "PNG": 8 * 1032}
"""One bit per pixel; deflate packs at most 1032 to 1. A header with more pixels is refused before
memory is taken for them."""
_MOST_COMMENTS = 10_000
"""Most comments of an ASCII PNM: Pillow copies up to a megabyte for each, in hours for many."""
_OPENING = threading.Lock()
"""Held while Pillow's limit is that of a grid."""


@dataclass(frozen=True, eq=False)
class Raster:
    """Brightness of an image.

    `level`: the grey of the file, of 8 or 16 bits by its type, shape `(rows, cols)`, the top row
    first; `opaque`: mask of the fully opaque pixels, same shape; None if all are opaque; `text`:
    what a PNG says of itself, by keyword.
    """

    level: NDArray[np.uint8] | NDArray[np.uint16]
    opaque: BoolArray | None
    text: Mapping[str, str] = field(default_factory=dict)

    @property
    def grey(self) -> ByteArray:
        """The grey in 8 bits, 255 for white, cut off as GraphicsMagick does for map_server."""
        step = 1 if self.level.dtype == np.uint8 else 257
        return (self.level // step).astype(np.uint8)


def read_raster(path: PathLike, *, what: str, check_size: Callable[[int, int], None]) -> Raster:
    """Read an image of one to four channels.

    `path`: the image file; for an animation, its first frame is read; `what`: name of the image in
    messages, which begin with it; `check_size`: called with columns and rows before any pixel is
    read, to raise if there are too many. Result: brightness and opacity of each pixel. Raises
    `MapNotFoundError` when the file does not exist. Raises `MapError` when the file is no image,
    damaged, larger than a grid may be, or has pixels of more than 16 bits.
    """
    where = f"{what} {printable(path)}"
    with (
        open_file(path, what=what, error=MapError, missing=MapNotFoundError) as stream,
        warnings.catch_warnings(),
    ):
        # Pillow's warnings (size, stray metadata) are either checked here or harmless.
        warnings.simplefilter("ignore")
        image = _open(stream, where)
        _check_extent(image, stream, where)
        check_size(*image.size)
        _keep_opacity(image)
        try:
            if image.format == "PNG":
                check_png(stream)
            return replace(_decode(image), text=dict(getattr(image, "text", {})))
        except DamagedPngError as failure:
            raise MapError(f"{where}: damaged PNG: {failure}; save or copy it again") from None
        except _UnsupportedPixelsError as failure:
            raise MapError(f"{where}: {failure}") from None
        except MemoryError:
            raise  # the machine's fault, not the file's
        except Exception as failure:  # noqa: BLE001 - Pillow's decoders raise anything
            raise MapError(f"{where}: damaged or truncated ({_brief(failure)})") from None


class _UnsupportedPixelsError(Exception):
    pass


def _open(stream: BinaryIO, where: str) -> ImageFile.ImageFile:
    try:
        # Pillow refuses twice its limit, which is less than a grid holds.
        with _OPENING:
            limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, MAX_CELLS // 2
            try:
                image = Image.open(stream, formats=_FORMATS)
            finally:
                Image.MAX_IMAGE_PIXELS = limit
    except Image.DecompressionBombError:
        raise MapError(
            f"{where}: too large, more than {MAX_CELLS:,} pixels, the most that a grid holds "
            "whatever the limit: make the image smaller, or cut it"
        ) from None
    except UnidentifiedImageError:
        problem = "not an image of a known format, or its header is damaged or says 0 pixels"
        raise MapError(f"{where}: {problem}") from None
    except Exception as failure:  # noqa: BLE001 - Pillow's header parsers raise anything
        raise MapError(f"{where}: damaged header ({_brief(failure)})") from None
    return image


def _check_extent(image: ImageFile.ImageFile, stream: BinaryIO, where: str) -> None:
    """Refuse a file that cannot hold the pixels of its header."""
    width, height = image.size
    size = os.fstat(stream.fileno()).st_size
    most = _MOST_PIXELS_PER_BYTE.get(image.format or "")
    if most is not None and width * height > most * size:
        raise MapError(f"{where}: truncated, {width} x {height} pixels do not fit in {size} bytes")
    covered = max((box[3] for _, box, *_ in image.tile if box), default=height)
    if image.format == "TIFF" and covered < height:  # Pillow leaves the other rows black
        raise MapError(f"{where}: truncated, the file does not hold all {height} rows")
    if image.format == "PPM":
        _check_comments(stream, where)


def _check_comments(stream: BinaryIO, where: str) -> None:
    position = stream.tell()
    stream.seek(0)
    if stream.read(2) in (b"P1", b"P2", b"P3"):
        comments = 0
        while chunk := stream.read(2**20):
            comments += chunk.count(b"#")
        if comments > _MOST_COMMENTS:
            raise MapError(f"{where}: {comments} comments, at most {_MOST_COMMENTS} are read")
    stream.seek(position)


def _decode(image: Image.Image) -> Raster:
    if image.mode.startswith("I"):
        return _decode_deep(image)
    if image.mode == "F":
        raise _UnsupportedPixelsError("pixels are floating point, expected 8 or 16 bits")
    transparent = image.has_transparency_data
    if image.mode in ("1", "L", "LA", "La"):
        if not transparent:
            return Raster(np.asarray(image.convert("L")), opaque=None)
        grey = np.asarray(image.convert("LA"))
        return Raster(grey[..., 0], opaque=_opaque(grey[..., 1] == 255))  # noqa: PLR2004
    pixels = np.asarray(image.convert("RGBA" if transparent else "RGB"))
    level = np.empty(pixels.shape[:2], np.uint8)
    for row, of_row in zip(level, pixels, strict=True):
        # GraphicsMagick weighs 16 bits a channel, rounds, and cuts the sum off to 8 bits.
        deep = 257 * (of_row[:, :3] @ _WEIGHTS) + 500
        row[:] = deep // 1000 // 257
    opaque = _opaque(pixels[..., 3] == 255) if transparent else None  # noqa: PLR2004
    return Raster(level, opaque=opaque)


_WEIGHTS = np.array([299, 587, 114])
"""Thousandths of red, green and blue in a grey (Rec. 601)."""


def _keep_opacity(image: ImageFile.ImageFile) -> None:
    """Read the extra sample of a TIFF as opacity, as GraphicsMagick does.

    map_saver writes it unspecified, and Pillow drops such a sample.
    """
    names = {"LX", "RGBX", "RGBX;16L", "RGBX;16B", "RGBX;16N"}
    raw = [tile.args for tile in image.tile if isinstance(tile.args, tuple)]
    if image.format == "TIFF" and raw and all(args[0] in names for args in raw):
        image._mode = "LA" if image.mode == "L" else "RGBA"  # noqa: SLF001 - no public way
        image.tile = [
            tile._replace(args=(args[0].replace("X", "A"), *args[1:]))
            for tile, args in zip(image.tile, raw, strict=True)
        ]


def _decode_deep(image: Image.Image) -> Raster:
    """Return grey of 16 bits: mode I;16, or I where Pillow widened it (PNG and PGM only)."""
    if image.mode == "I" and image.format not in ("PNG", "PPM"):
        raise _UnsupportedPixelsError("pixels have 32 bits, expected 8 or 16")
    level = np.asarray(image).astype(np.uint16)
    transparent = image.info.get("transparency")
    opaque = None if transparent is None else _opaque(level != transparent)
    return Raster(level, opaque=opaque)


def _opaque(mask: BoolArray) -> BoolArray | None:
    return None if mask.all() else mask


def _brief(failure: Exception) -> str:
    text = " ".join(str(failure).split())[:100]
    return printable(text) or type(failure).__name__


# Checks of a PNG's structure and checksums, which Pillow does not verify.

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples of a pixel, by the header's colour type."""
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2))
"""First column, first row and their steps, of each pass but the last of an interlaced image."""
_BLOCK = 2**20
"""Bytes that are read, or inflated, at a time."""


class DamagedPngError(Exception):
    """Error of a damaged PNG; the text states the damage."""


def check_png(stream: BinaryIO) -> None:
    """Check the structure and every checksum of a PNG.

    Each chunk must match its CRC-32, the header must come first, the end must exist, and the pixel
    data must inflate, with its Adler-32, to exactly the bytes of the image. Any single flipped bit
    is found. Bytes behind the end are not read.

    `stream`: the file, seekable; its position is restored unless it is damaged. Raises
    `DamagedPngError` when the file is damaged or truncated.
    """
    position = stream.tell()
    stream.seek(0)
    if stream.read(len(SIGNATURE)) != SIGNATURE:
        raise DamagedPngError("the signature is damaged")
    pixels = None
    while True:
        name, size = _chunk_head(stream)
        if pixels is None:
            if (name, size) != (b"IHDR", 13):
                raise DamagedPngError("does not begin with its header")
            pixels = _Pixels(_chunk(stream, name, size, None))
            continue
        _chunk(stream, name, size, pixels if name == b"IDAT" else None)
        if name == b"IEND":
            break
    pixels.check_complete()
    stream.seek(position)


def _chunk_head(stream: BinaryIO) -> tuple[bytes, int]:
    head = stream.read(8)
    if len(head) < 8:  # noqa: PLR2004
        raise DamagedPngError("truncated, the last chunk (IEND) is missing")
    size, name = struct.unpack(">I4s", head)
    if not name.isalpha():
        raise DamagedPngError(f"a chunk has the name {name!a}")
    return name, size


def _chunk(stream: BinaryIO, name: bytes, size: int, pixels: _Pixels | None) -> bytes:
    """Read a chunk block by block and check its sum; return the last block."""
    checksum, left, block = zlib.crc32(name), size, b""
    while left > 0:
        block = stream.read(min(left, _BLOCK))
        if not block:
            raise DamagedPngError(f"truncated within a chunk {name.decode()}")
        checksum = zlib.crc32(block, checksum)
        left -= len(block)
        if pixels is not None:
            pixels.inflate(block)
    if stream.read(4) != struct.pack(">I", checksum):
        raise DamagedPngError(f"a chunk {name.decode()} does not match its checksum")
    return block


class _Pixels:
    """The stream of pixel data, counted against the size in the header."""

    def __init__(self, header: bytes) -> None:
        width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
        bits = depth * _CHANNELS.get(colour, 0)
        parts = [(width, height)]
        if interlaced:
            parts = [
                (-(-(width - col) // col_step), -(-(height - row) // row_step))
                for col, row, col_step, row_step in _ADAM7
            ]
            parts.append((width, height // 2))
        # Each row begins with a byte for its filter.
        self._left = sum(
            rows * (1 + -(-cols * bits // 8)) for cols, rows in parts if cols > 0 and rows > 0
        )
        self._stream = zlib.decompressobj()

    def inflate(self, block: bytes) -> None:
        """Take the next bytes of the compressed data."""
        try:
            inflated = _BLOCK
            # Output may be pending although all input is consumed, if the last output filled the
            # block.
            while (block or inflated == _BLOCK) and not self._stream.eof:
                inflated = len(self._stream.decompress(block, _BLOCK))
                self._left -= inflated
                if self._left < 0:
                    raise DamagedPngError("holds more pixel data than the image has pixels")
                block = self._stream.unconsumed_tail
        except zlib.error as failure:
            raise DamagedPngError(f"the pixel data is damaged: {failure}") from None

    def check_complete(self) -> None:
        """Refuse data that ends before the last row, or before its checksum."""
        if self._left > 0 or not self._stream.eof:
            raise DamagedPngError("truncated, the pixel data does not fill the image")
