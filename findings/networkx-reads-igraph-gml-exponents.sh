#!/bin/sh
# networkx reads the whole-number exponents of igraph's GML as two attributes: 1e-05 becomes 1, and e = -5.
# Most people expect 1e-05, or an error. (networkx asks for a point in a real number, C's %g writes none.)
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check igraph==1.0.0 networkx==3.6.1
cd "$folder"
./venv/bin/python - <<'PYTHON'
import igraph
import networkx as nx

graph = igraph.Graph([(0, 1)])
graph.vs["label"] = ["a", "b"]
graph.es["weight"] = [1e-05]
graph.write_gml("graph.gml")
(line,) = [line.strip() for line in open("graph.gml") if "weight" in line]
(read,) = [facts for _, _, facts in nx.read_gml("graph.gml").edges(data=True)]
print(f"igraph {igraph.__version__} writes {line!r}; networkx {nx.__version__} reads {read}")
print("expected: {'weight': 1e-05}, or an error")
assert line == "weight 1e-05" and read == {"weight": 1, "e": -5}, "this has changed"
PYTHON
