"""Files of graphs with several floors, whoever has made them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._base.files import printable
from hybridnav._base.yaml_file import parse_document, read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.graphs.files import graphml_yaml as graph_yaml
from hybridnav.ext.graphs.files import json_graphs as graph_json
from hybridnav.ext.graphs.files.lif import is_lif, read_lif
from hybridnav.ext.graphs.files.osm_read import read_osm
from hybridnav.ext.graphs.files.osm_xml import is_osm
from hybridnav.ext.graphs.files.rmf_editor import is_drawn, read_drawn
from hybridnav.ext.graphs.files.rmf_read import is_rmf, read_rmf

if TYPE_CHECKING:
    from hybridnav._base.typing import PathLike
    from hybridnav.ext.fleet import BuildingGraph
    from hybridnav.ext.graphs import WaypointGraph
    from hybridnav.ext.graphs.files.osm_xml import Anchor


_MOST_XML = 2**26
"""Most bytes of GraphML, and of XML that turns out to be another format."""
JSON, XML = (".geojson", ".json", ".lif"), (".graphml", ".osm", ".xml")


def load_building_graph(
    path: PathLike, *, anchor: Anchor | None = None, graph_index: int | None = None
) -> BuildingGraph:
    """Read a graph of one or several floors, with the links between them.

    Parameters
    ----------
    path
        A file of one of these formats:

        * `.yaml`, `.yml`: a navigation graph of Open-RMF, or a building map of its traffic editor;
        * `.osm`, `.xml`: OpenStreetMap's XML with indoor tags, or an area graph (osmAG);
        * `.json`, `.lif`: a layout in VDMA's Layout Interchange Format.
    anchor
        Where the frame of a file of OpenStreetMap is to lie on the Earth; None for the node that is
        named root, or else the least latitude and longitude of the file.
    graph_index
        Which of the graphs of a building map, from 0 to 9; None for the first that has lanes.

    Returns
    -------
    BuildingGraph
        The floors, each with its graph, in the frame of the file, and the links. What can be read
        around is in the `findings` of the graph of each floor.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it cannot be read: it is in none of these formats, too large, or has no node with a
        point.

    Examples
    --------
    >>> from hybridnav.ext.fleet import load_building_graph
    >>> from pathlib import Path
    >>> text = "levels: {L1: {vertices: [[0, 0, {name: dock}], [3, 4, {}]], lanes: [[0, 1, {}]]}}"
    >>> _ = Path("graph.yaml").write_text(text)
    >>> building = load_building_graph("graph.yaml")
    >>> building.floors[0].name, building.floors[0].graph.names
    ('L1', ('dock', 1))
    """
    where, suffix = f"graph {printable(path)}", Path(path).suffix.lower()
    text = read_graph_text(path)
    name = Path(path).name.split(".")[0]
    try:
        if suffix in XML:
            return read_osm(text, where, name, anchor=anchor)
        if suffix in JSON:
            return read_lif(text, where, name)
        data = parse_document(text, where, MapError, graph_yaml.LIMITS)
        if not is_rmf(data):
            raise MapError(f"{where}: expected a file of Open-RMF, a mapping with 'levels'")
        return read_open_rmf(data, where, name, graph_index)
    except InvalidValueError as error:
        raise MapError(str(error)) from None


def read_graph_text(path: PathLike) -> str:
    """Return the text of a file of a graph, as long as its format may be."""
    suffix = Path(path).suffix.lower()
    kind, most = "YAML or text", graph_yaml.LIMITS.max_bytes
    if suffix in JSON:
        kind, most = "JSON", graph_json.MOST_BYTES
    elif suffix in XML:
        kind, most = "XML", _MOST_XML
    return read_text(
        path, what="graph", error=MapError, missing=MapNotFoundError, max_bytes=most, kind=kind
    )


def read_open_rmf(
    data: dict[str, Any], where: str, name: str, graph_index: int | None = None
) -> BuildingGraph:
    """Read a file of Open-RMF, drawn or not."""
    if is_drawn(data):
        return read_drawn(data, where, name, graph_index=graph_index)
    return read_rmf(data, where, name)


def floor_in(building: BuildingGraph, floor: str | None, where: str) -> WaypointGraph:
    """Return the graph of a floor, or of the only one.

    Raises
    ------
    MapError
        When there are several and none is chosen.
    """
    if floor is None and len(building.floors) > 1:
        names = ", ".join(each.name for each in building.floors)
        raise MapError(f"{where}: it has the floors {names[:200]}: choose one")
    return (building.floors[0] if floor is None else building.floor(floor)).graph


def floors_of_text(text: str, suffix: str, where: str, name: str) -> BuildingGraph | None:
    """Return the building of a text of XML or JSON, None if it is of another format."""
    if suffix in XML and is_osm(text):
        return read_osm(text, where, name)
    if suffix in JSON and is_lif(text):
        return read_lif(text, where, name)
    return None
