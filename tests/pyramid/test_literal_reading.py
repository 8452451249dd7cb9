"""Why U_d is not compared with the attribute that the source paper's step 3 describes.

Step 3 updates an arc's attribute "with the maximum attribute of the arcs contracted into it", and
step 2 merges two nodes while it is below U_d. Base arcs are one cell long. By induction every arc
of every level has the attribute one cell, since the maximum of ones is one; so no U_d above one
cell ever stops a contraction, and every connected set of one class ends as a single node.
"""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from scipy import ndimage

from hybridnav.pyramid import DualGraphPyramid
from tests.strategies import class_grids, examples, occupancy_grid

U_D_CELLS = 1.5


def literal_apex(classes):
    """Contract by the literal rule: the places left, and all attributes that ever occurred."""
    graph = nx.grid_2d_graph(*classes.shape)
    graph.remove_nodes_from([tuple(cell) for cell in np.argwhere(classes == 0).tolist()])
    graph.add_edges_from(list(graph.edges), attribute=1.0)
    seen = {1.0}
    queue = list(graph.nodes)
    for node in queue:
        while node in graph:
            mergeable = (
                other
                for other, data in graph[node].items()
                if classes[other] == classes[node] and data["attribute"] < U_D_CELLS
            )
            other = next(mergeable, None)
            if other is None:
                break
            for beyond, data in list(graph[other].items()):
                if beyond == node:
                    continue
                old = graph.get_edge_data(node, beyond, default={"attribute": 0.0})["attribute"]
                graph.add_edge(node, beyond, attribute=max(old, data["attribute"]))
                seen.add(graph[node][beyond]["attribute"])
            graph.remove_node(other)
    return graph, seen


def n_single_class_components(classes):
    return sum(ndimage.label(classes == of_class)[1] for of_class in (1, 2))


@given(classes=class_grids(max_side=10))
@settings(max_examples=examples(60), derandomize=True)
def test_read_literally_every_component_collapses_into_one_place(classes):
    graph, attributes = literal_apex(classes)
    assert attributes == {1.0}
    assert len(graph) == n_single_class_components(classes)


@pytest.mark.parametrize("linkage", ["survivor", "radius", "diameter"])
def test_our_readings_do_not(linkage):
    classes = np.ones((12, 12), dtype=np.uint8)
    pyramid = DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=U_D_CELLS, linkage=linkage
    )
    assert pyramid[-1].n_vertices >= 12 * 12 / 9
    everything = DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=float("inf"), linkage=linkage
    )
    assert everything[-1].n_vertices == n_single_class_components(classes) == 1
