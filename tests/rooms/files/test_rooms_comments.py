"""What a person wrote into a file of rooms is still there when the file is written again."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.page.requests import Merge, Rename, Split, changed
from hybridnav.maps import RoomLabels
from tests.strategies import drawn, occupancy_grid, tried

FLOOR = drawn(
    "#############################",
    "#.........#........#........#",
    "#.........#........#........#",
    "#..................#........#",
    "#..................#........#",
    "#.........#.................#",
    "#.........#.................#",
    "#############################",
)
GRID = occupancy_grid(FLOOR, resolution_m=0.25)
COMMENTS = (
    "# the \"big\" kitchen, it's Bob's",
    "#no blank, 'half a quote",
    '# " # two signs "',
    "# - name: lab",
    "# Rooms of the west wing: ask Ann",
    "# their numbers; a point of each, by Bob",
    "# Formerly the 'attic'.",
    "# Küche\t# und Bad ",
)
NAMES = (
    "kitchen",
    "it's",
    'the "lab"',
    "a, b",
    "x#1",
    "- c",
    "Büro: 2",
    "yes",
    "a]",
    "#7",
    "{b",
    "3",
)
STYLES = (
    lambda name: yaml.safe_dump([name], default_flow_style=True, allow_unicode=True).strip()[1:-1],
    lambda name: yaml.safe_dump(name, default_style="'", allow_unicode=True).strip(),
    lambda name: yaml.safe_dump(name, default_style='"', allow_unicode=True).strip(),
)
PERSON = """\
@
rooms:  @
@
- name: $  @
  polygon: [[0, 0], [2.6, 0], [2.6, 2], [0, 2]]  @
@

- polygon:  @
  - [2.6, 0]  @
  - [4.9, 0]
  @
  - [4.9, 2]
  - [2.6, 2]
  name: $ @
- {polygon: [[4.9, 0], [7.25, 0], [7.25, 2], [4.9, 2]], name: $, point: [6, 1]}  @
@
points:  @
- name: 'sink'  @
  point: [1.00, 1]
"""
INLINE = """\
@
points: [{name: sink, point: [1, 1]}]  @
@
rooms: [{name: $, polygon: [[0, 0], [2.6, 0], [2.6, 2], [0, 2]]}, @
  {name: $, polygon: [[2.6, 0], [4.9, 0], [4.9, 2], [2.6, 2]]},  @
  {name: $, polygon: [[4.9, 0], [7.25, 0], [7.25, 2], [4.9, 2]]}]  @
"""


@st.composite
def files(draw, forms=(PERSON, INLINE)):
    """A file of three rooms by a person; its text without names, their names, its comments."""
    form = draw(st.sampled_from(forms))
    names = draw(st.lists(st.sampled_from(NAMES), min_size=3, max_size=3, unique=True))
    comments = iter(draw(st.lists(st.sampled_from(["", *COMMENTS]), min_size=20, max_size=20)))
    text = re.sub("@", lambda _: next(comments), form)
    if draw(st.booleans()):
        text = text.replace("\n", "\r\n")
    parts = text.split("$")
    written = [draw(st.sampled_from(STYLES))(name) for name in names]
    whole = "".join(f"{part}{name}" for part, name in zip(parts, [*written, ""], strict=True))
    assert [room["name"] for room in yaml.safe_load(whole)["rooms"]] == names
    return whole, parts


def comments_of(text):
    """Each comment of a file of this module: what begins with one of the known texts."""
    return sorted(
        found
        for line in text.splitlines()
        for found in COMMENTS
        if line.rstrip("\r").endswith(found)
    )


def save(path, rooms):
    hn.save_rooms(path, rooms, GRID)
    again = hn.load_rooms(path, GRID)
    assert again.names == rooms.names
    assert (again.label_of == rooms.label_of).all()
    assert dict(again.points) == dict(rooms.points)
    return replace(again, doors={**again.doors, **rooms.doors})


def squeezed(text):
    """A text without blanks: ruamel.yaml keeps the columns of comments, not what is before them."""
    return re.sub(r"\s", "", text)


@tried(
    60,
    file=files(),
    renames=st.lists(st.tuples(st.integers(0, 2), st.sampled_from(NAMES)), max_size=5),
)
def test_a_new_name_changes_nothing_but_the_name(tmp_path_factory, file, renames):
    text, parts = file
    path = tmp_path_factory.mktemp("names") / "rooms.yaml"
    path.write_bytes(text.encode())
    rooms = save(path, hn.load_rooms(path, GRID))
    person = ".*?".join(re.escape(squeezed(part)) for part in parts)
    for at, name in renames:
        if name not in rooms.names:
            rooms = save(
                path, changed(rooms, Rename(op="rename", room=rooms.names[at], name=name), GRID)
            )
        found = path.read_bytes().decode()
        match = re.match(person, squeezed(found))
        assert match is not None
        written = squeezed(found)[match.end() :]
        assert re.fullmatch(
            r"(doors:#[^[]*(\d+:\[[-0-9.,]*\])*)?cells:rooms\.cells\.png#.*", written
        )
        assert "\n" not in found.replace("\r\n", "") if "\r" in text else "\r" not in found


@st.composite
def changes(draw):
    kind = draw(st.sampled_from(["rename", "merge", "split", "again", "swap"]))
    return kind, draw(st.integers(0, 9)), draw(st.integers(0, 9))


def after(rooms, change):
    """The rooms after a change, the same where it makes no sense."""
    kind, one, other = change
    names = rooms.names
    room, second = names[one % len(names)], names[other % len(names)]
    fresh = next(name for name in NAMES[other:] + NAMES if name not in names)
    try:
        if kind == "rename":
            return changed(rooms, Rename(op="rename", room=room, name=fresh), GRID)
        if kind == "merge":
            return changed(rooms, Merge(op="merge", room=room, other=second), GRID)
        if kind == "split":
            line = [[4.0 + one * 2, 0.0], [4.0 + one * 2, 8.0]]
            return changed(rooms, Split(op="split", room=room, line=line, name=fresh), GRID)
    except hn.errors.InvalidValueError:
        return rooms
    if kind == "swap":
        taken = {room: second, second: room}
        points = {taken.get(name, name): at for name, at in rooms.points.items()}
        return RoomLabels(
            tuple(taken.get(name, name) for name in names), rooms.label_of, points, rooms.doors
        )
    return rooms


@tried(60, file=files(), steps=st.lists(changes(), min_size=1, max_size=6))
def test_comments_survive_whatever_becomes_of_the_rooms(tmp_path_factory, file, steps):
    text, _ = file
    path = tmp_path_factory.mktemp("comments") / "rooms.yaml"
    path.write_bytes(text.encode())
    rooms = hn.load_rooms(path, GRID)
    n_gone = 0
    for step in steps:
        before, rooms = rooms, after(rooms, step)
        n_gone += len(rooms.names) < len(before.names)
        rooms = save(path, rooms)
        found = path.read_bytes().decode()
        assert comments_of(found) == comments_of(text)
        assert len(re.findall(r"# Formerly .*, round", found)) <= n_gone
    once = path.read_bytes()
    save(path, rooms)
    assert path.read_bytes() == once


def test_a_renamed_room_keeps_its_comment_and_leaves_no_line_behind(tmp_path):
    path = tmp_path / "rooms.yaml"
    comment = "# the \"big\" kitchen, it's Bob's"
    path.write_text(
        f"rooms:\n{comment}\n- name: kitchen  {comment}\n"
        "  polygon: [[0, 0], [7, 0], [7, 2], [0, 2]]\n"
    )
    rooms = save(path, hn.load_rooms(path, GRID))
    text = path.read_text()
    for name in ("mess", "galley", "canteen"):
        rooms = save(path, replace(rooms, names=(name,)))
        assert squeezed(path.read_text()) == squeezed(
            text.replace("name: kitchen", f"name: {name}")
        )


def test_a_name_that_a_person_gave_stays_as_a_comment_when_its_room_is_gone(tmp_path):
    path = tmp_path / "rooms.yaml"
    halves = np.zeros(FLOOR.shape, dtype=np.int32)
    halves[:, 11:20], halves[:, 20:] = 1, 2
    save(path, RoomLabels(("kitchen", "room-2", "lab"), halves))
    for n in (8, 9, 10):  # found anew: other cells, other names
        save(path, RoomLabels((f"room-{n}",), np.where(halves == 2, -1, 0)))
        save(path, RoomLabels((f"room-{n + 10}",), np.where(halves == 0, -1, 0)))
    lines = [line for line in path.read_text().splitlines() if "Formerly" in line]
    assert [line.split(",")[0] for line in lines] == ["# Formerly 'kitchen'", "# Formerly 'lab'"]


@pytest.mark.parametrize("line", ["...\n", "# end\n", ""])
def test_the_end_of_a_document_is_no_obstacle(tmp_path, line):
    path = tmp_path / "rooms.yaml"
    square = "[[0, 0], [7, 0], [7, 2], [0, 2]]"
    path.write_text(f"--- # top\nrooms:\n- name: hall  # big\n  polygon: {square}\n{line}")
    save(path, hn.load_rooms(path, GRID))
    assert all(path.read_text().count(words) == 1 for words in ("# top", "# big"))
