#!/bin/sh
# shapely 2.2.0 (GEOS 3.14.1) calls GeoJSON invalid if one feature has no place ("geometry": null, which RFC 7946,
# 3.2, names for this), so one such feature loses all others: an error, or None with on_invalid="ignore".
# Most people expect the geometries of the other features, as for a feature with an empty geometry.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check shapely==2.2.0 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
import json

import shapely


def collection(*geometries):
    features = [{"type": "Feature", "properties": {}, "geometry": geometry} for geometry in geometries]
    return json.dumps({"type": "FeatureCollection", "features": features})


placed = {"type": "Point", "coordinates": [1, 2]}
empty = {"type": "GeometryCollection", "geometries": []}
with_empty = shapely.from_geojson(collection(placed, empty))
ignored = shapely.from_geojson(collection(placed, None), on_invalid="ignore")
try:
    told = shapely.from_geojson(collection(placed, None))
except shapely.errors.GEOSException as error:
    told = str(error)
print(f"shapely {shapely.__version__}, GEOS {shapely.geos_version_string}")
print("a point and an empty geometry:", with_empty)
print("a point and null:", told)
print('a point and null, on_invalid="ignore":', ignored)
print("expected: POINT (1 2) in all three")
assert "POINT (1 2)" in str(with_empty) and ignored is None and "null" in str(told), "this has changed"
PYTHON
