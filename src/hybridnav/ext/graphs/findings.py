"""What is wrong with a graph, by kinds, with a bounded number of examples."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

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
    "bad-cost": "costs that are negative or no number",
    "null": "facts that are null, which Nav2's loader refuses",
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
    "one-way": "nodes that cannot be both reached and left",
    "missing-door": "doors that the robot fits through and no edge passes",
    "missing-room": "rooms that the robot fits in and no node lies in",
    "missing-part": "parts of free space without nodes",
}
"""Kinds of findings, in the order of a report, and what each counts."""

BUILDING_KINDS = {
    "floor-missing": "floors of the building that the graph does not have",
    "floor-unknown": "floors of the graph that the building does not have",
    "link-missing": "links of the building that the graph does not have",
    "link-unknown": "links of the graph that the building does not have",
    "link-kind": "links of another kind than in the building",
    "stop-missing": "floors at which a link stops, and that of the graph does not",
    "stop-unknown": "floors at which a link of the graph stops, and the building's does not",
    "stop-elsewhere": "ends of links that are not where the building has them",
    "pieces": "pieces of the whole graph that nothing connects, though the building does",
}
"""Kinds of findings on the graph of a whole building, beside those of its floors."""

_WARNINGS = frozenset(
    {
        *(
            "line-elsewhere",
            "node-unexplored",
            "node-beyond",
            "edge-unexplored",
            "edge-walk",
            "loop",
        ),
        *("repeated-edge", "same-point", "alone", "floor-missing", "floor-unknown"),
        *("link-missing", "link-kind", "stop-missing"),
    }
)
_NOTES = frozenset({"missing-door", "missing-room", "missing-part"})


@dataclass(frozen=True)
class Example:
    """One case of a finding.

    Examples
    --------
    >>> from hybridnav.ext.graphs import Example
    >>> Example("node 7", ((1.0, 2.0),)).where
    'node 7'
    """

    where: str
    """The node, edge, door or room, and what is known about the case."""
    points: tuple[Point, ...] = ()
    """`(x, y)` in metres, map frame: one for a node, two for an edge, none if it is nowhere."""


@dataclass(frozen=True)
class Finding:
    """All cases of one kind.

    Examples
    --------
    >>> from hybridnav.ext.graphs import Finding
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
        """What is counted."""
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
