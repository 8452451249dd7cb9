"""`hybridnav judge` as people call it."""

import csv
import json

import numpy as np
import pytest

import hybridnav as hn

OFFICE = "maps/office/office.yaml"
DRIVEN = "t,x,y\n0,11.1,7.0\n20,27.5,7.5\n32,27.5,17.4\n40,33.4,17.5\n43.5,34.2,19.7\n"
SCRAPED = "x,y\n11.1,7.0\n27.5,7.5\n27.5,17.2\n33.0,17.5\n34.2,19.7\n"


@pytest.fixture
def files(tmp_path):
    (tmp_path / "driven.csv").write_text(DRIVEN)
    (tmp_path / "scraped.csv").write_text(SCRAPED)
    return tmp_path


def test_a_table_contacts_and_parts_and_a_limit_for_ci(cli, files):
    done = cli("judge", OFFICE, files / "driven.csv", "--fail-above", "20%")
    assert done.code == 0
    head, _, row = done.out.splitlines()[:3]
    told = dict(zip(head.split(" | "), row.split(" | "), strict=True))
    assert told["legal"] == "yes"
    assert float(told["loss %"]) == pytest.approx(17.1, abs=0.1)
    assert "driven: loses 4.8" in done.out
    assert cli("judge", OFFICE, files / "driven.csv", "--fail-above", "0.1").code == 1
    scraped = cli("judge", OFFICE, files / "scraped.csv", "--fail-above", "90%")
    assert scraped.code == 1
    assert "contact, near an obstacle, 0.099 m deep at (33.10, 17.69)" in scraped.out


def test_json_a_csv_and_a_picture_of_the_worst(cli, files):
    names = files / "driven.csv", files / "scraped.csv"
    out, plot = files / "out.csv", files / "out.png"
    done = cli("judge", OFFICE, *names, "--json", "-o", out, "--plot", plot)
    driven, scraped = done.answer["paths"]
    assert (driven["path"], driven["legal"], driven["contacts"]) == ("driven", True, [])
    assert driven["duration_s"] == 43.5
    assert scraped["contacts"][0]["what"] == "near an obstacle"
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["legal"] for row in rows] == ["yes", "no"]
    assert float(rows[0]["optimum m"]) == pytest.approx(driven["optimum_low_m"])
    assert plot.stat().st_size > 10_000


def test_costs_of_nav2_over_the_proved_least(cli, files):
    path = {"start": (8.5, 6.6), "goal": (14.5, 6.6)}
    np.save(files / "a.npy", np.array(list(path.values())))
    done = cli("judge", OFFICE, files / "a.npy", "--preset", "robot", "--json")
    (found,) = done.answer["paths"]
    low, high = found["least_cost"]
    assert low <= high <= found["cost"] * (1 + 1e-9)
    grid = hn.load_map(OFFICE, robot_radius_m=done.answer["robot_radius_m"])
    planner = hn.HybridPlanner(grid, preset="robot")
    assert planner.plan(*path.values()).cost == pytest.approx(high)


def test_refusals_are_one_line(cli, files):
    (files / "mm.csv").write_text("x,y\n11100.5,7000\n27500,7500\n")
    assert cli("judge", OFFICE, files / "mm.csv").refuses(3, "outside the map", "millimetres")
    assert cli("judge", OFFICE, files / "none.csv").refuses(3, "no such file")
    assert cli("judge", OFFICE, files / "driven.csv", "--unit", "feet").refuses(
        2, "expected one of"
    )
    assert cli("judge", OFFICE, files / "driven.csv", "--fail-above", "x").refuses(2, "such as 10%")
    done = cli("judge", OFFICE, files / "driven.csv", "--preset", "grid-astar")
    assert done.refuses(2, "plans by lengths")
    assert cli("judge", OFFICE, files / "driven.csv", "-o", files / "a.txt").refuses(2, ".csv")
    assert json.loads(cli("judge", OFFICE, files / "driven.csv", "--json").out)["paths"]
