#!/bin/sh
# topojson 2.2 (the Python package) drops each point that lies on the line through its two neighbours, also where the way
# turns back there: a route into a dead end and out again loses the dead end. Unquantized, where one corner is listed twice,
# both copies lie on the "line" between them and the next point: the corner is lost, the room becomes another.
# Most people expect the same shapes back: nothing was to be simplified.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check topojson==2.2 shapely==2.2.0 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
import json
from importlib.metadata import version

import shapely
import topojson


def through(geometry, **options):
    feature = {"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(geometry)}
    topology = topojson.Topology({"type": "FeatureCollection", "features": [feature]}, **options)
    (feature,) = json.loads(topology.to_geojson())["features"]
    return shapely.geometry.shape(feature["geometry"])


route = shapely.LineString([(0, 0), (4, 0), (0, 0), (0, 3)])
room = shapely.Polygon([(0, 0), (4, 0), (4, 0), (4, 3), (0, 3)])
assert route.is_valid and room.is_valid
print("topojson", version("topojson"), "shapely", shapely.__version__)
found = through(route)
print(f"all options at rest: {route} of length {route.length:g} becomes {found} of length {found.length:g}")
print("expected: the same length")
rooms = through(room), through(room, prequantize=False)
print(f"{room} of area {room.area:g} becomes {rooms[0]} of area {rooms[0].area:g}")
print(f"with prequantize=False: {rooms[1]} of area {rooms[1].area:g}")
print("expected: an area of 12 both times")
assert (route.length, found.length) == (11, 3) and (rooms[0].area, rooms[1].area) == (12, 6), "this has changed"
PYTHON
