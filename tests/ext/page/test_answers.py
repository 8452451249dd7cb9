"""What the page's server answers: pictures, graphs, plans, files."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.ext.page.tiles import MapLayer, map_layer, palette
from tests.ext.page.server import Client, query_of

QUERY = query_of([10.5, 40.5], [70.5, 10.5])


def test_the_map_is_described(client: Client) -> None:
    found = client.get("floor/0/map.json").value
    assert (found["rows"], found["cols"], found["resolution_m"]) == (48, 80, 0.25)
    assert [room["name"] for room in found["rooms"]["rooms"]] == ["a", "b", "c", "d"]
    assert found["presets"][0] == "shortest"
    assert set(found["presets"]) == set(hn.preset_names())
    assert len(found["levels"]) == len(client.session.planning.topology.pyramid)


def test_a_tile_has_the_colour_of_every_cell(client: Client) -> None:
    answer = client.get("floor/0/tile/map/0/0/0.png?theme=light")
    assert (answer.code, answer.headers["content-type"]) == (200, "image/png")
    pixels = np.asarray(Image.open(io.BytesIO(answer.body)).convert("RGB"))
    grid = client.session.grid
    colours = palette("light")[:, :3]
    assert pixels.shape == (*grid.shape, 3)
    assert (pixels[grid.measured == hn.CellClass.OCCUPIED] == colours[3]).all()
    assert (pixels[grid.classes == hn.CellClass.FREE] == colours[0]).all()


def test_halved_tiles_are_averages_of_all_cells() -> None:
    rng = np.random.default_rng(0)
    index = rng.integers(0, 2, (700, 531)).astype(np.uint8)
    table = np.array([[0, 0, 0, 255], [255, 255, 255, 255]], dtype=np.uint8)
    layer = MapLayer(index, {"light": table, "dark": table})
    assert layer.n_zooms == 3
    for zoom in range(layer.n_zooms):
        side = 256 << zoom
        for row in range(-(-700 // side)):
            for col in range(-(-531 // side)):
                tile = np.asarray(Image.open(io.BytesIO(layer.png(zoom, row, col, "light"))))
                block = 1 << zoom
                part = index[row * side : (row + 1) * side, col * side : (col + 1) * side]
                odd = [(0, -n % block) for n in part.shape]
                whole = np.pad(part, odd, mode="edge").astype(np.float64) * 255
                n, m = whole.shape[0] // block, whole.shape[1] // block
                expected = whole.reshape(n, block, m, block).mean(axis=(1, 3))
                assert tile.shape[:2] == (n, m)
                inside = np.s_[: part.shape[0] // block, : part.shape[1] // block]
                assert np.abs(tile[..., 0][inside] - expected[inside]).max() <= zoom


def test_unexplored_cells_have_a_colour_of_their_own() -> None:
    grid = hn.OccupancyGrid(np.array([[0.0, 1.0, np.nan]]), robot_radius_m=0)
    for theme in ("light", "dark"):
        content = map_layer(grid).png(0, 0, 0, theme)
        pixels = np.asarray(Image.open(io.BytesIO(content)))[0]
        assert len({tuple(pixel) for pixel in pixels.tolist()}) == 3


@pytest.mark.parametrize("level", ["0", "3", "rooms"])
def test_levels_and_rooms_are_layers(client: Client, level: str) -> None:
    name = level if level == "rooms" else f"level-{level}"
    assert client.get(f"floor/0/tile/{name}/0/0/0.png").body.startswith(b"\x89PNG")


def test_the_graph_has_every_arc_of_the_level(client: Client) -> None:
    level = client.session.planning.topology.level
    graph = client.get(f"floor/0/graph/{level.index}.json").value
    drawn = sum(len(graph[f"{kind}_arcs"]) for kind in ("free", "rim", "unexplored"))
    assert drawn + len(graph["loops"]) == level.n_arcs
    assert len(graph["free_dots"]) + len(graph["unexplored_dots"]) == level.n_vertices
    cells = {tuple(cell) for cell in (level.cells[:, ::-1] + 0.5).tolist()}
    assert {tuple(dot) for dot in graph["free_dots"]} <= cells


def test_a_plan_is_that_of_the_planner(client: Client) -> None:
    found = client.post("plan", QUERY).value
    topology = client.session.planning.topology
    frame = topology.grid.frame
    ends = frame.points_of_grid([(40.5, 10.5), (10.5, 70.5)]).round(6)  # row, column
    result = hn.HybridPlanner(topology).plan(*ends)
    assert found["length_m"] == pytest.approx(result.cost)
    assert (found["gap"], found["lower_bound"]) == (0, pytest.approx(result.lower_bound))
    rows_and_cols = np.array(found["parts"][0]["line"])[:, ::-1]
    np.testing.assert_allclose(frame.points_of_grid(rows_and_cols), result.path.points, atol=1e-3)
    words = hn.plan_tour(hn.HybridPlanner(topology), list(ends)).words()
    assert [line["text"] for line in found["words"]] == words
    assert found["legs"][0]["room"] == "a"


def test_a_brief_plan_has_the_same_certificate_and_no_words(client: Client) -> None:
    whole, brief = (
        client.post("plan", QUERY).value,
        client.post("plan", QUERY | {"brief": True}).value,
    )
    assert {name: whole[name] for name in brief if name != "seconds"} == {
        name: value for name, value in brief.items() if name != "seconds"
    }
    assert "words" not in brief


def test_the_optimum_of_the_grid_and_alternatives(client: Client) -> None:
    plan = client.post("plan", QUERY).value
    assert client.post("optimum", QUERY).value["length_m"] > plan["length_m"]
    found = client.post("alternatives", QUERY | {"count": 2}).value["routes"]
    assert len(found) == 2
    assert found[0]["length_m"] == plan["length_m"]
    assert found[0]["legs"] != found[1]["legs"]


@pytest.mark.parametrize("kind", ["doors", "rooms", "polygons"])
def test_a_closure_makes_a_detour(client: Client, kind: str) -> None:
    plan = client.post("plan", QUERY).value
    passed = plan["legs"]
    what: Any = {
        "doors": passed[0]["door"],
        "rooms": passed[1]["room"],
        "polygons": [[x, y] for x, y in _square(plan["parts"][0]["line"][1])],
    }[kind]
    found = client.post("plan", QUERY | {"closed": {"floors": [{"floor": 0, kind: [what]}]}}).value
    assert found["solved"]
    assert found["length_m"] > plan["length_m"]


def _square(point: list[float]) -> list[tuple[float, float]]:
    x, y = point
    return [(x - 2, y - 2), (x + 2, y - 2), (x + 2, y + 2), (x - 2, y + 2)]


def test_a_route_that_is_not_there_says_why(client: Client) -> None:
    doors = [door.number for door in client.session.planning.topology.rooms.listed_doors]
    query = QUERY | {"closed": {"floors": [{"floor": 0, "doors": doors}]}}
    found = client.post("plan", query | {"language": "de"}).value
    assert not found["solved"]
    assert "Tür" in found["why"]
    assert "door" in client.post("plan", query).value["why"]
    assert client.post("plan", query | {"brief": True}).value["why"] == ""
    assert client.post("plan", QUERY).value["why"] == ""


def test_costs_are_an_overlay_of_the_presets_that_have_some(client: Client) -> None:
    assert client.get("floor/0/costs/shortest.json").value == {"most": None}
    assert client.get("floor/0/tile/costs-shortest/0/0/0.png").code == 422
    most = client.get("floor/0/costs/robot.json").value["most"]
    factors = client.session.planning.planner("robot").costs
    free = client.session.grid.classes == hn.CellClass.FREE
    assert most == pytest.approx(factors.factors[free].max(), abs=1e-3)
    pixels = np.asarray(
        Image.open(io.BytesIO(client.get("floor/0/tile/costs-robot/0/0/0.png").body))
    )
    assert (pixels[factors.factors == 1][:, 3] == 0).all()
    assert (pixels[~free][:, 3] == 0).all()


def test_files_are_those_of_the_library(client: Client, folder: Path, tmp_path: Path) -> None:
    before = sorted(file.name for file in folder.iterdir())
    graph = json.loads(client.post("floor/0/export/nav2", None).body)
    assert graph["type"] == "FeatureCollection"
    for ending in ("csv", "geojson"):
        content = client.post(f"export/path-{ending}", QUERY | {"floor": 0}).body
        file = tmp_path / f"own.{ending}"
        topology = client.session.planning.topology
        ends = topology.grid.frame.points_of_grid([(40.5, 10.5), (10.5, 70.5)]).round(6)
        hn.export_path(hn.HybridPlanner(topology).plan(*ends), file)
        assert content == file.read_bytes()
    model = tmp_path / "own.hnm"
    model.write_bytes(client.post("export/model", None).body)
    assert hn.load(model).rooms is not None
    assert sorted(file.name for file in folder.iterdir()) == before


def test_a_door_is_passed_into_the_room_that_its_arrow_points_to(client: Client) -> None:
    facts = client.get("floor/0/map.json").value["rooms"]
    label_of, doors = client.session.planning.topology.rooms.labels, facts["doors"]
    assert facts["one_way"] == []
    for door in doors:
        at, ahead = np.array(door["at"]), np.array(door["ahead"])
        assert np.abs(ahead).sum() > 0.5
        points = client.session.grid.frame.points_of_grid(
            np.array([at - ahead, at + ahead])[:, ::-1]
        )
        found = [label_of.at((x, y), client.session.grid) for x, y in points.tolist()]
        assert found == door["rooms"]

    def planned(into: int) -> Any:
        rules = [f"door:{door['number']}={door['rooms'][into]}" for door in passed]
        asked = QUERY | {"closed": {"floors": [{"floor": 0, "one_way": rules}]}}
        return client.post("plan", asked).value

    plain = client.post("plan", QUERY).value
    numbers = [leg["door"] for leg in plain["legs"] if leg["door"] is not None]
    rooms = [leg["room"] for leg in plain["legs"]]
    passed = [door for door in doors if door["number"] in numbers[:1]]
    ahead = passed[0]["rooms"].index(rooms[1])
    assert planned(ahead)["length_m"] == plain["length_m"]
    assert planned(1 - ahead)["length_m"] != plain["length_m"]
