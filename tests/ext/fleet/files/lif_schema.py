"""Rules of VDMA's Layout Interchange Format 1.0.0 as a JSON schema, and those that it cannot state.

Written from the guideline of March 2024 by way of ConstantinUp/LIF_Schema (json_schemas/LIF.schema)
and LIF.md of Intralogistics-2X-LIF/Layout-Interchange-Format.
"""

import json
import re

import jsonschema

TEXT, NUMBER = {"type": "string"}, {"type": "number"}


def _object(required, **properties):
    return {"type": "object", "required": required, "properties": properties}


def _list(item, **more):
    return {"type": "array", "items": item} | more


_POSITION = _object(["x", "y"], x=NUMBER, y=NUMBER)
_NODE = _object(
    ["nodeId", "nodePosition", "vehicleTypeNodeProperties"],
    nodeId=TEXT,
    nodeName=TEXT,
    nodeDescription=TEXT,
    mapId=TEXT,
    nodePosition=_POSITION,
    vehicleTypeNodeProperties=_list(
        _object(["vehicleTypeId"], vehicleTypeId=TEXT, theta=NUMBER), minItems=1
    ),
)
_EDGE = _object(
    ["edgeId", "startNodeId", "endNodeId", "vehicleTypeEdgeProperties"],
    edgeId=TEXT,
    edgeName=TEXT,
    edgeDescription=TEXT,
    startNodeId=TEXT,
    endNodeId=TEXT,
    vehicleTypeEdgeProperties=_list(
        _object(
            ["vehicleTypeId", "rotationAllowed"],
            vehicleTypeId=TEXT,
            rotationAllowed={"type": "boolean"},
            maxSpeed=NUMBER,
        ),
        minItems=1,
    ),
)
_STATION = _object(
    ["stationId", "interactionNodeIds"], stationId=TEXT, interactionNodeIds=_list(TEXT, minItems=1)
)
SCHEMA = {
    "$schema": "http://json-schema.org/draft-07/schema#",
    **_object(
        ["metaInformation", "layouts"],
        metaInformation=_object(
            ["projectIdentification", "creator", "exportTimestamp", "lifVersion"],
            projectIdentification=TEXT,
            creator=TEXT,
            exportTimestamp=TEXT,
            lifVersion={"const": "1.0.0"},
        ),
        layouts=_list(
            _object(
                ["layoutId", "layoutVersion", "nodes", "edges", "stations"],
                layoutId=TEXT,
                layoutName=TEXT,
                layoutVersion=TEXT,
                layoutLevelId=TEXT,
                nodes=_list(_NODE),
                edges=_list(_EDGE),
                stations=_list(_STATION),
            )
        ),
    ),
}


def read_lif(path):
    """Read a file by the schema; ids are unique in the file, an edge begins in its own layout."""
    data = json.loads(path.read_text("utf-8"))
    jsonschema.Draft7Validator(SCHEMA).validate(data)
    stamp = data["metaInformation"]["exportTimestamp"]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d\dZ", stamp)
    layouts = data["layouts"]
    every = [node["nodeId"] for layout in layouts for node in layout["nodes"]]
    edges = [edge["edgeId"] for layout in layouts for edge in layout["edges"]]
    for ids in (every, edges, [layout["layoutId"] for layout in layouts]):
        assert len(set(ids)) == len(ids)
    for layout in layouts:
        own = {node["nodeId"] for node in layout["nodes"]}
        for edge in layout["edges"]:
            assert edge["startNodeId"] in own
            assert edge["endNodeId"] in every
    return data
