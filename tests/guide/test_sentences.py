"""Sentences: one table a language, and no geometry."""

import itertools
import math
import re
from dataclasses import fields
from typing import get_args

import pytest

import hybridnav as hn
from hybridnav.guide.words import (
    Doorway,
    FloorChange,
    Instruction,
    Landmark,
    Space,
    Turn,
    Wall,
    check_language,
    languages,
    sentences,
)
from hybridnav.guide.words.instruction import Hand, Side

KITCHEN, CORRIDOR, LAB = Space("kitchen"), Space(None, "corridor"), Space("l3_404")
AT = (1.0, 2.0)


def instruction(kind="turn", after_m=8.0, space=CORRIDOR, **what):
    return Instruction(kind, AT, 20.0, after_m, space, **what)


TURN, BACK, SHARP = Turn(-1.5), Turn(math.pi), Turn(2.5)
CASES = {
    "start": (instruction("start", 0.0, KITCHEN), "start in the kitchen", "Start in „kitchen“"),
    "start facing": (
        instruction("start", 0.0, LAB, turn=TURN),
        "start in l3_404 and face right",
        "Start in „l3_404“: nach rechts drehen",
    ),
    "turn": (
        instruction(turn=TURN),
        "in the corridor after 8 m turn right",
        "im Flur nach 8 m rechts abbiegen",
    ),
    "back": (instruction(after_m=0.2, turn=BACK), "in the corridor turn round", "im Flur umkehren"),
    "sharp": (
        instruction(after_m=12.4, turn=SHARP),
        "in the corridor after 12 m turn sharply left",
        "im Flur nach 12 m scharf links abbiegen",
    ),
    "one of several doors": (
        instruction("cross", turn=TURN, doorway=Doorway(LAB, 7, 0.9, ordinal=3)),
        "after 8 m go through the third door on the right (door 7) into l3_404",
        "nach 8 m durch die dritte Tür rechts (Tür 7) in „l3_404“ gehen",
    ),
    "the last opening": (
        instruction(
            "cross", doorway=Doorway(LAB, 7, 2.6, is_opening=True, beside="left", ordinal=-1)
        ),
        "after 8 m go through the last opening on the left (2.6 m wide) into l3_404",
        "nach 8 m durch die letzte Öffnung links (2,6 m breit) in „l3_404“ gehen",
    ),
    "a door in sight": (
        instruction("cross", doorway=Doorway(LAB, 7, 0.9, beside="ahead-left", is_seen=True)),
        "go through door 7 ahead on the left into l3_404",
        "durch Tür 7 links voraus in „l3_404“ gehen",
    ),
    "straight ahead": (
        instruction("cross", doorway=Doorway(LAB, 7, 0.9, beside="ahead", is_seen=True)),
        "go through door 7 straight ahead into l3_404",
        "durch Tür 7 geradeaus in „l3_404“ gehen",
    ),
    "the nearest door": (
        instruction("cross", doorway=Doorway(LAB, 7, 0.9, ordinal=1, is_seen=True, is_first=True)),
        "leave the corridor by the nearest door (door 7) into l3_404",
        "den Flur durch die nächstgelegene Tür (Tür 7) verlassen und in „l3_404“ gehen",
    ),
    "leave": (
        instruction(
            "cross", 3.6, KITCHEN, doorway=Doorway(CORRIDOR, 13, 1.0, is_first=True, onward="left")
        ),
        "after 4 m leave the kitchen by door 13 into the corridor, then left",
        "nach 4 m „kitchen“ durch Tür 13 verlassen und in den Flur gehen, dann nach links",
    ),
    "door": (
        instruction("cross", doorway=Doorway(LAB, 7, 0.9, beside="right", behind=Turn(1.5))),
        "after 8 m go through door 7 on the right into l3_404 and turn left",
        "nach 8 m durch Tür 7 rechts in „l3_404“ gehen, dann links abbiegen",
    ),
    "into a door": (
        instruction("cross", turn=TURN, doorway=Doorway(KITCHEN, 7, 0.9)),
        "after 8 m turn right through door 7 into the kitchen",
        "nach 8 m rechts abbiegen und durch Tür 7 in „kitchen“ gehen",
    ),
    "opening": (
        instruction("cross", doorway=Doorway(Space(None, "hall"), 78, 7.46, is_opening=True)),
        "after 8 m go through the opening (7.5 m wide) into the hall",
        "nach 8 m durch die Öffnung (7,5 m breit) in die Halle gehen",
    ),
    "opening beside": (
        instruction(
            "cross", doorway=Doorway(LAB, 78, 7.46, is_opening=True, beside="right", onward="left")
        ),
        "after 8 m go through the opening on the right (7.5 m wide) into l3_404, then left",
        "nach 8 m durch die Öffnung rechts (7,5 m breit) in „l3_404“ gehen, dann nach links",
    ),
    "narrow opening beside": (
        instruction("cross", doorway=Doorway(LAB, 78, 1.2, is_opening=True, beside="left")),
        "after 8 m go through the opening on the left into l3_404",
        "nach 8 m durch die Öffnung links in „l3_404“ gehen",
    ),
    "opening between furniture": (
        instruction("cross", doorway=Doorway(LAB, 78, 7.46, 1.1, is_opening=True)),
        "after 8 m go through the opening into l3_404",
        "nach 8 m durch die Öffnung in „l3_404“ gehen",
    ),
    "start with a door aside": (
        instruction("start", 0.0, KITCHEN, landmark=Landmark(3, LAB, "ahead-left")),
        "start in the kitchen with door 3 to l3_404 ahead on the left",
        "Start in „kitchen“, Tür 3 in „l3_404“ links voraus",
    ),
    "start by the compass": (
        instruction("start", 0.0, KITCHEN, heading_rad=-2.2),
        "start in the kitchen heading south-west",
        "Start in „kitchen“ in Richtung Südwesten",
    ),
    "goal with a door behind": (
        instruction(
            "arrive", 3.0, KITCHEN, waypoint="sink", landmark=Landmark(3, LAB, "behind-right")
        ),
        "after 3 m you are at sink in the kitchen, with door 3 to l3_404 behind you on the right",
        "nach 3 m am Ziel: sink in „kitchen“, Tür 3 in „l3_404“ rechts hinten",
    ),
    "no door": (
        instruction("cross", doorway=Doorway(Space(None, "room"))),
        "after 8 m go on into the room",
        "nach 8 m weiter in den Raum gehen",
    ),
    "point": (
        instruction("arrive", 3.0, Space(None, "passage"), waypoint="(1, 2)"),
        "after 3 m you are at (1, 2) in the passage",
        "nach 3 m am Ziel: (1, 2) im Durchgang",
    ),
    "goal": (
        instruction("arrive", 0.7, LAB),
        "after 1 m you are at the goal in l3_404",
        "nach 1 m am Ziel in „l3_404“",
    ),
    "lift": (
        instruction(
            "ride", 3.0, turn=Turn(1.5), change=FloorChange("west lift", "lift", "3", has_exit=True)
        ),
        "after 3 m take the west lift to floor 3, turn left out of it",
        "nach 3 m mit dem Aufzug „west lift“ auf Etage 3 fahren, beim Aussteigen links abbiegen",
    ),
    "lift with a letter": (
        instruction("ride", 3.0, change=FloorChange("A", "lift", "Level 2", has_exit=True)),
        "after 3 m take lift A to Level 2, go straight on",
        "nach 3 m mit dem Aufzug „A“ auf Etage „Level 2“ fahren, dann geradeaus",
    ),
    "stairs": (
        instruction(
            "ride",
            3.0,
            turn=TURN,
            change=FloorChange("Stairs 4", "stairs", "basement", has_exit=True),
        ),
        "after 3 m take Stairs 4 to the basement, then turn right",
        "nach 3 m über die Treppe „Stairs 4“ auf Etage „basement“ gehen, dann rechts abbiegen",
    ),
    "ramp": (
        instruction("ride", 3.0, change=FloorChange("garden ramp", "ramp", "G")),
        "after 3 m take the garden ramp to floor G",
        "nach 3 m über die Rampe „garden ramp“ auf Etage G gehen",
    ),
    "floor without rooms": (
        instruction("arrive", 3.0, Space(None, "storey"), waypoint="(1, 2)"),
        "after 3 m you are at (1, 2) on this floor",
        "nach 3 m am Ziel: (1, 2) auf dieser Etage",
    ),
    "along a wall": (
        instruction("cross", 9.0, KITCHEN, doorway=Doorway(LAB, 7, 0.9, wall=Wall("left", None))),
        "keep to the wall on the left for about 1 m and go through door 7 into l3_404",
        "an der linken Wand entlang, etwa 1 m weit, und durch Tür 7 in „l3_404“ gehen",
    ),
    "past openings to a door, and across": (
        instruction(
            "cross",
            9.0,
            KITCHEN,
            doorway=Doorway(
                *(LAB, 7, 0.9),
                ordinal=3,
                wall=Wall("right", 3, is_opposite=True, via=Wall("left", 2, 1)),
            ),
        ),
        (
            "keep to the wall on the left, past the opening, and behind it to the second door, and "
            "with your back to it go straight across to the opposite wall, turn right along it and "
            "go through the third door (door 7) into l3_404"
        ),
        (
            "an der linken Wand entlang, an der Öffnung vorbei und dahinter bis zur zweiten Tür, "
            "dann mit ihr im Rücken geradeaus zur Wand gegenüber, dort nach rechts an ihr entlang "
            "und durch die dritte Tür (Tür 7) in „l3_404“ gehen"
        ),
    ),
    "from the nearest door": (
        instruction(
            "cross",
            9.0,
            KITCHEN,
            doorway=Doorway(*(LAB, 7, 0.9), ordinal=1, wall=Wall("left", 1, via=Wall(None, 1))),
        ),
        (
            "go to the nearest door, and with your back to it keep to the wall on the left and go "
            "through the first door (door 7) into l3_404"
        ),
        (
            "zur nächstgelegenen Tür gehen, dann mit ihr im Rücken an der linken Wand entlang und "
            "durch die erste Tür (Tür 7) in „l3_404“ gehen"
        ),
    ),
    "deep in the room": (
        instruction("arrive", 3.0, LAB, waypoint="l3_404"),
        "after 3 m you are there",
        "in „l3_404“ nach 3 m am Ziel",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_an_instruction_in_both_languages(name):
    given, english, german = CASES[name]
    assert sentences([given]) == sentences([given], "en") == [english]
    assert sentences([given], language="de") == [german]


def test_an_arrival_behind_the_door_of_the_room_needs_no_line():
    door = instruction("cross", doorway=Doorway(KITCHEN, 7, 0.9))
    there = instruction("arrive", 0.2, KITCHEN, waypoint="kitchen")
    assert sentences([door, there]) == [
        "after 8 m go through door 7 into the kitchen, and you are there"
    ]
    assert sentences([door, there], "de")[0].endswith(", und Sie sind am Ziel")
    elsewhere = instruction("arrive", 0.2, KITCHEN, waypoint="sink")
    assert sentences([door, elsewhere])[1] == "you are at sink in the kitchen"


@pytest.mark.parametrize("given", ["fr", "EN", "", "english", None, 7, "x" * 500])
def test_an_unknown_language_is_refused_in_one_line(given):
    with pytest.raises(hn.errors.InvalidValueError) as refused:
        sentences([], given)
    assert str(refused.value).startswith("language must be one of de (Deutsch), en (English), got ")
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 160


@pytest.mark.parametrize("code", languages())
def test_every_template_is_used_and_filled(code):
    """Whatever occurs: no brace is left, no blank is doubled, and no template is idle."""
    turns = [None, Turn(1.5), Turn(0.8), Turn(-0.8), TURN, SHARP, Turn(-2.5), BACK]
    spaces = [
        KITCHEN,
        LAB,
        *(Space(None, shape) for shape in ("corridor", "hall", "room", "passage", "storey")),
    ]
    doors = [(None, False), (3, False), (3, True)]
    written: list[str] = []
    for turn, space, (door, is_opening) in itertools.product(turns, spaces, doors):
        cases: tuple[tuple[bool, Hand | None, int | None], ...] = (
            (False, None, None),
            (True, "left", 2),
            (True, "right", -1),
        )
        for is_first, beside, ordinal in cases:
            doorway = Doorway(
                space,
                door,
                3.0,
                is_opening=is_opening,
                is_first=is_first,
                beside=beside,
                ordinal=ordinal,
                behind=turn if is_first else None,
                onward=beside if turn is None else None,
            )
            written += sentences(
                [
                    instruction("start", 0.0, space, turn=turn),
                    instruction("start", 0.0, space, heading_rad=1.5),
                    instruction("cross", 9.0, space, turn=turn, doorway=doorway),
                    instruction("arrive", 0.0, space, waypoint=space.name),
                    instruction("arrive", 5.0, space, waypoint="sink"),
                    instruction("arrive", 5.0, space),
                ],
                code,
            )
            for side in get_args(Side):
                seen = Landmark(4, space, side, is_opening=is_opening)
                written += sentences([instruction("start", 0.0, space, landmark=seen)], code)
                there = instruction("arrive", 5.0, space, waypoint="sink", landmark=seen)
                written += sentences([there], code)
            if turn is not None:
                written += sentences([instruction(turn=turn, space=space)], code)
    written += [sentences([given], code)[0] for given, *_ in CASES.values()]
    text = "\n".join(written)
    assert "{" not in text
    assert "  " not in text
    assert not re.search(r" [,.]|\s$", text, re.MULTILINE)
    words = check_language(code)
    for field in fields(words):
        value = getattr(words, field.name)
        if isinstance(value, str) and field.name not in {"name", "decimal"}:
            fixed = [part for part in re.split(r"\{\w+\}", value) if part.strip()]
            assert all(part.strip() in text for part in fixed), field.name


def test_a_narrow_opening_has_no_width_to_recognise_it_by():
    for width_m, text in ((1.2, "the opening"), (2.4, "the opening (2.4 m wide)")):
        doorway = Doorway(LAB, 9, width_m, is_opening=True)
        assert (
            f"go through {text} into l3_404"
            in sentences([instruction("cross", doorway=doorway)])[0]
        )


def test_a_landmark_shows_the_direction_at_the_start():
    cases: tuple[tuple[str, Space, Side], ...] = (
        ("en", KITCHEN, "left"),
        ("en", LAB, "ahead"),
        ("en", Space(None), "behind"),
        ("de", LAB, "right"),
    )
    told = [
        sentences([instruction("start", 0.0, landmark=Landmark(4, space, side))], code)[0]
        for code, space, side in cases
    ]
    assert told == [
        "start in the corridor with door 4 to the kitchen on the left",
        "start in the corridor towards door 4 to l3_404",
        "start in the corridor with door 4 behind you",
        "Start im Flur, Tür 4 in „l3_404“ rechts",
    ]


def test_a_landmark_shows_where_the_goal_lies():
    cases: tuple[tuple[str, Side], ...] = (("en", "right"), ("en", "ahead"), ("de", "behind"))
    told = [
        sentences(
            [instruction("arrive", waypoint="(1, 2)", landmark=Landmark(4, LAB, side))], code
        )[0]
        for code, side in cases
    ]
    assert told == [
        "after 8 m you are at (1, 2) in the corridor, with door 4 to l3_404 on the right",
        "after 8 m you are at (1, 2) in the corridor, with door 4 to l3_404 ahead",
        "nach 8 m am Ziel: (1, 2) im Flur, Tür 4 in „l3_404“ im Rücken",
    ]
