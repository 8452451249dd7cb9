"""Sentences of instructions in a language. Public: `words`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.guide.words.language import ENGLISH, GERMAN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.guide.words.instruction import (
        Doorway,
        FloorChange,
        Hand,
        Instruction,
        Landmark,
        Side,
        Space,
        Turn,
        Wall,
    )
    from hybridnav.guide.words.language import HandWords, Language, NameWords, SpaceWords
    from hybridnav.planning import PlanResult

_LANGUAGES = {"de": GERMAN, "en": ENGLISH}
_NOUNS = {
    "lift": ("lift", "elevator"),
    "stairs": ("stair", "steps"),
    "ramp": ("ramp",),
    "floor": ("floor", "level", "storey", "basement", "cellar", "attic", "roof"),
}
"""Words in a name that tell what it names: "west lift" is a lift, "lobby" may be anything."""
_WIDE_M = 2.0
"""Width from which an opening is recognised by it, in metres."""
_FREE_M = 1.5
"""Gap that furniture leaves of an opening, in metres, below which its width misleads."""
_AT_ONCE_M = 0.5
"""Length below which a distance is not written, in metres."""


def languages() -> dict[str, str]:
    """Return the languages that sentences exist in: the name of each by its code.

    Examples
    --------
    >>> from hybridnav.guide.words import languages
    >>> languages()
    {'de': 'Deutsch', 'en': 'English'}
    """
    return {code: language.name for code, language in _LANGUAGES.items()}


def words(result: PlanResult, language: str = "en") -> list[str]:
    """Describe the path of a plan to a person; no lines without a path, and without rooms.

    Parameters
    ----------
    result
        A plan on a map with rooms.
    language
        Code of a language, one of `languages`.

    Returns
    -------
    list of str
        The sentences in order.

    Raises
    ------
    InvalidValueError
        When there are no words in the language.

    Examples
    --------
    >>> grid = hn.example_map("figure1")
    >>> rooms = hn.RoomLabels(("west", "east"), np.indices(grid.shape)[1] // 20)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    >>> hn.words(hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5)))[::2]
    ['start in the west', 'you are at (2, 2.5) in the east']
    """
    return sentences(result.instructions, language)


def check_language(language: str) -> Language:
    """Return the table of a language.

    Parameters
    ----------
    language
        A code such as `"en"`.

    Raises
    ------
    InvalidValueError
        When there are no sentences in this language; the message lists existing ones.

    Examples
    --------
    >>> from hybridnav.guide.words import check_language
    >>> check_language("de").turn_round
    'umkehren'
    """
    table = _LANGUAGES.get(language) if isinstance(language, str) else None
    if table is None:
        codes = ", ".join(f"{code} ({name})" for code, name in languages().items())
        raise InvalidValueError(f"language must be one of {codes}, got {language!r:.80}")
    return table


def sentences(instructions: Sequence[Instruction], language: str = "en") -> list[str]:
    """Write instructions as sentences, one line each.

    Parameters
    ----------
    instructions
        Those of a path or a tour, in order; none make no lines.
    language
        Code of the language, one of `languages`.

    Returns
    -------
    list of str
        The lines. An arrival just behind the door of its room ends the line of that door.

    Raises
    ------
    InvalidValueError
        When there are no sentences in this language.

    Examples
    --------
    >>> from hybridnav.guide.words import Instruction, Space, Turn, sentences
    >>> corridor = Space(None, "corridor")
    >>> sentences([Instruction("turn", (8.0, 0.0), 8.0, 8.0, corridor, turn=Turn(-1.6))])
    ['in the corridor after 8 m turn right']
    """
    writer = _Writer(check_language(language))
    lines: list[str] = []
    before: Instruction | None = None
    for instruction in instructions:
        if _is_there(before, instruction):
            lines[-1] += writer.words.there
        else:
            lines.append(writer.line(instruction))
        before = instruction
    return lines


def _is_there(before: Instruction | None, instruction: Instruction) -> bool:
    """Return whether an arrival needs no line, for it lies just behind the door of its room."""
    return (
        before is not None
        and before.kind == "cross"
        and instruction.kind == "arrive"
        and instruction.after_m < _AT_ONCE_M
        and instruction.waypoint is not None
        and instruction.waypoint == instruction.space.name
    )


class _Writer:
    """Fills in the templates of a language."""

    def __init__(self, words: Language) -> None:
        self.words = words

    def line(self, instruction: Instruction) -> str:
        words, turn, doorway = self.words, instruction.turn, instruction.doorway
        inside, lead = self._space(instruction.space).inside, self._lead(instruction)
        if doorway is not None:
            return self._cross(instruction, doorway, lead)
        if instruction.change is not None:
            return self._ride(instruction.change, turn, lead)
        if instruction.kind == "arrive":
            arrival = self._arrival(instruction).format(
                lead=lead, inside=inside, waypoint=instruction.waypoint
            )
            return arrival + self._at(instruction.landmark)
        if instruction.kind == "turn":
            assert turn is not None  # noqa: S101 - a turn has one
            return words.turn.format(inside=inside, lead=lead, turn=self._turn(turn))
        return self._start(instruction, inside)

    def _start(self, instruction: Instruction, inside: str) -> str:
        """Return the first sentence: what shows the direction, or how to turn."""
        words, turn, landmark = self.words, instruction.turn, instruction.landmark
        if landmark is not None:
            return self._start_at(landmark, inside)
        if instruction.heading_rad is not None:
            eighth = round(instruction.heading_rad / (math.pi / 4)) % 8
            return words.start_heading.format(inside=inside, compass=words.compass[eighth])
        if turn is None:
            return words.start.format(inside=inside)
        return words.start_facing.format(inside=inside, turn=self._face(turn))

    def _start_at(self, landmark: Landmark, inside: str) -> str:
        """Return the first sentence with a landmark that shows the direction."""
        words, named = self.words, self._landmark(landmark)
        if landmark.side == "ahead":
            return words.start_towards.format(inside=inside, landmark=named)
        if landmark.side == "behind":
            return words.start_away.format(inside=inside, landmark=named)
        beside = self._place(landmark.side)
        return words.start_beside.format(inside=inside, landmark=named, beside=beside)

    def _at(self, landmark: Landmark | None) -> str:
        """Return the end of the sentence of an arrival: the landmark where one is."""
        words = self.words
        if landmark is None:
            return ""
        if landmark.side == "ahead":
            return words.at_ahead.format(landmark=self._landmark(landmark))
        if landmark.side == "behind":
            return words.at_behind.format(landmark=self._landmark(landmark))
        beside = self._place(landmark.side)
        return words.at_beside.format(landmark=self._landmark(landmark), beside=beside)

    def _place(self, side: Side) -> str:
        where, _, hand = side.rpartition("-")
        words = self.words.left if hand == "left" else self.words.right
        return {"ahead": words.ahead, "behind": words.behind}.get(where, words.beside)

    def _landmark(self, landmark: Landmark) -> str:
        """Return the words for a door by what lies behind it."""
        words, beyond = self.words, self._space(landmark.beyond)
        template = words.opening_to if landmark.is_opening else words.door_to
        if landmark.beyond.name is None and not landmark.is_opening:
            template = words.door
        return template.format(
            number=landmark.door, itself=beyond.itself, into=beyond.into, beside=""
        )

    def _arrival(self, instruction: Instruction) -> str:
        if instruction.waypoint is None:
            return self.words.arrive_at_goal
        is_room = instruction.waypoint == instruction.space.name
        return self.words.arrive_inside if is_room else self.words.arrive

    def _cross(self, instruction: Instruction, doorway: Doorway, lead: str) -> str:
        words, turn = self.words, instruction.turn
        if turn is not None and not turn.is_sharp and doorway.ordinal is not None:
            doorway, turn = replace(doorway, beside=turn.hand), None
        if doorway.door is None:
            template = words.go_on if turn is None else words.go_on_turning
        elif doorway.is_first:
            template = words.leave if turn is None else words.leave_turning
        else:
            template = words.go if turn is None else words.go_turning
        along = ""
        if doorway.wall is not None:
            template, along = words.go_along, self._along(doorway.wall)
        return template.format(
            lead=lead,
            along=along,
            turn="" if turn is None else self._turn(turn),
            door=self._door(doorway, is_turned=turn is not None),
            into=self._space(doorway.into).into,
            itself=self._space(instruction.space).itself,
            out=self._out(doorway),
        )

    def _along(self, wall: Wall) -> str:
        """Return the words for a walk along a wall, up to the door."""
        words, via = self.words, ""
        if wall.via is not None and wall.via.hand is None:
            via = words.via_nearest.format(nearest=words.nearest[(wall.via.ordinal or 1) - 1])
        elif wall.via is not None:
            past = words.past[wall.via.past] if wall.via.past else ""
            via = words.via.format(
                along=self._side_of(wall.via),
                past=past,
                ordinal=words.ordinals[(wall.via.ordinal or 1) - 1],
            )
        metres = "" if wall.ordinal else words.along_for.format(metres=max(round(wall.length_m), 1))
        return via + self._side_of(wall) + metres + words.past[wall.past]

    def _side_of(self, wall: Wall) -> str:
        hand = self._hand(wall.hand or "left")
        return hand.across if wall.is_opposite else hand.along

    def _ride(self, change: FloorChange, turn: Turn | None, lead: str) -> str:
        words, is_lift = self.words, change.kind == "lift"
        template = words.take_lift if is_lift else words.take_stairs
        out = words.straight_out if change.has_exit else ""
        if turn is not None:
            out = words.out_of_lift if is_lift else words.out_of_stairs
            out = out.format(turn=self._turn(turn))
        of_link: NameWords = getattr(words, change.kind)
        link = _named(change.link, of_link, _NOUNS[change.kind])
        floor = _named(change.floor, words.floor, _NOUNS["floor"])
        return template.format(lead=lead, link=link, floor=floor, out=out)

    def _door(self, doorway: Doorway, *, is_turned: bool) -> str:
        """Return the words for a door: which of those at its hand, or in sight, it is."""
        words, ordinal = self.words, doorway.ordinal
        beside = "" if doorway.beside is None else " " + self._beside(doorway.beside)
        if doorway.is_opening:
            template = words.opening if ordinal is None else words.counted_opening
            if doorway.width_m >= _WIDE_M and doorway.passage_m >= _FREE_M:
                template += words.wide
        else:
            template = words.door if ordinal is None else words.counted_door
        of = words.nearest if doorway.is_seen and not beside else words.ordinals
        return template.format(
            number=doorway.door,
            beside="" if is_turned else beside,
            ordinal="" if ordinal is None else of[ordinal if ordinal < 0 else ordinal - 1],
            width=f"{doorway.width_m:.1f}".replace(".", words.decimal),
        )

    def _beside(self, side: Side) -> str:
        return self.words.ahead if side == "ahead" else self._place(side)

    def _out(self, doorway: Doorway) -> str:
        if doorway.behind is not None:
            return self.words.out_turning.format(turn=self._turn(doorway.behind))
        return "" if doorway.onward is None else self._hand(doorway.onward).onward

    def _lead(self, instruction: Instruction) -> str:
        if instruction.after_m < _AT_ONCE_M:
            return ""
        if instruction.doorway is not None and instruction.doorway.is_seen:
            return ""
        return self.words.after.format(metres=max(round(instruction.after_m), 1))

    def _turn(self, turn: Turn) -> str:
        if turn.is_round:
            return self.words.turn_round
        hand = self._hand(turn.hand)
        if turn.is_slight:
            return hand.slight
        return hand.sharp if turn.is_sharp else hand.turn

    def _face(self, turn: Turn) -> str:
        return self.words.face_round if turn.is_sharp else self._hand(turn.hand).face

    def _hand(self, hand: Hand) -> HandWords:
        return self.words.left if hand == "left" else self.words.right

    def _space(self, space: Space) -> SpaceWords:
        if space.name is None:
            return getattr(self.words, space.shape)
        if space.shape != "room":
            shape: SpaceWords = getattr(self.words, space.shape)
            texts = {part: f"{text} {space.name}" for part, text in vars(shape).items()}
            return type(shape)(**texts)
        named = self.words.common if _is_common(space.name) else self.words.named
        return type(named)(
            inside=named.inside.format(name=space.name),
            into=named.into.format(name=space.name),
            itself=named.itself.format(name=space.name),
        )


def _named(name: str, words: NameWords, nouns: Sequence[str]) -> str:
    """Return the words for a link or a floor."""
    template = words.plain
    if any(noun in name.casefold() for noun in nouns):
        template = words.common if _is_common(name) else words.titled
    return template.format(name=name)


def _is_common(name: str) -> bool:
    """Return whether a name reads as a common noun, as `kitchen` and `meeting room` do."""
    return all(word.isalpha() and word.islower() for word in name.split(" "))
