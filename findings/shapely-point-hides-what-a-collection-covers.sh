#!/bin/sh
# shapely 2.2.0 (GEOS 3.14.1): beside a separate point, a polygon in a collection covers no box inside it.
# Most people expect what shapely 2.0.7 (GEOS 3.11.4) answers: a point elsewhere changes nothing.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check shapely==2.2.0 numpy
cd "$folder"
./venv/bin/python - <<'PYTHON'
import shapely

square, inside = shapely.box(0, 0, 2, 2), shapely.box(0.5, 0.5, 1, 1)
answers = {}
for other in (shapely.Point(5, 5), shapely.LineString([(5, 5), (6, 6)]), shapely.box(5, 5, 6, 6)):
    union = shapely.union_all([square, other])
    assert inside.difference(union).is_empty
    answers[other.geom_type] = union.covers(inside), union.contains(inside), inside.within(union)
print(f"shapely {shapely.__version__}, GEOS {shapely.geos_version_string}")
for kind, found in answers.items():
    print(f"a square and a {kind} elsewhere: covers, contains, within: {found}")
print("expected: True three times for each, as there is nothing of the box outside of the union")
assert answers == {"Point": (False,) * 3, "LineString": (True,) * 3, "Polygon": (True,) * 3}, "this has changed"
PYTHON
