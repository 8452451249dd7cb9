"""Files of graphs, whoever has made them."""

from pathlib import Path

from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav._base.yaml_file import parse_document
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.fleet import BuildingGraph
from hybridnav.ext.fleet.files import graphs as floors
from hybridnav.ext.fleet.files.rmf_read import is_rmf
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.files import graphml_yaml as graph_yaml
from hybridnav.graphs.files.json_graphs import read_json_graph

_TEXTS = (".yaml", ".yml", ".tmap", ".tmap2", ".tplg", ".tpl")
_KNOWN = (
    "GeoJSON of Nav2, node-link JSON, GraphML, GML, topological maps of STRANDS and LCAS, "
    "Open-RMF, OpenStreetMap, LIF, IndoorGML"
)


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
            return floors.floor_in(graph, floor, where)
    except InvalidValueError as error:
        raise MapError(str(error)) from None
    if floor is not None:
        raise MapError(f"{where}: a {graph.format} graph has no floors: leave out {floor!r:.60}")
    return graph


def _read(path: PathLike, suffix: str, where: str) -> WaypointGraph | BuildingGraph:
    try:
        return _read_known(path, suffix, where)
    except MapError as error:
        if isinstance(error, MapNotFoundError) or suffix in (
            *floors.JSON,
            *floors.XML,
            *_TEXTS,
            floors.GML,
        ):
            raise
        ending = printable(repr(suffix))[:20]
        raise MapError(f"{error}; unknown format {ending}, known are {_KNOWN}") from None


def _read_known(path: PathLike, suffix: str, where: str) -> WaypointGraph | BuildingGraph:
    name, text = Path(path).stem, floors.read_graph_text(path)
    building = floors.floors_of_text(text, suffix, where, name)
    if building is not None:
        return building
    if suffix in floors.JSON:
        return read_json_graph(text, where, name)
    if suffix in floors.XML:
        return graph_yaml.read_graphml(text, where, name)
    if suffix == floors.GML:
        return graph_yaml.read_gml(text, where, name)
    if graph_yaml.is_text_graph(text):
        return graph_yaml.read_text_graph(text, where, name)
    data = parse_document(text, where, MapError, graph_yaml.LIMITS)
    return (
        floors.read_open_rmf(data, where, name)
        if is_rmf(data)
        else graph_yaml.read_yaml_graph(data, where, name)
    )
