"""Recorded paths of bags that rosbags wrote: plans, odometry, and the frames that they are in."""

import math

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import MapError
from hybridnav.harness import load_paths
from tests.ext.live.files.bag_writer import KINDS, BagWriter

GRID = hn.OccupancyGrid(
    np.zeros((60, 80), np.float32),
    frame=hn.Frame(resolution_m=0.1, origin_m=(-1.0, -1.0)),
    robot_radius_m=0,
)
STILL, HALF = (0, 0, 0, 1), (0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4))
SECOND = 10**9


@pytest.mark.parametrize("kind", KINDS)
def test_each_plan_is_a_path_and_its_equal_stamps_are_no_times(tmp_path, kind):
    planner = hn.HybridPlanner(GRID)
    plans = [planner.plan((0.5, 0.5), goal) for goal in ((3.0, 0.5), (0.5, 3.0))]
    target = tmp_path / ("a.bag" if kind == "ros1" else "a")
    how = {} if kind == "ros1" else {"storage": kind}
    hn.ext.live.save_bag(target, plans, grid=GRID, **how)
    found = load_paths(target, GRID)
    assert [each.name for each in found] == ["/plan 1", "/plan 2"]
    assert found[1].points[[0, -1]] == pytest.approx(np.array([(0.5, 0.5), (0.5, 3.0)]))
    assert found[0].times_s is None


def driven(kind, *, transforms):
    """A robot that drives ahead in odom, which lies turned in the map."""
    bag = BagWriter(kind)
    for k in range(5):
        bag.add_odometry((10 + k) * SECOND, (0.5 * k, 0.0, 0.0), STILL)
        if transforms:
            bag.add_tf("map", "odom", (10 + k) * SECOND, (1.0, 0.5, 0.0), HALF)
    return bag


@pytest.mark.parametrize("kind", KINDS)
def test_odometry_comes_into_the_map_by_transforms_or_is_asked_about(tmp_path, kind):
    (found,) = load_paths(driven(kind, transforms=True).write(tmp_path), GRID)
    wanted = [(1.0, 0.5 + 0.5 * k) for k in range(5)]
    assert found.points == pytest.approx(np.array(wanted), abs=1e-12)
    assert found.times_s.tolist() == [0, 1, 2, 3, 4]

    alone = driven(kind, transforms=False).write(tmp_path, "alone")
    with pytest.raises(MapError, match=r"in frame 'odom', expected 'map'.*state --frame odom"):
        load_paths(alone, GRID)
    (stated,) = load_paths(alone, GRID, frame="odom")
    assert stated.points[-1].tolist() == [2.0, 0.0]


def test_one_of_several_topics_must_be_named(tmp_path):
    bag = driven("mcap", transforms=False)
    for topic, *rest in list(bag.messages):
        bag.messages.append((f"{topic}2", *rest))
    path = bag.write(tmp_path)
    with pytest.raises(MapError, match="expected one of /odom, /odom2: state --topic"):
        load_paths(path, GRID, frame="odom")
    with pytest.raises(MapError, match="topic '/scan' is not one"):
        load_paths(path, GRID, frame="odom", topic="/scan")
    (found,) = load_paths(path, GRID, frame="odom", topic="/odom2")
    assert found.name == "/odom2"
