"""Files of recorded paths: what is read, and what is asked instead of guessed."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import shapely

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.harness import load_paths

GRID = hn.OccupancyGrid(
    np.pad(np.zeros((58, 78)), 1, constant_values=1.0),
    frame=hn.Frame(resolution_m=0.1, origin_m=(-1.0, -1.0)),
    robot_radius_m=0,
)
POINTS = np.array([[0.5, 0.5], [2.5, 0.5], [2.5, 2.25]])

# Written by evo 1.38.1, file_interface.write_tum_trajectory_file and write_kitti_poses_file, of
# three poses at 0, 2 and 5.5 s after 1.7e9 s, byte for byte.
_FILES = Path(__file__).parent / "files"
TUM = (_FILES / "evo-1.38.1.tum").read_text()
KITTI = (_FILES / "evo-1.38.1.kitti").read_text()


def read(tmp_path, name, content, **how):
    file = tmp_path / name
    if isinstance(content, bytes):
        file.write_bytes(content)
    else:
        file.write_text(content, encoding="utf-8")
    return load_paths(file, GRID, **how)


@pytest.mark.parametrize(
    ("head", "how"),
    [
        ("t,x,y", {}),
        # rostopic echo -p of ROS 1 names the fields of a message so, with nanoseconds first.
        ("%time,field.pose.pose.position.x,field.pose.pose.position.y,field.twist.linear.x", {}),
        # PlotJuggler's export of a topic.
        ("__time;/odom/pose/pose/position/x;/odom/pose/pose/position/y", {}),
        ("time_ms,x_m,y_m", {}),
        ("a,b,c", {"columns": ["b", "c", "a"]}),
        ("", {"columns": ["2", "3", "1"]}),
    ],
)
def test_tables_by_the_names_of_their_columns(tmp_path, head, how):
    mark = ";" if ";" in head else ","
    per_s = {"%": 1e9, "time_ms": 1e3}.get(head[:7] if head[:4] == "time" else head[:1], 1)
    rows = [
        [repr(float(t * per_s)), *map(repr, map(float, point)), *(["9"] if "twist" in head else [])]
        for t, point in zip((0, 2, 5.5), POINTS, strict=True)
    ]
    lines = [*([head] if head else []), *(mark.join(row) for row in rows)]
    (found,) = read(tmp_path, "a.csv", "\n".join(lines) + "\n", **how)
    assert np.array_equal(found.points, POINTS)
    assert found.times_s is not None
    assert found.times_s == pytest.approx([0, 2, 5.5])
    assert found.name == "a"


def test_trajectories_as_evo_writes_them(tmp_path):
    (tum,) = read(tmp_path, "a.txt", "# a comment\n" + TUM)
    (kitti,) = read(tmp_path, "b.kitti", KITTI)
    assert np.array_equal(tum.points, POINTS)
    assert np.array_equal(kitti.points, POINTS)
    assert tum.times_s is not None
    assert tum.times_s - 1.7e9 == pytest.approx([0, 2, 5.5])
    assert kitti.times_s is None
    camera = "\n".join(
        " ".join(map(str, [1, 0, 0, x, 0, 1, 0, 0.1, 0, 0, 1, y])) for x, y in POINTS
    )
    with pytest.raises(MapError, match="expected a plane x, y: state --columns, such as x,z"):
        read(tmp_path, "c.txt", camera)
    (flat,) = read(tmp_path, "c.txt", camera, columns=["x", "z"])
    assert np.array_equal(flat.points, POINTS)


def test_lines_of_shapely_and_those_that_the_package_writes(tmp_path):
    line = shapely.to_geojson(shapely.LineString(POINTS))
    (found,) = read(tmp_path, "a.geojson", line)
    assert np.array_equal(found.points, POINTS)
    both = read(tmp_path, "a.geojsonl", f"{line}\n{line}\n")
    assert [each.name for each in both] == ["a 1", "a 2"]
    result = hn.HybridPlanner(GRID).plan(POINTS[0], POINTS[2])
    hn.export_path(result, tmp_path / "own.geojson")
    hn.export_path(result, tmp_path / "own.csv")
    for name in ("own.geojson", "own.csv"):
        (own,) = load_paths(tmp_path / name, GRID)
        assert own.points[[0, -1]] == pytest.approx(POINTS[[0, 2]])


def test_arrays(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    assert np.array_equal(load_paths(tmp_path / "a.npy", GRID)[0].points, POINTS)
    np.save(tmp_path / "b.npy", np.column_stack([[0, 1, 2], POINTS]))
    with pytest.raises(MapError, match="have 3 numbers, expected 2: state --columns"):
        load_paths(tmp_path / "b.npy", GRID)
    (found,) = load_paths(tmp_path / "b.npy", GRID, columns=["2", "3", "1"])
    assert found.times_s.tolist() == [0, 1, 2]
    np.save(tmp_path / "c.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(MapError, match="cannot be read"):
        load_paths(tmp_path / "c.npy", GRID)


def test_lists_of_cells_say_whether_rows_come_first(tmp_path):
    # As savePaths of the solvers MAPF-LNS2 and EECBS writes them: (row, column), and (column, row)
    # for MovingAI's instances.
    text = "Agent 0:(3,5)->(3,6)->(4,6)->\nAgent 1:(10,5)->\n"
    with pytest.raises(MapError, match=r"\(column, row\) or \(row, column\)"):
        read(tmp_path, "paths.txt", text)
    first, second = read(tmp_path, "paths.txt", text, unit="matrix")
    cells = np.array([[59 - 3, 5], [59 - 3, 6], [59 - 4, 6]])
    assert first.points == pytest.approx(GRID.frame.points_of(cells))
    assert len(second.points) == 1
    (other, _) = read(tmp_path, "paths.txt", text, unit="image")
    assert other.points == pytest.approx(GRID.frame.points_of([[54, 3], [53, 3], [53, 4]]))


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1000, "100% of its points lie outside the map.*millimetres"),
        (10, "lie outside the map, x -1.00 to 7.00 m.*cells"),
    ],
)
def test_another_unit_is_asked_for(tmp_path, factor, words):
    points = (POINTS + 2) * factor + 0.5
    text = "x,y\n" + "".join(f"{x},{y}\n" for x, y in points.tolist())
    with pytest.raises(MapError, match=words + ".*state --unit"):
        read(tmp_path, "a.csv", text)
    unit = "millimetres" if factor == 1000 else "cells"
    (found,) = read(tmp_path, "a.csv", text, unit=unit)
    wanted = points / 1000 if factor == 1000 else GRID.frame.points_of(points[:, ::-1])
    assert found.points == pytest.approx(wanted)


def test_whole_numbers_and_paths_through_walls_are_asked_about(tmp_path):
    with pytest.raises(MapError, match=r"whole, as those of cells.*state --unit"):
        read(tmp_path, "a.csv", "x,y\n1,1\n2,1\n3,1\n")
    (found,) = read(tmp_path, "a.csv", "x,y\n1,1\n2,1\n3,1\n", unit="metres")
    assert found.points.tolist() == [[1, 1], [2, 1], [3, 1]]
    wall = "x,y\n" + "".join(f"{x / 10 + 0.05},-0.95\n" for x in range(20))
    with pytest.raises(MapError, match="100% of its points lie in occupied cells"):
        read(tmp_path, "a.csv", wall)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", "x,x,y\n0,0,0\n", "state --columns"),
        ("a.csv", "1,2\n3,4\n", "first line is '1,2', expected names"),
        ("a.csv", "x,y\n1,b\n", "cannot be read"),
        ("a.csv", "x,y\n1\n", "cannot be read"),
        ("a.csv", "", "cannot be read"),
        ("a.csv", "x,y\n", "points"),
        ("a.csv", "x,y\nnan,1\n", "finite"),
        ("a.csv", "t,x,y\n1,0.5,0.5\n0,1.5,0.5\n", "the times descend"),
        ("a.csv", "t,x,y\n1.7e18,0.5,0.5\n1.8e18,1.5,0.5\n", "too much for seconds"),
        ("a.csv", b"\xff\xfe", "cannot be read"),
        ("a.txt", "1 2 3\n", "lines of 3 words, expected 8"),
        ("a.txt", "", "lines of 0 words"),
        ("a.txt", TUM.replace("5.000000000000000000e-01", "x"), "cannot be read"),
        ("a.geojson", "{", "cannot be read"),
        ("a.geojson", '{"type": "Point", "coordinates": [0, 0]}', "no path in it"),
        ("a.geojson", '{"type": "LineString", "coordinates": [[0], [1]]}', "points"),
        ("a.geojson", '{"type": "LineString", "coordinates": []}', "points"),
        ("a.geojson", "[" * 100_000, "cannot be read"),
        ("a.npy", b"\x93NUMPY", "cannot be read"),
    ],
)
def test_what_cannot_be_read_ends_in_one_line(tmp_path, name, content, words):
    with pytest.raises(MapError, match=re.escape(words)) as error:
        read(tmp_path, name, content)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 700


def test_a_missing_file_and_an_unknown_unit(tmp_path):
    with pytest.raises(MapNotFoundError, match="no such file"):
        load_paths(tmp_path / "none.csv", GRID)
    with pytest.raises(InvalidValueError, match="unit is 'feet', expected one of metres"):
        load_paths(tmp_path / "none.csv", GRID, unit="feet")  # type: ignore[arg-type]


def test_a_hostile_depth_of_objects_is_no_traceback(tmp_path):
    deep: dict[str, object] = {"type": "Feature", "geometry": None}
    for _ in range(400):
        deep = {"type": "GeometryCollection", "geometries": [deep]}
    with pytest.raises(MapError):
        read(tmp_path, "a.geojson", json.dumps(deep))
