"""Checks of a PNG's structure and checksums, which Pillow does not verify."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import BinaryIO

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

    Parameters
    ----------
    stream
        The file, seekable; its position is restored unless it is damaged.

    Raises
    ------
    DamagedPngError
        When the file is damaged or truncated.
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
