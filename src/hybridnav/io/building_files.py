"""Files of graphs with several floors, whoever has made them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav._files import printable
from hybridnav.config.yaml_file import parse_document, read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.io import graph_yaml
from hybridnav.io.rmf_editor import is_drawn, read_drawn
from hybridnav.io.rmf_in import is_rmf, read_rmf

if TYPE_CHECKING:
    from hybridnav._typing import PathLike
    from hybridnav.building import BuildingGraph


def load_building_graph(path: PathLike, *, graph_index: int | None = None) -> BuildingGraph:
    """Read a graph of one or several floors, with the links between them.

    Parameters
    ----------
    path
        A file of one of these formats:

        * `.yaml`, `.yml`: a navigation graph of Open-RMF, or a building map of its traffic editor.
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
    >>> from pathlib import Path
    >>> text = "levels: {L1: {vertices: [[0, 0, {name: dock}], [3, 4, {}]], lanes: [[0, 1, {}]]}}"
    >>> _ = Path("graph.yaml").write_text(text)
    >>> building = hn.load_building_graph("graph.yaml")
    >>> building.floors[0].name, building.floors[0].graph.names
    ('L1', ('dock', 1))
    """
    where, name = f"graph {printable(path)}", Path(path).name.split(".")[0]
    text = read_text(
        path,
        what="graph",
        error=MapError,
        missing=MapNotFoundError,
        max_bytes=graph_yaml.LIMITS.max_bytes,
        kind="YAML",
    )
    try:
        data = parse_document(text, where, MapError, graph_yaml.LIMITS)
        if not is_rmf(data):
            raise MapError(f"{where}: expected a navigation graph of Open-RMF, with 'levels'")
        if is_drawn(data):
            return read_drawn(data, where, name, graph_index=graph_index)
        return read_rmf(data, where, name)
    except InvalidValueError as error:
        raise MapError(str(error)) from None
