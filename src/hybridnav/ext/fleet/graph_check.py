"""What is wrong with the graph of a building that others have made, on the maps of its floors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.ext.fleet.checks import parts_of
from hybridnav.ext.fleet.graph_match import MatchedGraph
from hybridnav.ext.fleet.graph_network import BuildingNetwork
from hybridnav.ext.graphs.check import GraphCheck, check_graph
from hybridnav.ext.graphs.gather import Findings, shown
from hybridnav.ext.graphs.waypoint_graph import add_one_way, components_of, cut_off, one_way_nodes
from hybridnav.maps.checks import checked_type

if TYPE_CHECKING:
    from hybridnav._base.typing import LongArray
    from hybridnav.ext.graphs.gather import Finding


@dataclass(frozen=True, eq=False)
class BuildingGraphCheck:
    """The graph of a building on its maps, and its faults. Made by `check_building_graph`.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph
    >>> from hybridnav.ext.fleet import check_building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")])
    >>> graph = building_graph(house)
    >>> check = check_building_graph(match_graph(house, graph))
    >>> check.count, list(check.floors)
    (0, ['1', '2'])
    """

    matched: MatchedGraph
    """The graph, matched to the building."""
    floors: dict[str, GraphCheck]
    """The faults on each floor, by its name."""
    findings: tuple[Finding, ...]
    """Faults of floors, links, and the graph as a whole; empty for none."""

    @property
    def count(self) -> int:
        """Number of all cases of all findings."""
        own = sum(found.count for found in self.findings)
        return own + sum(check.count for check in self.floors.values())


def check_building_graph(matched: MatchedGraph) -> BuildingGraphCheck:
    """Find the faults of the graph of a building.

    Each floor is checked as by `check_graph`, but a node is `one-way` only if routes over other
    floors cannot reach and leave it either. `graphs.BUILDING_KINDS` lists the kinds of findings
    beside them. The graph need not have links that the robot does not fit in.

    Parameters
    ----------
    matched
        The graph, matched to the building.

    Returns
    -------
    BuildingGraphCheck
        The findings.

    Raises
    ------
    InvalidValueError
        When a map allows corner cutting.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph
    >>> from hybridnav.ext.fleet import check_building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")])
    >>> drawn = building_graph(Building(house.floors[:1]))
    >>> check = check_building_graph(match_graph(house, drawn))
    >>> [found.kind for found in check.findings]
    ['floor-missing']
    """
    checked_type("matched", matched, MatchedGraph)
    building = matched.building
    findings = Findings()
    for floor in building.floors:
        if floor.name not in matched.floors:
            findings.add("floor-missing", f"floor {floor.name}")
    for name in matched.unknown_floors:
        findings.add("floor-unknown", f"floor {shown(name)}")
    network = BuildingNetwork(matched)
    _add_links(findings, matched, network)
    _add_pieces(findings, network)
    return BuildingGraphCheck(matched, _checked_floors(network), findings.collected())


def _checked_floors(network: BuildingNetwork) -> dict[str, GraphCheck]:
    """Return what is wrong on each floor, by its name.

    Routes there and back may lead over other floors, by the links of the graph that this robot fits
    in.
    """
    one_way = one_way_nodes(network.n_nodes, network.edges())
    checks = {}
    for floor in network.floors.values():
        graph = floor.graph.graph
        check = check_graph(network.building.floor(floor.name).planner.topology, graph)
        findings = Findings()
        findings.add_all(found for found in check.findings if found.kind != "one-way")
        here = one_way - floor.base
        add_one_way(findings, graph, here[(here >= 0) & (here < graph.n_nodes)])
        checks[floor.name] = replace(check, findings=findings.collected())
    return checks


def _add_links(findings: Findings, matched: MatchedGraph, network: BuildingNetwork) -> None:
    met = {link.own.name for link in matched.links if link.own is not None}
    for own in matched.building.links:
        if own.name not in met and own.admits(matched.building.robot_radius_m):
            findings.add("link-missing", f"{own.kind} {own.name}")
    for link in matched.links:
        drawn, own_link = link.drawn, link.own
        what = f"{drawn.kind} {shown(drawn.name)}"
        if own_link is None:
            findings.add("link-unknown", what, *link.ends.values())
            continue
        if own_link.kind != drawn.kind:
            findings.add("link-kind", f"{what}, which is of the kind {own_link.kind}")
        for end in own_link.ends:
            if end.floor in matched.floors and end.floor not in link.ends:
                findings.add("stop-missing", f"{what} at floor {end.floor}", end.position_m)
        for floor, point in link.ends.items():
            fault = network.stop_fault(link, floor)
            if fault:
                kind = "stop-unknown" if own_link.end_on(floor) is None else "stop-elsewhere"
                findings.add(kind, f"{what} at floor {floor}: {fault}", point)


def _add_pieces(findings: Findings, network: BuildingNetwork) -> None:
    """Add pieces of the graph that no edge or ride connects, in one part of the building."""
    part_of = _parts(network)
    piece_of = components_of(network.n_nodes, network.edges(), "weak")
    for index, count, most in cut_off(part_of, piece_of):
        floor, node = network.node(index)
        graph = floor.graph.graph
        where = f"{count} nodes with node {shown(graph.names[node])} of floor {floor.name}"
        x, y = graph.points[node].tolist()
        findings.add("pieces", f"{where}, apart from {most}", (x, y))


def _parts(network: BuildingNetwork) -> LongArray:
    """Return the part of the building that each node lies in, int64 (n,), -1 in no free cell: parts
    of floors that links join are one."""
    part_at = [parts_of(floor) for floor in network.building.floors]
    bases = np.cumsum([0, *(int(labels.max(initial=-1)) + 1 for labels in part_at)]).tolist()
    joined = []
    names = [floor.name for floor in network.building.floors]
    for link in network.building.links:
        if link.admits(network.building.robot_radius_m):
            at = []
            for end in link.ends:
                index = names.index(end.floor)
                grid = network.building.floors[index].planner.grid
                part = int(part_at[index][grid.frame.cell_of(*end.position_m)])
                at += [bases[index] + part] if part >= 0 else []
            joined += [(at[0], other) for other in at[1:]]
    whole = components_of(bases[-1], np.array(joined, dtype=np.int64).reshape(-1, 2), "weak")
    found = np.full(network.n_nodes, -1, dtype=np.int64)
    for index, floor in network.floors.items():
        free = np.flatnonzero(floor.placed.is_free)
        labels = part_at[index][tuple(floor.placed.cells[free].T)]
        found[floor.base + free] = whole[bases[index] + labels]
    return found
