"""The table that a language fills in."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SpaceWords:
    """A space in three places of a sentence."""

    inside: str
    """For a person in it: `in {name}`."""
    into: str
    """For a person who enters it: `into {name}`."""
    itself: str
    """As the thing that one leaves: `{name}`."""


@dataclass(frozen=True, kw_only=True)
class HandWords:
    """The words for one hand, left or right."""

    turn: str
    """A turn of a path: `turn left`."""
    sharp: str
    """A turn by more than 135 degrees."""
    slight: str
    """A turn by less than 55 degrees: `bear left`."""
    face: str
    """A turn on the spot before the first step."""
    beside: str
    """The place of a door: `on the left`."""
    ahead: str
    """The place of a door ahead, at this hand: `ahead on the left`."""
    behind: str
    """The place of a door behind, at this hand."""
    onward: str
    """Behind a door to this hand: ` to the left`."""


@dataclass(frozen=True, kw_only=True)
class NameWords:
    """A link or a floor by its name, `{name}`, which may have a noun for it or not."""

    common: str
    """A name in small letters with such a noun: `the west lift`, `the basement`."""
    titled: str
    """Another name with such a noun: `Lift A`, `Level 2`."""
    plain: str
    """A name without: `lift A`, `floor 2`."""


@dataclass(frozen=True, kw_only=True)
class Language:
    """Templates of all sentences in one language.

    A translation is one module with such a table, and a line in `hybridnav.planner.guide.write`.
    Parts in braces are filled in; `{lead}` ends in a blank unless it is empty.

    Examples
    --------
    >>> from hybridnav.planner.guide.english import ENGLISH
    >>> ENGLISH.turn
    '{inside} {lead}{turn}'
    """

    name: str
    """Its name, for people who choose it."""
    decimal: str
    """Decimal mark."""
    numbers: tuple[str, ...]
    """Words for 2, 3, ...; larger numbers are digits."""
    named: SpaceWords
    """A room with a name; `{name}` stands for it."""
    common: SpaceWords
    """A room whose name is a common noun, in small letters."""
    corridor: SpaceWords
    hall: SpaceWords
    room: SpaceWords
    passage: SpaceWords
    storey: SpaceWords
    """A floor whose map has no rooms."""
    left: HandWords
    right: HandWords
    turn_round: str
    """A turn back."""
    face_round: str
    """A turn back before the first step."""
    start: str
    """First sentence; `{inside}`."""
    start_facing: str
    """First sentence of a robot with a heading; `{inside}`, `{turn}`."""
    start_beside: str
    """First sentence with a landmark at one hand; `{inside}`, `{landmark}`, `{beside}`."""
    start_heading: str
    """First sentence without a landmark; `{inside}`, `{compass}`."""
    compass: tuple[str, ...]
    """Words for east, north-east, north, ..., counter-clockwise."""
    start_towards: str
    """First sentence with a landmark ahead; `{inside}`, `{landmark}`."""
    start_away: str
    """First sentence with a landmark behind; `{inside}`, `{landmark}`."""
    door_to: str
    """A door as a landmark; `{number}`, `{itself}`, `{into}`."""
    opening_to: str
    """An opening as a landmark; `{number}`, `{itself}`, `{into}`."""
    after: str
    """A distance without landmarks; `{metres}`."""
    after_passing: str
    """A distance with landmarks; `{metres}`, `{passed}`."""
    passed_beside: str
    """Landmarks at one hand; `{things}`, `{beside}`."""
    passed_both: str
    """The same landmarks at each hand; `{things}`."""
    one_door: str
    """One door that is passed."""
    doors: str
    """Several; `{count}`."""
    one_opening: str
    openings: str
    joint: str
    """What stands between two items, with its spaces."""
    turn: str
    """A turn; `{inside}`, `{lead}`, `{turn}`."""
    go: str
    """Through a door; `{lead}`, `{door}`, `{into}`, `{out}`."""
    go_turning: str
    """The same with `{turn}` before it."""
    leave: str
    """Out of the first space; besides `{itself}`."""
    leave_turning: str
    """The same with `{turn}` before it."""
    go_on: str
    """Into a space without a door between; `{lead}`, `{into}`, `{out}`."""
    go_on_turning: str
    """The same with `{turn}` before it."""
    door: str
    """A door; `{number}`."""
    door_beside: str
    """A door at one hand; `{number}`, `{beside}`."""
    opening: str
    """A wide opening; `{number}`, `{width}`."""
    narrow_opening: str
    """An opening as wide as a door, but without jambs; `{number}`."""
    opening_beside: str
    """A wide opening at one hand; `{number}`, `{beside}`, `{width}`."""
    narrow_opening_beside: str
    """A narrow one at one hand; `{number}`, `{beside}`."""
    out_turning: str
    """End of a sentence with a turn behind a door; `{turn}`."""
    lift: NameWords
    stairs: NameWords
    ramp: NameWords
    floor: NameWords
    take_lift: str
    """By a lift to another floor; `{lead}`, `{link}`, `{floor}`, `{out}`."""
    take_stairs: str
    """By stairs or a ramp; likewise."""
    out_of_lift: str
    """The turn out of a lift; `{turn}`."""
    out_of_stairs: str
    """The turn behind stairs or a ramp; `{turn}`."""
    straight_out: str
    """Straight on behind any of them."""
    arrive: str
    """At a waypoint; `{lead}`, `{waypoint}`, `{inside}`."""
    at_beside: str
    """End of an arrival near a door at one hand; `{landmark}`, `{beside}`."""
    at_ahead: str
    """The same with a door ahead; `{landmark}`."""
    at_behind: str
    """The same with a door behind; `{landmark}`."""
    arrive_at_goal: str
    """At a goal without a name; `{lead}`, `{inside}`."""
    arrive_inside: str
    """In the room that is the waypoint, some way behind its door; `{lead}`, `{inside}`."""
    there: str
    """End of the sentence whose door leads to the waypoint."""
