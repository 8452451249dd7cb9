"""The file of a model: a header in JSON, and plain arrays that are mapped into memory.

    8 bytes    magic
    uint32     version of this layout
    uint32     CRC-32 of the header
    uint64     length of the header in bytes
    header     JSON, UTF-8: the parts, and the places of their arrays
    arrays     each at a multiple of 64 bytes, little-endian, in C order; deflated if marked

Offsets count from the first multiple of 64 behind the header. `hybridnav.models.structures`
describes the contents of parts and the valid values of arrays.
"""

import json
import math
import mmap
import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hybridnav._base.files import printable, replace_file
from hybridnav._base.typing import AnyArray, PathLike
from hybridnav._version import __version__
from hybridnav.errors import MapNotFoundError, ModelError

FORMAT = 1
"""Version of the layout that is written, and the only one that is read."""

_MAGIC = b"\x89HNM\r\n\x1a\n"
"""Like PNG's: a transfer that treats the file as text changes it."""
_HEAD = struct.Struct("<8sIIQ")
_ALIGN = 64
_MAX_HEADER = 1 << 24
"""Most bytes of a header: ten thousand rooms with the longest names take a quarter of it."""
_MAX_RATIO = 1100
"""Greatest ratio of compression: deflate reaches at most 1,032."""
_LEVEL = 1
"""Level of compression: 6 saves 10 % more, in four times the time."""

Dtype = Literal["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "float32",
                "float64"]  # fmt: skip


class _Strict(BaseModel):
    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, strict=True)


_Count = Annotated[int, Field(ge=0, lt=1 << 62)]


class _Stored(_Strict):
    """Place, type and shape of an array in the file."""

    dtype: Dtype
    shape: Annotated[list[_Count], Field(max_length=3)]
    offset: _Count
    size: _Count
    """Bytes in the file."""
    crc32: _Count
    """The checksum of its bytes in the file."""
    deflated: bool

    @property
    def nbytes(self) -> int:
        """Bytes in memory."""
        return math.prod(self.shape) * np.dtype(self.dtype).itemsize


class _StoredPart(_Strict):
    kind: Annotated[str, Field(max_length=40)]
    version: _Count
    sizes: dict[str, _Count]
    values: dict[str, Any]
    arrays: dict[str, _Stored]


class _Header(_Strict):
    hybridnav: Annotated[str, Field(max_length=40)]
    parts: Annotated[list[_StoredPart], Field(max_length=100)]


@dataclass(frozen=True, eq=False)
class Part:
    """One structure: numbers and texts, and arrays by name."""

    kind: str
    version: int
    sizes: dict[str, int]
    """Numbers that the shapes of the arrays consist of."""
    values: dict[str, Any]
    """Values of JSON, without numbers that are not finite."""
    arrays: dict[str, AnyArray]


@dataclass(frozen=True, eq=False)
class FiledPart:
    """A part as described in the header, with its arrays in the file."""

    where: str
    """The file; messages begin with it."""
    part: _StoredPart
    _data: Any = field(repr=False)

    @property
    def kind(self) -> str:
        """Kind of structure."""
        return self.part.kind

    @property
    def values(self) -> dict[str, Any]:
        """Its numbers and texts."""
        return self.part.values

    def read(self) -> Part:
        """Map the arrays into memory and compare them with their checksums.

        Returns the part; its arrays share private pages of the file, so that writes do not reach
        the file; deflated ones are inflated. Raises `ModelError` when an array has changed since it
        was written.
        """
        arrays = {name: self._array(name, at) for name, at in self.part.arrays.items()}
        part = self.part
        return Part(part.kind, part.version, dict(part.sizes), dict(part.values), arrays)

    def stored(self, name: str) -> memoryview:
        """Return the bytes of an array in the file, for contents with checksums of their own.

        Raises `ModelError` when it is missing, or deflated.
        """
        at = self.part.arrays.get(name)
        if at is None or at.deflated:
            raise ModelError(f"{self.where}: {self.kind} lacks {name}: build the model anew")
        return memoryview(self._data)[at.offset : at.offset + at.size]

    def _array(self, name: str, at: _Stored) -> AnyArray:
        stored = memoryview(self._data)[at.offset : at.offset + at.size]
        if zlib.crc32(stored) != at.crc32:
            raise ModelError(
                f"{self.where}: {self.kind} {name} does not match its checksum, the file was "
                "altered: build the model anew"
            )
        content: Any = stored
        if at.deflated:
            content = self._inflated(name, stored, at.nbytes)
        dtype = np.dtype(at.dtype)
        if not at.nbytes:
            return np.empty(at.shape, dtype)
        array = np.frombuffer(content, dtype.newbyteorder("<")).reshape(at.shape)
        return array.astype(dtype, copy=False)

    def _inflated(self, name: str, stored: memoryview, size: int) -> bytearray:
        """Inflate an array, in no more memory than the header states."""
        machine = zlib.decompressobj()
        try:
            content = bytearray(machine.decompress(stored, size + 1))
        except zlib.error:
            content = bytearray()
        if len(content) != size or not machine.eof:
            raise ModelError(
                f"{self.where}: {self.kind} {name} does not inflate to {size} bytes: build the "
                "model anew"
            )
        return content


def write_parts(path: Path, parts: Iterable[Part], *, compress: bool) -> None:
    """Write a model, whole or not at all.

    `path`: the file; an existing one is replaced, and processes that have it mapped keep the old
    one; `compress`: whether arrays are deflated. Raises `OSError` when it cannot be written.
    """
    replace_file(path, buffers_of(parts, compress=compress))


def buffers_of(parts: Iterable[Part], *, compress: bool) -> list[bytes | memoryview]:
    """Return the content of the file of a model, in parts; see `write_parts`.

    Raises `ModelError` when rooms and doors have names that are too long together.
    """
    described: list[dict[str, Any]] = []
    buffers: list[bytes | memoryview] = []
    offset = 0
    for part in parts:
        arrays = {}
        for name, array in part.arrays.items():
            content = _bytes_of(array)
            if compress:
                content = memoryview(zlib.compress(content, _LEVEL))
            arrays[name] = {
                "dtype": array.dtype.name,
                "shape": list(array.shape),
                "offset": offset,
                "size": len(content),
                "crc32": zlib.crc32(content),
                "deflated": compress,
            }
            padding = bytes(-len(content) % _ALIGN)
            buffers += [content, padding]
            offset += len(content) + len(padding)
        described.append(
            {
                "kind": part.kind,
                "version": part.version,
                "sizes": part.sizes,
                "values": part.values,
                "arrays": arrays,
            }
        )
    tree = {"hybridnav": __version__, "parts": described}
    header = json.dumps(tree, allow_nan=False, ensure_ascii=False).encode()
    if len(header) > _MAX_HEADER:
        raise ModelError(
            f"a model describes itself in at most {_MAX_HEADER} bytes, this one takes "
            f"{len(header)}: give rooms and doors shorter names"
        )
    head = _HEAD.pack(_MAGIC, FORMAT, zlib.crc32(header), len(header))
    return [head, header, bytes(-(len(head) + len(header)) % _ALIGN), *buffers]


def read_parts(path: PathLike) -> list[FiledPart]:
    """Open a model: read its header, and map the rest.

    Returns the parts; every array lies inside the file and overlaps no other one. Raises
    `MapNotFoundError` when the file does not exist. Raises `ModelError` when the file is no model,
    was made by a newer version, or is not whole.
    """
    where = f"model {printable(path)}"
    if Path(path).exists() and not Path(path).is_file():  # opening a pipe could take forever
        raise ModelError(f"{where}: no file: expected one that hybridnav build has written")
    try:
        with Path(path).open("rb") as file:
            whole: Any = b""
            if os.fstat(file.fileno()).st_size:
                # Private pages: numba gets ordinary arrays, and the file is never written to.
                whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
    except FileNotFoundError:
        raise MapNotFoundError(f"{where}: no such file") from None
    except OSError as error:
        raise ModelError(f"{where}: cannot be read: {error.strerror}") from None
    return parts_within(memoryview(whole), where)


def parts_within(content: memoryview, where: str) -> list[FiledPart]:
    """Return the parts of a model in memory; see `read_parts`.

    `content`: the bytes of its file, at a multiple of 64; `where`: what messages begin with. Raises
    `ModelError` as by `read_parts`.
    """
    length, checksum = _read_head(bytes(content[: _HEAD.size]), where)
    end, begin = _HEAD.size + length, _aligned(_HEAD.size + length)
    if length > _MAX_HEADER or begin > len(content):
        raise ModelError(f"{where}: the header is cut off: build the model anew")
    header = _read_header(bytes(content[_HEAD.size : end]), checksum, where)
    data = content[begin:]
    _check_places(header, len(data), where)
    return [FiledPart(where, part, data) for part in header.parts]


def _bytes_of(array: AnyArray) -> memoryview:
    little = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
    return little.reshape(-1).view(np.uint8).data


def _aligned(offset: int) -> int:
    return offset + -offset % _ALIGN


def _read_head(head: bytes, where: str) -> tuple[int, int]:
    if len(head) < _HEAD.size or not head.startswith(_MAGIC):
        raise ModelError(
            f"{where}: no model of hybridnav: expected a file that hybridnav build has written"
        )
    _, version, checksum, length = _HEAD.unpack(head)
    if version != FORMAT:
        age = "a newer hybridnav: upgrade, or " if version > FORMAT else "an older hybridnav: "
        raise ModelError(
            f"{where}: format {version}, expected {FORMAT}; it was made by {age}build the model "
            "anew"
        )
    return length, checksum


def _read_header(content: bytes, checksum: int, where: str) -> _Header:
    if zlib.crc32(content) != checksum:
        raise ModelError(
            f"{where}: the header does not match its checksum, the file was altered: build the "
            "model anew"
        )
    try:
        tree = json.loads(content, parse_constant=_refuse, parse_float=_finite)
        return _Header.model_validate(tree)
    except ValidationError as error:
        problem = error.errors(include_url=False, include_input=False)[0]
        key = printable(".".join(map(str, problem["loc"])))
        reason = f"{key}: {problem['msg']}"
    except (ValueError, RecursionError) as error:
        reason = printable(str(error))
    raise ModelError(f"{where}: the header is no description of a model: {reason}")


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no number of JSON")


def _finite(text: str) -> float:
    number = float(text)
    return number if math.isfinite(number) else _refuse(text)


def _check_places(header: _Header, size: int, where: str) -> None:
    """Refuse arrays that overlap or lie outside the file, and impossible sizes."""
    end = 0
    for name, at in sorted(_arrays_of(header), key=lambda item: item[1].offset):
        if at.offset < end or at.offset % _ALIGN:
            raise ModelError(f"{where}: {name} overlaps another array: build the model anew")
        end = at.offset + at.size
        if end > size:
            raise ModelError(
                f"{where}: {name} ends {end - size} bytes behind the file, which was cut off: "
                "build the model anew"
            )
        fits = at.nbytes <= at.size * _MAX_RATIO if at.deflated else at.nbytes == at.size
        if not fits:
            raise ModelError(
                f"{where}: {name} has {at.size} bytes for the shape {at.shape}: build the model "
                "anew"
            )
    if _aligned(end) != size:
        raise ModelError(
            f"{where}: expected {_aligned(end)} bytes of arrays, got {size}: build the model anew"
        )


def _arrays_of(header: _Header) -> Iterator[tuple[str, _Stored]]:
    for part in header.parts:
        for name, at in part.arrays.items():
            yield f"{printable(part.kind)} {printable(name)}", at
