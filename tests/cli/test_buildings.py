"""`hybridnav` with buildings of several floors: `plan`, `build`, `check`, `evaluate`, `export`."""

import itertools
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from tests.houses import FIGURE, write_house


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two floors of one little map, with a lift and stairs."""
    return write_house(tmp_path)


QUERY = "--start", "1:1.5,0.6", "--goal", "2:0.5,0.5", "--robot-radius", "0"


def test_a_route_over_floors_is_printed(cli: Any, file: Path) -> None:
    ran = cli("plan", file, *QUERY)
    assert ran.code == 0
    told = ran.out.splitlines()
    building = hn.ext.fleet.load_building(file, robot_radius_m=0)
    plan = building.plan(("1", (1.5, 0.6)), ("2", (0.5, 0.5)))
    assert told[0] == "query      house.yaml, 1:1.5,0.6 to 2:0.5,0.5, robot radius 0 m"
    assert told[1] == "preset     shortest"
    assert told[2] == "status     solved"
    assert told[3] == f"length     {plan.length_m:.2f} m (any-angle)"
    assert told[4] == "rides      ladder from floor 1 to floor 2, 0 s, charged 1.00 m"
    assert told[5] == f"cost       {plan.cost:.2f} m, {plan.travel_s:.0f} s"
    assert told[6] == f"bound      {plan.cost:.2f} m, the route is optimal"
    answer = json.loads(cli("plan", file, *QUERY, "--json").out)
    assert answer["cost"] == plan.cost
    assert answer["floors"] == ["1", "2"]
    assert answer["rides"][0]["link"] == "ladder"
    spaced = cli("plan", file, "--from", "2: room-1", "--to", "1: 0.5,0.5")
    assert (spaced.code, "solved" in spaced.out) == (0, True)  # as on the page


def test_links_and_doors_are_closed(cli: Any, file: Path) -> None:
    by_lift = json.loads(cli("plan", file, *QUERY, "--no-stairs", "--json").out)
    assert [ride["link"] for ride in by_lift["rides"]] == ["lift"]
    closed = json.loads(cli("plan", file, *QUERY, "--blocked", "link:ladder", "--json").out)
    assert closed["cost"] == by_lift["cost"]
    assert closed["blocked"] == ["link:ladder"]
    none = cli("plan", file, *QUERY, "--blocked", "link:ladder", "--blocked", "link:lift")
    assert none.code == 1
    assert "status     no path" in none.out
    door = cli("plan", file, *QUERY, "--blocked", "2:door:1")
    assert (door.code, "no door has the number 1" in door.err) == (2, True)
    room = cli("plan", file, *QUERY, "--blocked", "2:room:room-1")
    assert (room.code, "status     goal blocked" in room.out) == (1, True)
    both = cli("plan", file, *QUERY, "--alternatives", "3", "--max-stretch", "9").out
    assert "route 1    cost" in both
    assert both.count(", by ") == 2
    assert "routes     2 of 3: no other sequence of links is at most 9 times as dear" in both


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--start", "1:1,1"), "missing option '--goal' or '--to'"),
        (("--start", "1,1", "--goal", "2:1,1"), "a point of a building needs its floor, as 1:1,1"),
        (("--start", "4:1,1", "--goal", "2:1,1"), "no floor is called '4': there are 1, 2"),
        (("--start", "1:1,nan", "--goal", "2:1,1"), "expected FLOOR:X,Y, finite numbers"),
        (("--start", "1:1,1,1", "--goal", "2:1,1"), "expected FLOOR:X,Y, finite numbers"),
        (("--from", "attic", "--goal", "2:1,1"), "no room or point of the building is called"),
        ((*QUERY, "--compare"), "--compare is for one map, and this is a building: leave it out"),
        ((*QUERY, "--blocked", "door:1"), "no floor is called 'door'"),
        ((*QUERY, "--blocked", "areas"), "--blocked must be link:NAME, link:NAME@FLOOR, or FLOOR:"),
        ((*QUERY, "--blocked", "link:hoist"), "no link is called 'hoist'"),
        ((*QUERY, "--max-stretch", "3"), "--max-stretch is for alternatives"),
        ((*QUERY, "--language", "fr"), "language must be one of"),
    ],
)
def test_wrong_usage_is_one_line(cli, file, arguments, message):
    ran = cli("plan", file, *arguments)
    assert ran.code == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_options_of_buildings_mean_nothing_on_one_map(cli: Any) -> None:
    query = "plan", FIGURE, "--goal", "2.0,2.5", "--robot-radius", "0"
    ran = cli(*query, "--start", "0.5,0.5", "--no-stairs")
    assert (ran.code, "--no-stairs is for a building" in ran.err) == (2, True)
    ran = cli(*query, "--start", "1:0.5,0.5")
    assert (ran.code, "expected X,Y in metres" in ran.err) == (2, True)


def test_an_unreadable_building_is_no_usage(cli: Any, file: Path) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace("kind: lift", "kind: rope"))
    ran = cli("plan", file, *QUERY)
    assert ran.code == 3
    assert "line 5: link lift: kind must be lift, stairs, ramp, got 'rope'" in ran.err
    assert ran.err.count("\n") == 1


def test_a_model_is_built_and_plans_alike(cli: Any, file: Path, tmp_path: Path) -> None:
    out = tmp_path / "house.hnm"
    ran = cli("build", file, "-o", out, "--robot-radius", "0")
    assert ran.code == 0
    assert "floors     2: 1, 2" in ran.out
    assert "links      2: lift, ladder" in ran.out
    one = json.loads(cli("plan", file, *QUERY, "--json").out)
    other = json.loads(cli("plan", out, *QUERY[:4], "--json").out)
    assert one["cost"] == other["cost"]
    assert cli("build", file, "-o", out, "--seed", "3").code == 2
    assert cli("build", file, "-o", out, "--preset", "octile", "--preset", "paper").code == 2


def test_the_floors_are_drawn(cli: Any, file: Path, tmp_path: Path) -> None:
    for number, more in enumerate(
        ((), ("--alternatives", "2", "--max-stretch", "9"), ("--blocked", "link:lift"))
    ):
        picture = tmp_path / f"{number}.svg"
        assert cli("plan", file, *QUERY, *more, "--plot", picture).code == 0
        drawn = picture.read_text(encoding="utf-8")
        assert 'id="link-ladder"' in drawn
        assert 'id="route-1"' in drawn
        assert ('id="route-2"' in drawn) == (number == 1)


POINT = ("--robot-radius", "0")


@pytest.fixture
def two_floors(tmp_path):
    """Two floors of one map, whose lift stops at other points of each."""
    return write_house(tmp_path, links=("lift",))


@pytest.fixture
def graph(cli, two_floors, tmp_path):
    """Its graph, whose floors have one frame: the lift stops at one point of it."""
    path = tmp_path / "graph.yaml"
    given = ("--format", "rmf", "--spacing", "1", *POINT, "-o", path)
    assert cli("export", two_floors, *given).code == 0
    return path


def test_a_sound_graph_in_a_frame_of_its_own(cli, two_floors, graph, tmp_path):
    page = tmp_path / "page.html"
    done = cli("check", two_floors, graph, *POINT, "--align", "--pairs", "40", "-o", page)
    assert (done.code, done.err) == (0, "")
    assert "graph      house, 2 of 2 floors, 1 of 1 links\n" in done.out
    assert "two floors 20 pairs: 20 solved\n" in done.out
    assert "found      nothing\n" in done.out
    assert "hint" not in done.out
    text = page.read_text()
    assert text.count("data:image/png;base64,") == 2
    assert "Floor 2: nothing is wrong" in text
    assert "http" not in text
    figures = cli("check", two_floors, graph, *POINT, "--align", "--pairs", "8", "--json").answer
    assert figures["links"] == {"lift": "lift"}
    assert figures["routes"]["all"]["answers"] == {"solved": 8}
    drawn = {
        floor.name: floor.graph.n_nodes for floor in hn.ext.fleet.load_building_graph(graph).floors
    }
    assert {name: one["nodes"] for name, one in figures["floors"].items()} == drawn
    assert figures["findings"] == {}


def test_a_graph_in_another_frame_is_not_taken_for_sound(cli, two_floors, graph):
    done = cli("check", two_floors, graph, *POINT, "--pairs", "40")
    assert done.code == 1
    assert "1 ends of links that are not where the building has them (stop-elsewhere)" in done.out
    assert "lift lift at floor 2: 2.24 m from that of the building" in done.out
    assert "routes     " in done.out
    assert "hint       links stop up to 2.24 m from those of the building: --align, if" in done.out
    figures = cli("check", two_floors, graph, *POINT, "--pairs", "0", "--json").answer
    assert figures["findings"]["stop-elsewhere"]["count"] == 1
    assert (figures["routes"], figures["contradictions"]) == (None, [])


def test_floors_are_matched_and_findings_left_out(cli, two_floors, graph):
    graph.write_text(graph.read_text().replace('"2"', '"L2"').replace("'2'", "'L2'"))
    done = cli("check", two_floors, graph, *POINT, "--pairs", "0")
    assert done.code == 1
    assert "warning    1 floors of the building that the graph does not have" in done.out
    assert "           floor L2\n" in done.out
    kinds = ("floor-missing", "floor-unknown", "stop-missing")
    done = cli(
        "check", two_floors, graph, *POINT, "--pairs", "0", *(f"--ignore={kind}" for kind in kinds)
    )
    assert (done.code, "found      nothing\n" in done.out) == (0, True)
    done = cli("check", two_floors, graph, *POINT, "--align", "--match", "L2=2", "--pairs", "10")
    assert (done.code, "found      nothing\n" in done.out) == (0, True)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("--match", "L2"), "--match must be NAME=FLOOR, got 'L2'"),
        (("--match", "2=7"), "no floor is called '7': there are 1, 2"),
        (("--match", "3=2"), "no floor is called '3': there are 1, 2"),
        (("--match", "2=1", "--match", "2=2"), "has floor '2' of the graph twice"),
        (("--along-lines",), "--along-lines is for one map, and this is a building"),
        (("--floor", "1"), "--floor is for one map, and this is a building"),
        (("--ignore", "walls"), "--ignore must be one of no-coordinates, "),
        (("--preset", "octile"), "load it with preset shortest"),
    ],
)
def test_wrong_usage_of_check_is_one_line(cli, two_floors, graph, given, words):
    assert cli("check", two_floors, graph, *POINT, *given).refuses(2, words)


def test_a_damaged_graph_is_one_line(cli, two_floors, tmp_path):
    path = tmp_path / "damaged.yaml"
    path.write_text("levels: {L1: {vertices: [")
    assert cli("check", two_floors, path, *POINT).refuses(3, "graph ")
    features = tmp_path / "graph.geojson"
    features.write_text('{"type": "FeatureCollection", "features": []}')
    assert cli("check", two_floors, features, *POINT).refuses(3, "graph ")
    path.write_text("levels: {L1: {vertices: [[0, 0, {}]], lanes: []}}")
    assert cli("check", two_floors, path, *POINT).refuses(
        2, "has the floors L1 and the building has 1"
    )


def test_options_of_check_for_buildings_mean_nothing_on_one_map(cli, graph):
    for given in (("--align",), ("--match", "1=2"), ("--pairs", "9"), ("--no-stairs",)):
        done = cli("check", FIGURE, graph, "--floor", "1", *given)
        assert done.refuses(2, f"{given[0]} is for a building, and this is one map: leave it out")
    done = cli("check", FIGURE, graph, "--floor", "1", "--ignore", "pieces")
    assert done.refuses(2, "--ignore must be one of ")


def test_evaluate_names_the_command_for_buildings(cli, two_floors, graph, tmp_path):
    done = cli("evaluate", two_floors, "--graph", graph, "-o", tmp_path / "run")
    words = "is a building, and methods are measured on maps: give the maps of its floors"
    assert done.refuses(2, words, "`hybridnav check BUILDING GRAPH`")


@pytest.fixture
def sideways(tmp_path):
    """Two floors of one map, a lift, and stairs that lead sideways."""
    return write_house(tmp_path)


@pytest.mark.parametrize(
    ("more", "links"),
    [
        (("rmf", "-o", "a.yaml"), {"lift"}),
        (("osm", "-o", "a.osm", "--anchor", "48.15,11.57"), {"lift", "ladder"}),
        (("lif", "-o", "a.json", "--vehicle", "A.B"), {"lift", "ladder"}),
    ],
)
def test_floors_and_links_are_read_back(cli, sideways, more, links, monkeypatch):
    monkeypatch.chdir(sideways.parent)
    given = ("--robot-radius", "0", "--spacing", "1", "--force", "--format", *more)
    done = cli("export", sideways, *given, "--json")
    losses = [report["nearest"]["mean"] for report in done.answer["report"].values()]
    warnings = done.err.count("longer on average than shortest paths")
    assert (done.code, warnings) == (0, sum(loss > 0.1 for loss in losses))
    assert list(done.answer["report"]) == ["1", "2"]
    read = hn.ext.fleet.load_building_graph(more[2])
    counts = {
        floor.name: {"nodes": floor.graph.n_nodes, "edges": floor.graph.n_edges}
        for floor in read.floors
    }
    assert counts == done.answer["floors"]
    assert {link.name for link in read.links} == links
    lift = next(link for link in read.links if link.name == "lift")
    ends = [end.position_m for end in lift.ends]
    assert ends[0] == pytest.approx(ends[1], abs=0.02)
    shown = cli("export", sideways, *given).out
    assert "links      lift, ladder\n" in shown
    assert ("Open-RMF knows lifts only" in shown) == ("rmf" in more)


def test_what_is_for_one_map_is_refused(cli, sideways, tmp_path):
    done = cli("export", sideways, "-o", tmp_path / "a.geojson")
    assert done.refuses(2, "--format nav2 is for one map, and this is a building")
    done = cli("export", sideways, "-o", tmp_path / "a.yaml", "--format", "rmf", "--floor", "1")
    assert done.refuses(2, "--floor is for one map, and this is a building")
    assert not list(tmp_path.glob("a.*"))


def test_a_link_that_the_robot_does_not_fit_in_is_left_out(sideways):
    text = sideways.read_text().replace("kind: lift,", "kind: lift, max_radius_m: 0.05,")
    sideways.write_text(text)
    building = hn.ext.fleet.load_building(sideways, robot_radius_m=0.1)
    assert [link.name for link in hn.ext.fleet.building_graph(building).links] == ["ladder"]


USES = {"rooms-1.yaml": (("{name: hall,", "{name: hall, use: private,"),), "rooms-2.yaml": ()}


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demonstration, with a private hall, a profile of its own, and a file of figure 1."""
    folder = tmp_path_factory.mktemp("maps")
    shutil.copytree(FIGURE.parents[1], folder, dirs_exist_ok=True)
    file = folder / "building" / "building.yaml"
    for name, changes in USES.items():
        text = (file.parent / name).read_text()
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        (file.parent / name).write_text(text)
    profiles = "profiles:\n- {name: bed, stairs: false, width_m: 1.2}\n- {name: visitor}\n"
    file.write_text(file.read_text() + profiles)
    return file


@pytest.mark.full
def test_a_profile_is_planned_and_what_it_forbids_is_told(cli: Any, office: Path) -> None:
    ends = "--from", "reception", "--to", "2.04"
    staff = cli("plan", office, *ends, "--profile", "staff")
    assert staff.code == 0
    assert "profile    staff: all rooms, links and doors" in staff.out
    assert "the route is optimal" in staff.out
    visitor = cli("plan", office, *ends, "--profile", "visitor")
    assert visitor.code == 1
    assert visitor.out.splitlines()[1:4] == [
        "profile    visitor: no private rooms on the way",
        "reason     profile visitor forbids every route: the way is by private rooms (hall)",
        "preset     shortest",
    ]
    plan = cli("plan", office, *ends, "--profile", "bed", "--json").answer
    assert (plan["status"], plan["profile"]) == ("no path", "bed")
    assert "private rooms and" in plan["note"]
    assert "less than 1.20 m wide" in plan["note"]
    unknown = cli("plan", office, *ends, "--profile", "nurse")
    assert unknown.refuses(2, "no profile is called 'nurse'", "bed")


def test_a_map_is_planned_under_a_profile(cli: Any, office: Path) -> None:
    floor = office.parents[1] / "office" / "office.yaml"
    rooms = "--rooms", office.parent / "rooms-1.yaml"
    query = "plan", floor, *rooms, "--from", "reception", "--to", "corridor", "--profile"
    refused = cli(*query, "visitor")
    assert refused.code == 1
    assert "reason     profile visitor forbids every route" in refused.out
    plan = cli(*query, "cart", "--json").answer
    assert plan["status"] == "solved"
    assert plan["settings"]["profile"] == {"name": "cart", "asks": "no stairs, 0.80 m wide"}
    assert plan["gap"] == 0


@pytest.mark.full
def test_out_of_order_lasts_until_it_is_opened(cli: Any, office: Path) -> None:
    lift = "link:north lift"
    assert cli("closed", office).out == "closed     0\n"
    done = cli("closed", office, "--close", lift, "--close", "1:door:17", "--why", "repair")
    assert (
        done.out.splitlines()[0] == f"closed     2, in {office.with_name('building.closed.yaml')}"
    )
    assert [line.rpartition(", ")[2] for line in done.out.splitlines()[1:]] == ["repair"] * 2
    plan = cli("plan", office, "--from", "office 5", "--to", "2.04", "--json").answer
    assert plan["blocked"] == [lift, "1:door:17"]
    assert [ride["link"] for ride in plan["rides"]] == ["east stairs"]
    on = "--close", f"{lift}@2", "--open", lift
    assert cli("closed", office, *on).out.splitlines()[2].startswith(f"{lift}@2")
    query = "plan", office, "--from", "office 5", "--to", "2.04"
    assert "north lift" not in cli(*query).out.partition("rides")[2]
    refused = cli(*query, "--blocked", "link:east stairs@1")
    assert refused.code == 1
    assert "floor 1 is closed" in refused.out or "floor 2 is closed" in refused.out
    cli("closed", office, "--close", lift, "--open", f"{lift}@2")
    assert cli("closed", office, "--open", "link:lift").refuses(2, "is not closed", lift)
    opened = cli("closed", office, "--open", lift, "--json").answer
    assert [item["what"] for item in opened["closed"]] == ["1:door:17"]
    assert cli("closed", office, "--open", "all").out == "closed     0\n"
    for what, *words in (
        ("link:north lft", "did you mean north lift?"),
        ("link:north lift@3", "did you mean north lift@"),
        ("door:7", "door:7 needs its floor, as 1:door:7"),
        ("3:door:7", "no floor is called '3'"),
        ("2:room:2.4", "no room is called '2.4'"),
        ("lift", "must be link:NAME, door:N, room:NAME or one-way:RULE"),
    ):
        assert cli("closed", office, "--close", lift, "--close", what).refuses(2, *words)
    assert cli("closed", office).out == "closed     0\n"
    assert cli("closed", office, "--why", "a").refuses(2, "--why is for --close")
    assert cli("closed", office.with_name("none.yaml")).refuses(2, "there is no file")


@pytest.mark.full
def test_a_link_that_leads_one_way_goes_round_by_another(cli: Any, office: Path) -> None:
    text = office.read_text(encoding="utf-8")
    query = "plan", office, "--from", "office 5", "--to", "2.04"
    back = "plan", office, "--from", "2.04", "--to", "office 5"
    taken = [cli(*each).out.partition("rides")[2].splitlines()[0] for each in (query, back)]
    assert all("north lift" in line for line in taken)

    def links(*query: Any) -> list[str]:
        return [ride["link"] for ride in cli(*query, "--json").answer["rides"]]

    up = "--one-way", "link:north lift=up"
    assert (links(*query, *up), links(*back, *up)) == (["north lift"], ["east stairs"])
    closed = "one-way:link:north lift=up"
    cli("closed", office, "--close", closed, "--why", "repair")
    assert (links(*query), links(*back)) == (["north lift"], ["east stairs"])
    done = cli(*back, "--no-stairs")
    assert done.code == 1
    assert "The way down by link north lift is closed" in done.out
    cli("closed", office, "--open", closed)
    assert links(*back) == ["north lift"]
    office.write_text(text.replace("kind: lift", "kind: lift\n  one_way: down"), encoding="utf-8")
    assert (links(*query), links(*back)) == (["east stairs"], ["north lift"])
    assert cli(*query, "--one-way", "link:lift=up").refuses(2, "no link is called 'lift=up'")


def test_a_map_has_a_journal_too(cli: Any, tmp_path: Path) -> None:
    shutil.copytree(FIGURE.parent, tmp_path, dirs_exist_ok=True)
    file = tmp_path / FIGURE.name
    assert cli("closed", file, "--close", "link:lift").refuses(2, "is of a building")
    assert cli("closed", file, "--close", "room:room-1").code == 0
    query = "plan", file, "--start", "0.5,0.5", "--goal", "2.0,2.5", "--robot-radius", 0
    assert "blocked    room:room-1" in cli(*query).out
    (tmp_path / "figure1.closed.yaml").write_text("closed: [{what: 'link:lift'}]\n")
    assert cli(*query).refuses(3, "link:lift is of a building, and this is one map")
    (tmp_path / "figure1.closed.yaml").write_text("closed: [3]\n")
    assert cli(*query).refuses(3, "figure1.closed.yaml, line 1: expected what, since, why and by")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{name: a, widt_m: 1}", "unknown key 'widt_m'; known are name, through_private"),
        ("{name: a, width_m: wide}", "width_m must be a finite number, got 'wide'"),
        ("{name: a, width_m: -1}", "profile a: width_m is -1.0, expected a number from 0 to 100"),
        ("{name: a, stairs: 1}", "profile a: stairs must be true or false, got 1"),
        ("{width_m: 1}", "name must be a name, got None"),
        ("{name: a}, {name: a}", "profile a: the name is given twice"),
        ("3", "expected a mapping"),
    ],
)
def test_profiles_of_a_file_are_checked(cli: Any, file: Path, line: str, message: str) -> None:
    file.write_text(f"{file.read_text()}profiles: [{line}]\n")
    assert cli("plan", file, *QUERY).refuses(3, "house.yaml, line ", message)


def test_profiles_go_into_the_model(cli: Any, file: Path, tmp_path: Path) -> None:
    file.write_text(f"{file.read_text()}profiles: [{{name: bed, stairs: false}}]\n")
    model = tmp_path / "house.hnm"
    assert cli("build", file, "-o", model, "--robot-radius", 0).code == 0
    plan = cli("plan", model, *QUERY[:4], "--profile", "bed", "--json").answer
    assert [ride["link"] for ride in plan["rides"]] == ["lift"]
    assert plan["profile"] == "bed"


def test_a_tour_over_floors_is_planned_leg_by_leg(cli: Any, file: Path) -> None:
    tour = "plan", file, *QUERY, "--via", "2:2.0,2.5", "--via", "1:0.5,0.5"
    answer = json.loads(cli(*tour, "--json").out)
    building = hn.ext.fleet.load_building(file, robot_radius_m=0)
    stops = [("1", (1.5, 0.6)), ("2", (2.0, 2.5)), ("1", (0.5, 0.5)), ("2", (0.5, 0.5))]
    legs = [building.plan(*pair) for pair in itertools.pairwise(stops)]
    assert answer["cost"] == pytest.approx(sum(leg.cost for leg in legs))
    assert answer["lower_bound"] == pytest.approx(answer["cost"])
    assert [leg["cost"] for leg in answer["legs"]] == [leg.cost for leg in legs]
    assert len(answer["rides"]) == 3
    told = cli(*tour).out
    assert "query      house.yaml, 1:1.5,0.6 via 2:2.0,2.5 via 1:0.5,0.5 to 2:0.5,0.5" in told
    assert f"leg 3      cost {legs[2].cost:.2f} m" in told


def test_a_tour_by_rooms_goes_on_where_a_leg_ended(cli: Any, file: Path) -> None:
    ran = cli("plan", file, *QUERY, "--via", "2:room-1", "--json")
    answer = json.loads(ran.out)
    first, second = answer["legs"]
    assert second["start"][1] == pytest.approx(first["results"][-1]["points"][-1][:2])
    assert (answer["lower_bound"], answer["gap"]) == (None, None)
    assert "bound      none for the tour" in cli("plan", file, *QUERY, "--via", "2:room-1").out
    lost = cli("plan", file, *QUERY, "--via", "2:9,9")
    assert lost.code == 1
    assert "why        Floor 2: The goal lies outside the map." in lost.out
    refused = cli("plan", file, *QUERY, "--via", "2:room-1", "--alternatives", "2")
    assert (refused.code, "--alternatives does not go with --via" in refused.err) == (2, True)


@pytest.mark.parametrize(("language", "word"), [("en", "Floor"), ("de", "Etage")])
def test_the_tightest_places_of_a_route_have_their_floors(cli, file, language, word):
    told = cli("plan", file, *QUERY, "--why", "--language", language).out
    assert f"why        {word} 1: " in told
    assert f"           {word} 2: " in told
