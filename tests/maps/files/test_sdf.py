"""Worlds of simulators: texts as Gazebo writes them, and what cannot be read as shapes."""

import math

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError


def _collision(geometry, pose=""):
    return f"<collision name='c'>{pose}<geometry>{geometry}</geometry></collision>"


def _cylinder(length=1.0):
    return f"<cylinder><radius>0.075</radius><length>{length}</length></cylinder>"


def _model(inside, pose="", name="m"):
    return f"<model name='{name}'>{pose}<link name='l'>{inside}</link></model>"


@pytest.fixture
def load(tmp_path):
    def read(inside, *, world=True, **options):
        inside = f"<world name='default'>{inside}</world>" if world else inside
        (tmp_path / "a.world").write_text(f"<?xml version='1.0'?><sdf version='1.6'>{inside}</sdf>")
        return hn.load_shapes(tmp_path / "a.world", **options)

    return read


def test_a_world_as_gazebo_saves_one_is_read(load):
    # The elements of a world of the BARN navigation benchmark, world_0.world.
    ground = _model(_collision("<plane><normal>0 0 1</normal><size>100 100</size></plane>"))
    pose = "<pose frame=''>-0.075000 0.075000 0.000000 0.000000 0.000000 0.000000</pose>"
    visual = "<visual name='v'><geometry><box><size>9 9 9</size></box></geometry></visual>"
    state = f"<state world_name='default'><model name='unit_cylinder_0'>{pose}</model></state>"
    world = load(
        "<include><uri>model://sun</uri></include><light name='sun' type='directional'>"
        "<pose frame=''>0 0 10 0 -0 0</pose></light>"
        + ground
        + _model(_collision(_cylinder()) + visual, pose, "unit_cylinder_0")
        + state
    )
    assert [str(shape) for shape in world.shapes] == ["POINT (-0.075 0.075)"]
    assert world.radii_m.tolist() == [0.075]
    assert world.names == ("unit_cylinder_0::l::c",)


def test_poses_of_models_links_and_collisions_add_up(load):
    # sdformat's tutorial "Pose frame semantics": a pose without relative_to is one in the frame of
    # the parent element; sdf/1.12/pose.sdf: degrees='true' states angles in degrees.
    box = _collision("<box><size>2 1 1</size></box>", "<pose>1 0 0.5 0 0 0</pose>")
    link = f"<link name='l'><pose degrees='true'>0 0 0 0 0 90</pose>{box}</link>"
    outer = f"<model name='o'><pose>10 0 0 0 0 0</pose><model name='i'>{link}</model></model>"
    world = load(outer, world=False)
    assert world.names == ("o::i::l::c",)
    assert np.allclose(world.shapes[0].bounds, (9.5, 0, 10.5, 2))
    assert world.shapes[0].area == pytest.approx(2)
    turned = _model(
        _collision("<box><size>2 1 1</size></box>"), f"<pose>0 0 0 0 0 {math.pi / 4}</pose>"
    )
    half = 1.5 * math.sqrt(0.5)
    assert np.allclose(load(turned).shapes[0].bounds, (-half, -half, half, half))


def test_only_what_the_robot_can_meet_is_an_obstacle(load):
    floor = _model(_collision("<box><size>9 9 0.2</size></box>", "<pose>0 0 -0.1 0 0 0</pose>"))
    lintel = _model(_collision("<box><size>1 1 1</size></box>", "<pose>0 0 2.5 0 0 0</pose>"))
    ball = _model(_collision("<sphere><radius>0.5</radius></sphere>"), "<pose>3 0 0 0 0 0</pose>")
    capsule = _model(
        _collision("<capsule><radius>0.5</radius><length>1</length></capsule>"),
        "<pose>6 0 1.5 0 0 0</pose>",
    )
    every = floor + lintel + ball + capsule
    assert len(load(every).shapes) == 3
    assert len(load(every, heights_m=(0, 0.4)).shapes) == 1
    assert len(load(every, heights_m=(0, 0.6)).shapes) == 2
    assert len(load(every, heights_m=(-1, 9)).shapes) == 4


def test_what_is_not_read_exactly_is_refused(load, tmp_path):
    pose = "<pose>{}</pose>"
    wrong = {
        "holds 'include model://cabinet'": "<include><uri>model://cabinet</uri></include>",
        "is a 'mesh', expected box": _model(_collision("<mesh><uri>a.dae</uri></mesh>")),
        "is tilted": _model(_collision(_cylinder()), pose.format("0 0 0 0.1 0 0")),
        "expected six numbers": _model(_collision(_cylinder()), pose.format("0 0 0 0 0")),
        "the pose '0 0 nan": _model(_collision(_cylinder()), pose.format("0 0 nan 0 0 0")),
        "relative to 'm2'": _model(_collision(_cylinder()), "<pose relative_to='m2'>0</pose>"),
        "has a quaternion": _model(_collision(_cylinder()), "<pose rotation_format='quat_xyzw'/>"),
        "expected 1 metres above 0": _model(_collision(_cylinder(length=-1))),
        "has a placement_frame": "<model name='m' placement_frame='l'/>",
        "another in state": _model("")
        + "<state><model name='m'><pose>1 0 0 0 0 0</pose></model></state>",
    }  # fmt: skip
    for message, inside in wrong.items():
        with pytest.raises(MapError, match=message) as caught:
            load(inside)
        assert "\n" not in str(caught.value)
        assert str(caught.value).startswith("world ")
    with pytest.raises(MapError, match="2 worlds, expected one"):
        load("<world name='a'/><world name='b'/>", world=False)
    with pytest.raises(InvalidValueError, match="lowest and highest"):
        load("", heights_m=(1, 0))
    with pytest.raises(MapNotFoundError):
        hn.load_shapes(tmp_path / "none.world")
    for text, message in (
        ("<robot/>", "whose first element is sdf"),
        ("<sdf", "no XML"),
        ("<!DOCTYPE sdf [<!ENTITY a 'b'>]><sdf/>", "DOCTYPE"),
        ("<sdf>" * 60, "nested more than"),
    ):
        (tmp_path / "bad.world").write_text(text)
        with pytest.raises(MapError, match=message):
            hn.load_shapes(tmp_path / "bad.world")
