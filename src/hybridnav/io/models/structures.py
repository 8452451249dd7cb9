"""Descriptions of all structures of a model.

Limits of sizes are generous bounds on the sizes of real structures: they keep an altered header
from demanding memory.
"""

from __future__ import annotations

from hybridnav.grid.limits import MAX_CELLS
from hybridnav.io.models.array_specs import ArraySpec, Structure

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
    1,
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

KEY = Structure("key", 1, (), {})
"""Key by which a kept model is found."""

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
        KEY,
        MESH,
        CORNER_GRAPH,
        CORNER_EDGES,
        CORNER_HIERARCHY,
        JUMP_GRAPH,
    )
)
"""The kinds of all parts of a model."""

GONE = frozenset({"portals", "portal tables"})
"""Kinds of parts that models of earlier versions have."""
