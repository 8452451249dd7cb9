"""Files of graphs, whoever has made them."""

from pathlib import Path
from typing import Any

from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav._base.yaml_file import parse_document, read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.fleet import BuildingGraph
from hybridnav.ext.fleet.files.indoorgml import is_indoorgml, read_indoor_floors
from hybridnav.ext.fleet.files.lif import is_lif, read_lif
from hybridnav.ext.fleet.files.osm_xml import Anchor, is_osm
from hybridnav.ext.fleet.files.rmf_editor import is_drawn, read_drawn
from hybridnav.ext.fleet.files.rmf_read import is_rmf, read_rmf
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.files import graphml_yaml as graph_yaml
from hybridnav.graphs.files import json_graphs as graph_json

_TEXTS = (".yaml", ".yml", ".tmap", ".tmap2", ".tplg", ".tpl")
_KNOWN = (
    "GeoJSON of Nav2, node-link JSON, GraphML, GML, topological maps of STRANDS and LCAS, "
    "Open-RMF, OpenStreetMap, LIF, IndoorGML"
)
_MOST_XML = 2**26
"""Most bytes of GraphML, and of XML that turns out to be another format."""
_JSON, _XML = (".geojson", ".json", ".lif"), (".graphml", ".osm", ".xml")
_GML = ".gml"


def load_graph(path: PathLike, *, floor: str | None = None) -> WaypointGraph:
    r"""Read a graph of nodes at points and edges between them.

    Parameters
    ----------
    path
        A file of one of these formats:

        * `.geojson`, `.json`: a route graph of Nav2, or the node-link form of networkx;
        * `.graphml`, `.xml`: GraphML; `.gml`: GML, as of SWAGGER;
        * any other name (`.tmap2`, `.tmap`, `.tplg`, `.yaml`, ...): a topological map of LCAS or
          STRANDS, in YAML or the older text;
        * one floor of a file that `load_building_graph` reads.

        Coordinates are metres in the map frame. Nodes in node-link form, GraphML and GML have
        theirs in attributes, as `WaypointGraph.from_networkx` describes them.
    floor
        Which floor to read of a file with several. `load_building_graph` reads them all.

    Returns
    -------
    WaypointGraph
        The graph, with all facts that the file states. What can be read around (an id that occurs
        twice, a node without coordinates, an edge to a node that is not there) is in its
        `findings`. Where several nodes have one id, edges go to the last, as in Nav2.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it cannot be read: it is in none of these formats, too large, or has no node with a
        point. When it has several floors and none is chosen, or not the chosen floor.

    Examples
    --------
    >>> from hybridnav.ext.fleet import load_graph
    >>> from pathlib import Path
    >>> nodes = [{"id": 1, "x": 0.0, "y": 0.0}, {"id": 2, "x": 3.0, "y": 4.0}]
    >>> import json
    >>> links = [{"source": 1, "target": 2}]
    >>> _ = Path("graph.json").write_text(json.dumps({"nodes": nodes, "links": links}))
    >>> graph = load_graph("graph.json")
    >>> graph.format, graph.n_edges  # undirected: an edge in each direction
    ('node-link', 2)
    """
    suffix, where = Path(path).suffix.lower(), f"graph {printable(path)}"
    try:
        graph = _read(path, suffix, where)
        if not isinstance(graph, WaypointGraph):
            return _floor_in(graph, floor, where)
    except InvalidValueError as error:
        raise MapError(str(error)) from None
    if floor is not None:
        raise MapError(f"{where}: a {graph.format} graph has no floors: leave out {floor!r:.60}")
    return graph


def _read(path: PathLike, suffix: str, where: str) -> WaypointGraph | BuildingGraph:
    try:
        return _read_known(path, suffix, where)
    except MapError as error:
        if isinstance(error, MapNotFoundError) or suffix in (*_JSON, *_XML, *_TEXTS, _GML):
            raise
        ending = printable(repr(suffix))[:20]
        raise MapError(f"{error}; unknown format {ending}, known are {_KNOWN}") from None


def _read_known(path: PathLike, suffix: str, where: str) -> WaypointGraph | BuildingGraph:
    name, text = Path(path).stem, _read_text(path)
    building = _floors_of_text(text, suffix, where, name)
    if building is not None:
        return building
    if suffix in _JSON:
        return graph_json.read_json_graph(text, where, name)
    if suffix in _XML:
        return graph_yaml.read_graphml(text, where, name)
    if suffix == _GML:
        return graph_yaml.read_gml(text, where, name)
    if graph_yaml.is_text_graph(text):
        return graph_yaml.read_text_graph(text, where, name)
    data = parse_document(text, where, MapError, graph_yaml.LIMITS)
    return (
        _read_open_rmf(data, where, name)
        if is_rmf(data)
        else graph_yaml.read_yaml_graph(data, where, name)
    )


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
        * `.json`, `.lif`: a layout in VDMA's Layout Interchange Format, or IndoorGML 2.0.
    anchor
        Place of the frame of a file of OpenStreetMap on the Earth. None for the node that is named
        root, or else the least latitude and longitude of the file.
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
    text = _read_text(path)
    name = Path(path).name.split(".")[0]
    try:
        if suffix in _XML:
            return _read_osm(text, where, name, anchor)
        if suffix in _JSON:
            read = read_indoor_floors if is_indoorgml(text) else read_lif
            return read(text, where, name)
        data = parse_document(text, where, MapError, graph_yaml.LIMITS)
        if not is_rmf(data):
            raise MapError(f"{where}: expected a file of Open-RMF, a mapping with 'levels'")
        return _read_open_rmf(data, where, name, graph_index)
    except InvalidValueError as error:
        raise MapError(str(error)) from None


def _read_text(path: PathLike) -> str:
    """Return the text of a file of a graph, as long as its format may be."""
    suffix = Path(path).suffix.lower()
    kind, most = "YAML or text", graph_yaml.LIMITS.max_bytes
    if suffix in _JSON:
        kind, most = "JSON", graph_json.MOST_BYTES
    elif suffix in _XML:
        kind, most = "XML", _MOST_XML
    elif suffix == _GML:
        kind, most = "GML", graph_yaml.MOST_GML
    return read_text(
        path, what="graph", error=MapError, missing=MapNotFoundError, max_bytes=most, kind=kind
    )


def _read_osm(text: str, where: str, name: str, anchor: Anchor | None = None) -> BuildingGraph:
    from hybridnav.ext.fleet.files.osm_read import read_osm  # noqa: PLC0415 - loads shapely

    return read_osm(text, where, name, anchor=anchor)


def _read_open_rmf(
    data: dict[str, Any], where: str, name: str, graph_index: int | None = None
) -> BuildingGraph:
    """Read a file of Open-RMF, drawn or not."""
    if is_drawn(data):
        return read_drawn(data, where, name, graph_index=graph_index)
    return read_rmf(data, where, name)


def _floor_in(building: BuildingGraph, floor: str | None, where: str) -> WaypointGraph:
    """Return the graph of a floor, or of the only one.

    Raises `MapError` when there are several and none is chosen.
    """
    if floor is None and len(building.floors) > 1:
        names = ", ".join(each.name for each in building.floors)
        raise MapError(f"{where}: it has the floors {names[:200]}: choose one")
    return (building.floors[0] if floor is None else building.floor(floor)).graph


def _floors_of_text(text: str, suffix: str, where: str, name: str) -> BuildingGraph | None:
    """Return the building of a text of XML or JSON, None if it is of another format."""
    if suffix in _XML and is_osm(text):
        return _read_osm(text, where, name)
    if suffix in _JSON and is_lif(text):
        return read_lif(text, where, name)
    if suffix in _JSON and is_indoorgml(text):
        return read_indoor_floors(text, where, name)
    return None
