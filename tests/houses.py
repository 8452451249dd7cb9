"""Small buildings that several tests ask: two rooms a floor, and the file of two floors."""

from pathlib import Path

import numpy as np

import hybridnav as hn

FIGURE = Path(__file__).parents[1] / "maps" / "figure1" / "figure1.yaml"
INK = ("#########", "#...#...#", "#...#...#", "#.......#", "#...#...#", "#########")
LIFT, STAIRS = (1.5, 1.5), (7.5, 4.5)
"""Points in the left and the right one of the two rooms, where links stop."""
LINKS = {
    "lift": "{name: lift, kind: lift, wait_s: 4, "
    'ends: [{floor: "1", at: [0.5, 0.5]}, {floor: "2", at: [1.5, 2.5]}]}',
    "ladder": "{name: ladder, kind: stairs, cost_m: 1, "
    'ends: [{floor: "1", at: [1.5, 0.5]}, {floor: "2", at: [2.0, 2.5]}]}',
}


def two_rooms(name: str = "map") -> hn.OccupancyGrid:
    """A map of two rooms of 3 x 4 m with a door between them."""
    occupied = np.array([[ink == "#" for ink in row] for row in INK])[::-1]
    return hn.OccupancyGrid(occupied.astype(np.float32), name=name, robot_radius_m=0.0)


def write_house(folder: Path, *, links: tuple[str, ...] = tuple(LINKS)) -> Path:
    """Write the file of two floors of one little map; no link stops at one point of both."""
    path = folder / "house.yaml"
    lines = [
        "floors:",
        f'- {{name: "1", map: {FIGURE}}}',
        f'- {{name: "2", map: {FIGURE}, find_rooms: true, elevation_m: 3}}',
        "links:",
        *(f"- {LINKS[name]}" for name in links),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
