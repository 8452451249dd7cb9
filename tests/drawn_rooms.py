"""Maps with rooms, drawn with a letter for each room."""

from functools import cache

import numpy as np
from PIL import Image

import hybridnav as hn

SIDE = 0.5
NAMES = {
    "k": "kitchen",
    "a": "archive",
    "b": "bath",
    "d": "den",
    "l": "lab",
    "c": "corridor",
    "o": "hall",
    "m": "maze",
}
# Four rooms over a corridor, and a hall that opens onto it by 6 m; cells of half a metre.
HOUSE = (
    "##############################################",
    "#kkkkkkkk#aaaaaaaa#bbbbbbb#ddddddddd#llllllll#",
    "#kkkkkkkk#aaaaaaaa#bbbbbbb#ddddddddd#llllllll#",
    "#kkkkkkkk#aaaaaaaa#bbbbbbb#ddddddddd#llllllll#",
    "#kkkkkkkk#aaaaaaaa#bbbbbbb#ddddddddd#llllllll#",
    "####kk########aa#######bb######dd#######ll####",
    "#cccccccccccccccccccccccccccccccccccccccccccc#",
    "#cccccccccccccccccccccccccccccccccccccccccccc#",
    "#cccccccccccccccccccccccccccccccccccccccccccc#",
    "#############oooooooooooo#####################",
    "#oooooooooooooooooooooooooooooo###############",
    "#oooooooooooooooooooooooooooooo###############",
    "#oooooooooooooooooooooooooooooo###############",
    "##############################################",
)


def topology_of(lines, doors=None, *, robot_radius_m=0.0, **frame):
    """A map drawn with a letter for each room, y up; `.` is free space without a name."""
    letters = np.array([list(line) for line in reversed(lines)])
    known = [letter for letter in NAMES if (letters == letter).any()]
    label_of = np.full(letters.shape, -1, dtype=np.int32)
    for label, letter in enumerate(known):
        label_of[letters == letter] = label
    rooms = hn.RoomLabels(tuple(NAMES[one] for one in known), label_of, doors=doors or {})
    grid = hn.OccupancyGrid(
        (letters == "#").astype(np.float32), hn.Frame(SIDE, **frame), robot_radius_m=robot_radius_m
    )
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def write_ros(folder, name, pixels, side=SIDE):
    """Write a ROS map of grey values, y up, with cells of so many metres; return its YAML file."""
    Image.fromarray(np.asarray(pixels)[::-1].astype(np.uint8)).save(folder / f"{name}.pgm")
    path = folder / f"{name}.yaml"
    path.write_text(
        f"image: {name}.pgm\nresolution: {side}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


@cache
def house(preset="shortest"):
    return hn.HybridPlanner(topology_of(HOUSE), preset=preset)
