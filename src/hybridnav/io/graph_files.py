"""Files of graphs, whoever has made them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav._files import printable
from hybridnav.config.yaml_file import read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.io import graph_yaml, json_stream
from hybridnav.io.graph_json import read_json_graph
from hybridnav.io.graph_text import is_text_graph, read_text_graph
from hybridnav.io.graph_xml import read_graphml
from hybridnav.io.graph_yaml import read_yaml_graph

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import PathLike
    from hybridnav.graphs import WaypointGraph

_JSON, _XML = (".geojson", ".json"), (".graphml", ".xml")
_MOST_TEXT = 2**26
"""Most bytes of GraphML and of the older text."""


def load_graph(path: PathLike, *, floor: str | None = None) -> WaypointGraph:
    r"""Read a graph of nodes at points and edges between them.

    Parameters
    ----------
    path
        A file of one of these formats:

        * `.geojson`, `.json`: a route graph of Nav2, or the node-link form of networkx;
        * `.graphml`, `.xml`: GraphML;
        * any other name (`.tmap2`, `.tmap`, `.tplg`, `.yaml`, ...): a topological map of LCAS or
          STRANDS, in YAML or the older text, or one of the files of Open-RMF that
          `load_building_graph` reads.

        Coordinates are metres in the map frame. Nodes in node-link form and GraphML have theirs in
        attributes, as `WaypointGraph.from_networkx` describes them.
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
        When it cannot be read: it is in none of these formats, too large, has no node with a point,
        has several floors and none is chosen, or not the floor that is.

    Examples
    --------
    >>> from pathlib import Path
    >>> nodes = [{"id": 1, "x": 0.0, "y": 0.0}, {"id": 2, "x": 3.0, "y": 4.0}]
    >>> import json
    >>> links = [{"source": 1, "target": 2}]
    >>> _ = Path("graph.json").write_text(json.dumps({"nodes": nodes, "links": links}))
    >>> graph = hn.load_graph("graph.json")
    >>> graph.format, graph.n_edges  # undirected: an edge in each direction
    ('node-link', 2)
    """
    suffix, name = Path(path).suffix.lower(), Path(path).stem
    where = f"graph {printable(path)}"
    kind, most = "topological map", graph_yaml.LIMITS.max_bytes
    read: Callable[[str, str, str], WaypointGraph] = read_yaml_graph
    if suffix in _JSON:
        kind, most, read = "JSON", json_stream.MOST_BYTES, read_json_graph
    elif suffix in _XML:
        kind, most, read = "GraphML", _MOST_TEXT, read_graphml
    text = read_text(
        path, what="graph", error=MapError, missing=MapNotFoundError, max_bytes=most, kind=kind
    )
    if read is read_yaml_graph and is_text_graph(text):
        read = read_text_graph
    try:
        return read(text, where, name)
    except InvalidValueError as error:
        raise MapError(str(error)) from None
