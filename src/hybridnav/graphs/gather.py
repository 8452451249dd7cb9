"""Nodes and edges as readers find them, and what is wrong with a graph, by kinds. Public:
`SEVERITIES`, `Example` and `Finding`.
"""

import math
import re
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.files import printable
from hybridnav._base.trig import dist
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.frame import FARTHEST_M

Point = tuple[float, float]
Severity = Literal["error", "warning", "note"]
"""Errors stop a robot or a reader, warnings may; notes are what graphs leave out on purpose too."""
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
"""Severities of findings, the worst first."""

MOST_EXAMPLES = 1000
"""Examples of each kind that are kept: a damaged file may have a million."""

KINDS = {
    "no-coordinates": "nodes without coordinates",
    "repeated-id": "ids that occur more than once",
    "bad-id": "ids that Nav2 cannot hold",
    "unknown-node": "edges to nodes that are not there",
    "link-unread": "lifts, stairs and ramps of the file that cannot be placed, and are left out",
    "stop-unread": "stops of lifts at levels that are not there, or without a vertex in the cabin",
    "level-unaligned": "levels without two fiducials in common with the reference level",
    "fiducial-off": "fiducials that contradict the others, or the measurements",
    "scale-unsure": "measurements without a length, and levels without a measurement",
    "bad-cost": "costs that are negative or no number",
    "stops-loader": "values at which Nav2's loader stops: it takes nothing of the file",
    "fails-later": "values that Nav2 loads, and fails at later or takes for others",
    "line-elsewhere": "lines that do not run from node to node of their edge",
    "node-outside": "nodes outside the map",
    "node-in-wall": "nodes where the robot does not fit",
    "node-unexplored": "nodes in unexplored space",
    "node-beyond": "nodes on free ground outside the building, which no door joins with it",
    "edge-through-wall": "edges that the robot cannot follow",
    "edge-unexplored": "edges through unexplored space",
    "edge-walk": "edges on which Nav2's walk over cells meets an obstacle, though they are free",
    "loop": "edges from a node to itself",
    "repeated-edge": "edges beside another one from the same node to the same node",
    "same-point": "nodes at the point of another node",
    "alone": "nodes without edges, beside others",
    "components": "components of the graph that no edge connects, though free space does",
    "island": "components of the graph that neither edges nor free space join with the largest",
    "edge-against": "edges against the direction of a one-way door or line of the rooms",
    "one-way": "nodes that cannot be both reached and left",
    "missing-door": "doors that the robot fits through and no edge passes",
    "missing-room": "rooms that the robot fits in and no node lies in",
    "missing-named-room": "the same, of rooms with a name of their own",
    "missing-part": "parts of free space without nodes",
}
"""Kinds of findings, in the order of a report, and what each counts."""

BUILDING_KINDS = {
    "floor-missing": "floors of the building that the graph does not have",
    "floor-unknown": "floors of the graph that the building does not have",
    "link-missing": "links of the building that the graph does not have",
    "link-unknown": "links of the graph that the building does not have",
    "link-kind": "links of another kind than in the building",
    "link-against": "rides against the one direction of a link of the building",
    "stop-missing": "floors at which a link stops, and that of the graph does not",
    "stop-unknown": "floors at which a link of the graph stops, and the building's does not",
    "stop-elsewhere": "ends of links that are not where the building has them",
    "pieces": "pieces of the whole graph that nothing connects, though the building does",
}
"""Kinds of findings on the graph of a whole building, beside those of its floors."""

_WARNINGS = frozenset(
    {
        *("line-elsewhere", "node-unexplored", "node-beyond", "edge-unexplored", "edge-walk"),
        *("loop", "repeated-edge", "same-point", "alone", "floor-missing", "floor-unknown"),
        *("link-missing", "link-kind", "link-unread", "stop-missing", "fails-later"),
        *("stop-unread", "level-unaligned", "fiducial-off", "scale-unsure", "missing-named-room"),
    }
)
_NOTES = frozenset({"island", "missing-door", "missing-room", "missing-part"})


@dataclass(frozen=True)
class Example:
    """One case of a finding.

    Examples
    --------
    >>> from hybridnav.graphs import Example
    >>> Example("node 7", ((1.0, 2.0),)).where
    'node 7'
    """

    where: str
    """The node, edge, door or room, and known facts about the case."""
    points: tuple[Point, ...] = ()
    """`(x, y)` in metres, map frame: one for a node, two for an edge, none if it is nowhere."""


@dataclass(frozen=True)
class Finding:
    """All cases of one kind.

    Examples
    --------
    >>> from hybridnav.graphs import Finding
    >>> Finding("loop", 3, ()).text
    'edges from a node to itself'
    """

    kind: str
    """A key of `KINDS` or `BUILDING_KINDS`."""
    count: int
    """Number of cases."""
    examples: tuple[Example, ...]
    """The first 1,000 cases."""

    @property
    def text(self) -> str:
        """The counted things, in words."""
        return (KINDS | BUILDING_KINDS)[self.kind]

    @property
    def severity(self) -> Severity:
        """Whether it is an error, a warning or a note."""
        return "note" if self.kind in _NOTES else "warning" if self.kind in _WARNINGS else "error"


@dataclass
class Findings:
    """Findings while they are collected."""

    _counts: dict[str, int] = field(default_factory=dict)
    _examples: dict[str, list[Example]] = field(default_factory=dict)
    _nodes: dict[tuple[str, int], tuple[Any, ...]] = field(default_factory=dict)
    """Ids of the nodes at which examples are that have no point yet."""

    def add(self, kind: str, where: str, *points: Point, nodes: tuple[Any, ...] = ()) -> None:
        """Add a case, at points, or at nodes by their ids until `locate`."""
        self._counts[kind] = self._counts.get(kind, 0) + 1
        examples = self._examples.setdefault(kind, [])
        if len(examples) < MOST_EXAMPLES:
            if nodes:
                self._nodes[kind, len(examples)] = nodes
            examples.append(Example(where, points))

    def locate(self, point_of: Callable[[Any], Point | None]) -> None:
        """Give the cases that are at nodes the points of these, as far as they have one."""
        for (kind, at), nodes in self._nodes.items():
            points = tuple(point for node in nodes if (point := point_of(node)) is not None)
            self._examples[kind][at] = replace(self._examples[kind][at], points=points)

    def add_all(self, findings: Iterable[Finding]) -> None:
        """Add what has been found before."""
        for found in findings:
            self._counts[found.kind] = self._counts.get(found.kind, 0) + found.count
            self._examples.setdefault(found.kind, []).extend(found.examples)

    def collected(self) -> tuple[Finding, ...]:
        """Return all findings, errors first, then in the order of `KINDS` and `BUILDING_KINDS`."""
        found = [
            Finding(kind, self._counts[kind], tuple(self._examples[kind]))
            for kind in KINDS | BUILDING_KINDS
            if kind in self._counts
        ]
        return tuple(sorted(found, key=lambda each: SEVERITIES.index(each.severity)))


# Nodes and edges as readers find them, until they are a graph.


Name = int | str


_PAIRS = ("point", "world", "position", "coordinates", "pos", "xy")
"""Attributes that hold the point of a node; SWAGGER keeps pixels in `pos` beside `world`."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MOST_TEXT = 200
"""Characters of a text that is searched for a point, and of an id that is no number."""
_MOST_SHOWN = 60
"""Characters of an id in a message."""
_OFF_M = 0.01
"""Distance in metres from its node up to which an end of a line counts as there."""


def number_of(value: Any) -> float:
    """Return a finite number as a float, also of a text that is one; NaN for all else."""
    if isinstance(value, str) and len(value) <= _MOST_TEXT:
        value = float(value) if _NUMBER.fullmatch(value.strip()) else None
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return math.nan
    try:
        number = float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.nan
    return number if math.isfinite(number) else math.nan


def pair_of(value: Any) -> Point | None:
    """Return a point in metres from a sequence or a text that begins with two numbers; None if it
    is no such thing or farther than any map."""
    if isinstance(value, str):
        value = _NUMBER.findall(value[:_MOST_TEXT])
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        value = (value.get("x"), value.get("y"))
    if not isinstance(value, list | tuple) or len(value) < 2:  # noqa: PLR2004 - x and y
        return None
    x, y = number_of(value[0]), number_of(value[1])
    return (x, y) if max(abs(x), abs(y)) <= FARTHEST_M and x == x and y == y else None  # noqa: PLR0124


def point_of(facts: Mapping[str, Any]) -> Point | None:
    """Return the point that the attributes of a node hold, None for none."""
    if "x" in facts and "y" in facts:
        return pair_of((facts["x"], facts["y"]))
    return next((pair_of(facts[key]) for key in _PAIRS if key in facts), None)


def name_of(value: Any) -> Name:
    """Return an id as a number or a text."""
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, int | str) and not isinstance(value, bool):
        return value
    return f"{value!r:.{_MOST_TEXT}}"


def shown(name: Name) -> str:
    """Return an id for a message: one line, not too long."""
    text = printable(" ".join(str(name).split()))
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}..."


def edge_text(name: Name | None, tail: Name, head: Name) -> str:
    """Return the words for an edge in messages."""
    own = "" if name is None else f" {shown(name)}"
    return f"edge{own} from {shown(tail)} to {shown(head)}"


def free_name(wanted: Iterable[str], taken: set[Any]) -> str:
    """Return the first of some names that is not taken, which it is then."""
    found = next(name for name in wanted if name not in taken)
    taken.add(found)
    return found


def _one_line(text: str) -> str:
    """Return a name without line breaks, control codes and lone surrogates, and not too long."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in " ".join(text.split()))
    return plain[:_MOST_TEXT]


class Gathered:
    """Nodes and edges in the order in which a reader finds them; edges may come first.

    `where`: the file, as messages begin with it.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.findings = Findings()
        self._index: dict[Name, int] = {}
        self._lost: set[Name] = set()
        self._names: list[Name] = []
        self._points = array("d")
        self._node_facts: dict[int, dict[str, Any]] = {}
        self._edge_names: list[Name | None] = []
        self._endpoints: list[Name] = []
        self._costs = array("d")
        self._edge_facts: dict[int, dict[str, Any]] = {}
        self._lines: dict[int, FloatArray] = {}
        self.edge_ids: set[Name] = set()

    @property
    def has_nodes(self) -> bool:
        """Whether any node has a point."""
        return bool(self._names)

    def add_node(self, name: Any, point: Point | None, facts: Mapping[str, Any]) -> None:
        """Add a node; edges go to the last one of an id, as in Nav2.

        `name`: its id, of any type; `point`: `(x, y)` in metres; None if there is none, and then
        the node is left out; `facts`: all else.
        """
        name = name_of(name)
        if name in self._index or name in self._lost:
            self.findings.add("repeated-id", f"node {shown(name)}", *([point] if point else []))
        if point is None:
            self._lost.add(name)
            self.findings.add("no-coordinates", f"node {shown(name)}")
            return
        node = len(self._names)
        self._index[name] = node
        self._names.append(name)
        self._points.extend(point)
        if facts:
            self._node_facts[node] = dict(facts)

    def add_edge(
        self,
        endpoints: tuple[Any, Any],
        facts: Mapping[str, Any],
        *,
        name: Any = None,
        cost: Any = None,
        line: Sequence[Any] | None = None,
    ) -> None:
        """Add a directed edge.

        `endpoints`: ids of its tail and head; `facts`: all else; `name`: its id; None for none;
        `cost`: its cost as stated; None for none; `line`: points `[x, y]` in metres along which it
        is drawn.
        """
        tail, head = map(name_of, endpoints)
        edge = len(self._edge_names)
        self._edge_names.append(None if name is None else name_of(name))
        self._endpoints += tail, head
        stated = math.nan if cost is None else number_of(cost)
        if cost is not None and not stated >= 0:
            shown = f"{cost!r:.60}"
            self.findings.add("bad-cost", f"{self._text(edge)}: {shown}", nodes=(tail, head))
        self._costs.append(stated)
        if facts:
            self._edge_facts[edge] = dict(facts)
        if line:
            self._add_line(edge, [pair_of(point) for point in line])

    def _add_line(self, edge: int, points: list[Point | None]) -> None:
        if None in points:
            ends = tuple(self._endpoints[-2:])
            self.findings.add(
                "line-elsewhere", f"{self._text(edge)}: no line of points", nodes=ends
            )
            return
        endpoints = [self._index.get(name) for name in self._endpoints[-2:]]
        if points != [None if node is None else self._point(node) for node in endpoints]:
            self._lines[edge] = frozen(np.array(points, dtype=np.float64))

    def add_link(
        self,
        endpoints: tuple[Any, Any],
        facts: Mapping[str, Any],
        *,
        directed: bool,
        name: Any = None,
    ) -> None:
        """Add an edge of a plain graph: two, if it is undirected."""
        cost = facts.get("cost", facts.get("weight"))
        rest = {key: value for key, value in facts.items() if key != "cost"}
        self.add_edge(endpoints, rest, name=name, cost=cost)
        if not directed and endpoints[0] != endpoints[1]:
            self.add_edge((endpoints[1], endpoints[0]), rest, cost=cost)

    def check_edge_name(self, name: Any, endpoints: tuple[Any, Any]) -> None:
        """Add a finding if an edge before has the same id."""
        name, (tail, head) = name_of(name), map(name_of, endpoints)
        if name in self.edge_ids:
            text = edge_text(name, tail, head)
            self.findings.add("repeated-id", text, nodes=(tail, head))
        self.edge_ids.add(name)

    def _text(self, edge: int) -> str:
        tail, head = self._endpoints[2 * edge : 2 * edge + 2]
        return edge_text(self._edge_names[edge], tail, head)

    def fields(self, kind: str, name: str, frame: str = "") -> dict[str, Any]:
        """Return the fields of a `WaypointGraph`.

        Edges to nodes that are not there are left out.

        `name`: its name; what pictures and tables cannot hold is replaced; `frame`: name of its
        frame. Raises `InvalidValueError` when no node has a point.
        """
        if not self._names:
            raise InvalidValueError(
                f"{self.where}: no node has a point, expected nodes with x and y in metres"
            )
        index = self._index
        self.findings.locate(self._point_named)
        endpoints = np.array(
            [index.get(name, -1) for name in self._endpoints], dtype=np.int64
        ).reshape(-1, 2)
        kept = np.flatnonzero((endpoints >= 0).all(axis=1))
        for edge in np.flatnonzero((endpoints < 0).any(axis=1)).tolist():
            known = [self._point(node) for node in endpoints[edge].tolist() if node >= 0]
            self.findings.add("unknown-node", self._text(edge), *known)
        place = {edge: at for at, edge in enumerate(kept.tolist())}
        lines = {}
        for edge, line in self._lines.items():
            if edge in place and self._is_bent(edge, endpoints[edge].tolist(), line):
                lines[place[edge]] = line
        facts = self._edge_facts
        return {
            "name": _one_line(name),
            "format": kind,
            "frame": _one_line(frame),
            "names": tuple(self._names),
            "points": frozen(np.array(self._points, dtype=np.float64).reshape(-1, 2)),
            "edge_names": tuple(self._edge_names[edge] for edge in place),
            "edges": frozen(endpoints[kept]),
            "costs": frozen(np.array(self._costs, dtype=np.float64)[kept]),
            "lines": lines,
            "node_facts": self._node_facts,
            "edge_facts": {place[edge]: facts[edge] for edge in facts if edge in place},
            "findings": self.findings.collected(),
        }

    def _point_named(self, name: Name) -> Point | None:
        return self._point(self._index[name]) if name in self._index else None

    def _point(self, node: int) -> Point:
        return self._points[2 * node], self._points[2 * node + 1]

    def _is_bent(self, edge: int, endpoints: list[int], line: FloatArray) -> bool:
        """Return whether a line is other than the segment between its nodes; one that does not run
        from the first to the second is a finding."""
        tail, head = map(self._point, endpoints)
        off = max(dist(tail, line[0]), dist(head, line[-1]))
        if off > _OFF_M:
            self.findings.add("line-elsewhere", f"{self._text(edge)}: {off:.2f} m off", tail, head)
        return len(line) > 2 or off > 0  # noqa: PLR2004 - its two nodes


def quoted(text: str) -> str:
    """Return a text as YAML in double quotes, on one line; a lone surrogate becomes U+FFFD."""
    letters = []
    for letter in text:
        if letter in '"\\':
            letters.append(f"\\{letter}")
        elif letter.isprintable():
            letters.append(letter)
        else:
            code = 0xFFFD if "\ud800" <= letter <= "\udfff" else ord(letter)
            letters.append(f"\\U{code:08X}")
    return f'"{"".join(letters)}"'
