"""Descriptions of all structures of a model.

Limits of sizes are generous bounds on the sizes of real structures: they keep an altered header
from demanding memory.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hybridnav._base.files import printable
from hybridnav._base.typing import AnyArray
from hybridnav.errors import ModelError
from hybridnav.maps.cells import MAX_CELLS
from hybridnav.models.container import FiledPart, Part

# Descriptions of the structures of a model: arrays, with their valid shapes and values.
#
# A structure is written and read through one description. An attribute added to a class is added
# to its description, whose version then goes up.

_TERM = re.compile(r"(?:(\d+)\*)?([a-z_]+)([+-]\d+)?")
_Size = int | str

MOST = "1000*cells+100000000"
"""Most bytes of a structure, generously."""


@dataclass(frozen=True)
class ArraySpec:
    """One array of a structure."""

    name: str
    """The attribute of the class."""
    dtypes: str
    """One or several, such as "int16 int32"."""
    shape: tuple[_Size, ...]
    """Numbers, or terms of sizes such as "2*corners+1"."""
    least: float = -math.inf
    """Least value; NaN is refused too; minus infinity for no check."""
    below: _Size | None = None
    """Upper limit of values, exclusive, as for an index; None for no check."""
    is_offsets: bool = False
    """Whether values begin with 0, never fall, and end with `below`."""
    frozen: bool = True
    """Whether the array is read-only in the class, which is another type for numba."""

    def check_shape(self, part: FiledPart, sizes: Mapping[str, int]) -> None:
        """Refuse another shape, or another type of numbers.

        Raises `ModelError` when the header describes the array differently, or not at all.
        """
        at = part.part.arrays.get(self.name)
        if at is None:
            raise refusal(part, f"{self.name} is missing")
        wanted = [evaluated(size, sizes) for size in self.shape]
        if at.shape != wanted or at.dtype not in self.dtypes.split():
            raise refusal(
                part, f"{self.name} is {at.dtype} {at.shape}, expected {self.dtypes} {wanted}"
            )

    def check_values(self, part: FiledPart, sizes: Mapping[str, int], array: AnyArray) -> None:
        """Refuse values that would lead kernels out of their arrays.

        Raises `ModelError` when a value is out of range.
        """
        if not array.size:
            return
        if self.is_offsets:
            end = evaluated(self.below or 0, sizes)
            if array[0] != 0 or array[-1] != end or bool((array[1:] < array[:-1]).any()):
                raise refusal(part, f"{self.name} holds no offsets from 0 to {end}")
            return
        if self.least > -math.inf and not array.min() >= self.least:
            raise refusal(part, f"{self.name} has {array.min()}, expected at least {self.least}")
        limit = None if self.below is None else evaluated(self.below, sizes)
        if limit is not None and not array.max() < limit:
            raise refusal(part, f"{self.name} has {array.max()}, expected less than {limit}")


@dataclass(frozen=True)
class Structure:
    """The description of one structure."""

    kind: str
    version: int
    """Version, which goes up with every change of the arrays."""
    arrays: tuple[ArraySpec, ...]
    most: Mapping[str, _Size]
    """The sizes, and the limit of each: a number, or a term of sizes before it."""

    def part(self, thing: Any, sizes: dict[str, int], values: dict[str, Any] | None = None) -> Part:
        """Describe an object of the class.

        `thing`: object with an attribute, or an item, for each array; `sizes`, `values`: numbers
        that shapes consist of, and others.
        """
        read = thing.__getitem__ if isinstance(thing, dict) else lambda name: getattr(thing, name)
        arrays = {spec.name: read(spec.name) for spec in self.arrays}
        return Part(self.kind, self.version, sizes, values or {}, arrays)

    def read(self, filed: FiledPart, known: Mapping[str, int]) -> dict[str, AnyArray]:
        """Read the checked arrays of an object by name.

        Shapes are checked before anything is read, then checksums, then values.

        `known`: sizes of the map: `rows`, `cols` and `cells`. Raises `ModelError` when the part is
        of another version, or an array does not match the description.
        """
        self.check_version(filed)
        sizes = self._checked_sizes(filed, known)
        for spec in self.arrays:
            spec.check_shape(filed, sizes)
        # A deflated file of a few kilobytes could demand a lot of memory.
        size, most = sum(at.nbytes for at in filed.part.arrays.values()), evaluated(MOST, sizes)
        if size > most:
            raise refusal(filed, f"its arrays have {size} bytes, expected at most {most}")
        if len(filed.part.arrays) > len(self.arrays):
            extra = sorted(filed.part.arrays.keys() - {spec.name for spec in self.arrays})
            raise refusal(filed, f"{extra[0]:.40} is not known")
        arrays = filed.read().arrays
        for spec in self.arrays:
            spec.check_values(filed, sizes, arrays[spec.name])
            arrays[spec.name].flags.writeable = not spec.frozen
        return arrays

    def check_version(self, filed: FiledPart) -> None:
        """Refuse a part that another version has written.

        Raises `ModelError` when it is of another version.
        """
        version = filed.part.version
        if version != self.version:
            age = "a newer" if version > self.version else "an older"
            raise refusal(
                filed, f"version {version}, expected {self.version}: made by {age} hybridnav"
            )

    def _checked_sizes(self, filed: FiledPart, known: Mapping[str, int]) -> dict[str, int]:
        """Return all sizes that shapes consist of, checked."""
        sizes = filed.part.sizes
        if sizes.keys() != self.most.keys():
            raise refusal(filed, f"its sizes are {', '.join(sizes) or 'none'}")
        known_sizes = {**sizes, **known}
        for name, most in self.most.items():
            limit = evaluated(most, known_sizes)
            if sizes[name] > limit:
                raise refusal(filed, f"{name} is {sizes[name]}, expected at most {limit}")
        return known_sizes


def evaluated(size: _Size, sizes: Mapping[str, int]) -> int:
    """Return the value of a term of sizes."""
    if isinstance(size, int):
        return size
    match = _TERM.fullmatch(size)
    assert match is not None, size  # noqa: S101 - terms are written in this package
    factor, name, more = match.groups()
    return int(factor or 1) * sizes[name] + int(more or 0)


def refusal(part: FiledPart, what: str) -> ModelError:
    """Return the error for a part that does not match its description."""
    return ModelError(f"{part.where}: {part.kind}: {printable(what):.200}: build the model anew")


GRID = Structure(
    "grid",
    1,
    (
        ArraySpec("palette", "float32", ("levels",)),
        ArraySpec("probability", "uint8 float32", ("rows", "cols")),
        ArraySpec("measured", "uint8", ("rows", "cols"), below=3),
        ArraySpec("classes", "uint8", ("rows", "cols"), below=3),
    ),
    {"rows": MAX_CELLS, "cols": MAX_CELLS, "levels": 256},
)
"""Occupancy, as an index into a palette if it has few values, like that of an image."""

ROOMS = Structure("rooms", 1, (ArraySpec("label_of", "int32", ("rows", "cols"), least=-1),), {})

PYRAMID = Structure(
    "pyramid",
    1,
    (
        ArraySpec("vertex_end", "uint8", ("cells",), frozen=False),
        ArraySpec("vertex_parent", "int32", ("cells",), least=-1, below="cells", frozen=False),
        ArraySpec("edge_end", "uint8", ("2*cells",), frozen=False),
    ),
    {},
)

MESH = Structure(
    "mesh",
    1,
    (
        ArraySpec("corners", "int32", ("corners", 2), least=0, below="cells+1"),
        ArraySpec("kinds", "uint8", ("corners",), below=5),
        ArraySpec("first", "int32", ("polygons+1",), below="slots", is_offsets=True),
        ArraySpec("begins", "int32", ("slots",), least=0, below="corners"),
        ArraySpec("twins", "int32", ("slots",), least=-1, below="slots"),
        ArraySpec("polygon_of", "int32", ("slots",), least=0, below="polygons"),
        ArraySpec("polygon_at", "int32", ("rows", "cols"), least=-1, below="polygons"),
        ArraySpec("block_of", "int32", ("slots",), least=-1, below="blocks"),
        ArraySpec("block_head", "int32", ("blocks",), least=0, below="polygons"),
        ArraySpec("block_up", "int32", ("polygons",), least=-1, below="blocks"),
        ArraySpec("component", "int32", ("polygons",), least=0, below="polygons"),
        ArraySpec("depth", "int32", ("polygons",), least=0, below="polygons"),
    ),
    {"corners": "4*cells", "polygons": "2*corners", "slots": "6*corners", "blocks": "polygons"},
)

_EDGES: dict[str, int | str] = {"corners": "4*cells", "edges": "200*corners"}

CORNER_GRAPH = Structure(
    "corner graph",
    2,
    (
        ArraySpec("first", "int64", ("2*corners+1",), below="edges", is_offsets=True),
        ArraySpec("heads", "int32", ("edges",), least=0, below="corners"),
        ArraySpec("landmark_distances", "float64", ("corners", "landmarks"), least=0),
    ),
    {**_EDGES, "landmarks": 256},
)

CORNER_EDGES = Structure("corner edges", 1, CORNER_GRAPH.arrays[:2], dict(_EDGES))
"""The edges alone: a hierarchy keeps only these of the contracted graph."""

CORNER_HIERARCHY = Structure(
    "corner hierarchy",
    2,
    (
        ArraySpec("first", "int32", ("corners+1",), below="arcs", is_offsets=True),
        ArraySpec("arcs", "int64", ("arcs", 2), least=0),
        ArraySpec("middles", "int64", ("arcs",), least=-1, below="4294967296*corners"),
        ArraySpec("follow", "int64", (4, 64)),
    ),
    {"corners": "4*cells", "arcs": "2000*corners"},
)

JUMP_GRAPH = Structure(
    "jump graph",
    2,
    (
        ArraySpec("index", "int64", ("words", 3)),
        ArraySpec("ahead", "int16 int32", ("free", 8)),
        ArraySpec("order", "int32", ("corners",), least=0, below="corners"),
        ArraySpec("places", "int64", ("corners",), least=0),
        ArraySpec("first", "int32", ("corners+1",), below="arcs", is_offsets=True),
        ArraySpec("arcs", "int64", ("arcs", 2), least=0),
        ArraySpec("middles", "int64", ("middles",), least=-1, below="4294967296*corners"),
        ArraySpec("component", "int32", ("corners",), least=0, below="corners"),
    ),
    {
        "words": "cells",
        "free": "cells",
        "corners": "cells",
        "arcs": "2000*corners",
        "middles": "arcs",
    },
)

PRESET = Structure("preset", 2, (), {})


BUILDING = Structure(
    "building",
    1,
    (ArraySpec("lower", "float64", ("pairs",), least=0), ArraySpec("cost", "float64", ("pairs",))),
    {"pairs": 10_000_000},
)
"""A building, first in its file; what is known between the ends of links, floor after floor."""

FLOOR = Structure("floor", 1, (ArraySpec("model", "uint8", ("bytes",)),), {"bytes": 1 << 48})
"""The model of a map of a building, a file in itself."""

KINDS = frozenset(
    structure.kind
    for structure in (
        GRID,
        ROOMS,
        PYRAMID,
        PRESET,
        MESH,
        CORNER_GRAPH,
        CORNER_EDGES,
        CORNER_HIERARCHY,
        JUMP_GRAPH,
    )
)
"""The kinds of all parts of a model."""

GONE = frozenset({"key", "portals", "portal tables", "hub labels", "jump labels"})
"""Kinds of parts that models of earlier versions have."""
