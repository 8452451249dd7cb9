"""The table that a language fills in, and the sentences in English and in German."""

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
    along: str
    """Along the wall at this hand: `keep to the wall on the left`."""
    across: str
    """To the wall opposite, and along it to this hand."""


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

    A translation is one module with such a table, and a line in `hybridnav.guide.words.write`.
    Parts in braces are filled in; `{lead}` ends in a blank unless it is empty.

    Examples
    --------
    >>> from hybridnav.guide.words.language import ENGLISH
    >>> ENGLISH.turn
    '{inside} {lead}{turn}'
    """

    name: str
    """Its name, for people who choose it."""
    decimal: str
    """Decimal mark."""
    ordinals: tuple[str, ...]
    """Words for first to fifth, and for last."""
    nearest: tuple[str, ...]
    """Words for the nearest door in sight, and the next ones, of a person who knows no hands."""
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
    ahead: str
    """The place of a door straight ahead."""
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
    """An opening as a landmark; `{itself}`, `{into}`."""
    after: str
    """A distance without landmarks; `{metres}`."""
    turn: str
    """A turn; `{inside}`, `{lead}`, `{turn}`."""
    go: str
    """Through a door; `{lead}`, `{door}`, `{into}`, `{out}`."""
    go_turning: str
    """The same with `{turn}` before it."""
    go_along: str
    """Through a door in a wall that one follows; besides `{along}`."""
    past: tuple[str, ...]
    """The end of `{along}`: none, one, two or three openings that one passes."""
    along_for: str
    """What follows `{along}` where nobody counts; `{metres}`."""
    via: str
    """What begins `{along}` where one goes to another door first; `{along}`, `{past}`,
    `{ordinal}`."""
    via_nearest: str
    """The same at the start; `{nearest}`."""
    leave: str
    """Out of the first space; besides `{itself}`."""
    leave_turning: str
    """The same with `{turn}` before it."""
    go_on: str
    """Into a space without a door between; `{lead}`, `{into}`, `{out}`."""
    go_on_turning: str
    """The same with `{turn}` before it."""
    door: str
    """A door; `{number}`, and `{beside}`: empty, or a blank and where it lies."""
    counted_door: str
    """One of several doors; besides `{ordinal}`."""
    opening: str
    """An opening as wide as a door, but without jambs; `{beside}`."""
    counted_opening: str
    """One of several; besides `{ordinal}`."""
    wide: str
    """Addition to a wide opening; `{width}`."""
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


# The sentences in English.

ENGLISH = Language(
    name="English",
    decimal=".",
    ordinals=("first", "second", "third", "fourth", "fifth", "last"),
    nearest=("nearest", "second nearest", "third nearest"),
    named=SpaceWords(inside="in {name}", into="into {name}", itself="{name}"),
    common=SpaceWords(inside="in the {name}", into="into the {name}", itself="the {name}"),
    corridor=SpaceWords(inside="in the corridor", into="into the corridor", itself="the corridor"),
    hall=SpaceWords(inside="in the hall", into="into the hall", itself="the hall"),
    room=SpaceWords(inside="in the room", into="into the room", itself="the room"),
    passage=SpaceWords(inside="in the passage", into="into the passage", itself="the passage"),
    storey=SpaceWords(inside="on this floor", into="onto this floor", itself="this floor"),
    left=HandWords(
        turn="turn left",
        sharp="turn sharply left",
        slight="bear left",
        face="face left",
        beside="on the left",
        ahead="ahead on the left",
        behind="behind you on the left",
        onward=", then left",
        along="keep to the wall on the left",
        across="go straight across to the opposite wall, turn left along it",
    ),
    right=HandWords(
        turn="turn right",
        sharp="turn sharply right",
        slight="bear right",
        face="face right",
        beside="on the right",
        ahead="ahead on the right",
        behind="behind you on the right",
        onward=", then right",
        along="keep to the wall on the right",
        across="go straight across to the opposite wall, turn right along it",
    ),
    ahead="straight ahead",
    turn_round="turn round",
    face_round="turn round",
    start="start {inside}",
    start_facing="start {inside} and {turn}",
    start_beside="start {inside} with {landmark} {beside}",
    start_heading="start {inside} heading {compass}",
    compass=(
        *("east", "north-east", "north", "north-west"),
        *("west", "south-west", "south", "south-east"),
    ),
    start_towards="start {inside} towards {landmark}",
    start_away="start {inside} with {landmark} behind you",
    door_to="door {number} to {itself}",
    opening_to="the opening to {itself}",
    after="after {metres} m ",
    turn="{inside} {lead}{turn}",
    go="{lead}go through {door} {into}{out}",
    go_turning="{lead}{turn} through {door} {into}{out}",
    go_along="{along} go through {door} {into}{out}",
    past=(
        " and",
        ", past the opening, and behind it",
        ", past two openings, and behind them",
        ", past three openings, and behind them",
    ),
    along_for=" for about {metres} m",
    via="{along}{past} to the {ordinal} door, and with your back to it ",
    via_nearest="go to the {nearest} door, and with your back to it ",
    leave="{lead}leave {itself} by {door} {into}{out}",
    leave_turning="{lead}{turn} and leave {itself} by {door} {into}{out}",
    go_on="{lead}go on {into}{out}",
    go_on_turning="{lead}{turn} {into}{out}",
    door="door {number}{beside}",
    counted_door="the {ordinal} door{beside} (door {number})",
    opening="the opening{beside}",
    counted_opening="the {ordinal} opening{beside}",
    wide=" ({width} m wide)",
    out_turning=" and {turn}",
    lift=NameWords(common="the {name}", titled="{name}", plain="lift {name}"),
    stairs=NameWords(common="the {name}", titled="{name}", plain="stairs {name}"),
    ramp=NameWords(common="the {name}", titled="{name}", plain="ramp {name}"),
    floor=NameWords(common="the {name}", titled="{name}", plain="floor {name}"),
    take_lift="{lead}take {link} to {floor}{out}",
    take_stairs="{lead}take {link} to {floor}{out}",
    out_of_lift=", {turn} out of it",
    out_of_stairs=", then {turn}",
    straight_out=", go straight on",
    arrive="{lead}you are at {waypoint} {inside}",
    at_beside=", with {landmark} {beside}",
    at_ahead=", with {landmark} ahead",
    at_behind=", with {landmark} behind you",
    arrive_at_goal="{lead}you are at the goal {inside}",
    arrive_inside="{lead}you are there",
    there=", and you are there",
)


# The sentences in German.

_NAMED = SpaceWords(inside="in „{name}“", into="in „{name}“", itself="„{name}“")
"""A name keeps no article: its gender is not known."""


def _always(words: str) -> NameWords:
    return NameWords(common=words, titled=words, plain=words)


GERMAN = Language(
    name="Deutsch",
    decimal=",",
    ordinals=("erste", "zweite", "dritte", "vierte", "fünfte", "letzte"),
    nearest=("nächstgelegene", "zweitnächste", "drittnächste"),
    named=_NAMED,
    common=_NAMED,
    corridor=SpaceWords(inside="im Flur", into="in den Flur", itself="den Flur"),
    hall=SpaceWords(inside="in der Halle", into="in die Halle", itself="die Halle"),
    room=SpaceWords(inside="im Raum", into="in den Raum", itself="den Raum"),
    passage=SpaceWords(inside="im Durchgang", into="in den Durchgang", itself="den Durchgang"),
    storey=SpaceWords(inside="auf dieser Etage", into="auf diese Etage", itself="diese Etage"),
    left=HandWords(
        turn="links abbiegen",
        sharp="scharf links abbiegen",
        slight="halb links halten",
        face="nach links drehen",
        beside="links",
        ahead="links voraus",
        behind="links hinten",
        onward=", dann nach links",
        along="an der linken Wand entlang",
        across="geradeaus zur Wand gegenüber, dort nach links an ihr entlang",
    ),
    right=HandWords(
        turn="rechts abbiegen",
        sharp="scharf rechts abbiegen",
        slight="halb rechts halten",
        face="nach rechts drehen",
        beside="rechts",
        ahead="rechts voraus",
        behind="rechts hinten",
        onward=", dann nach rechts",
        along="an der rechten Wand entlang",
        across="geradeaus zur Wand gegenüber, dort nach rechts an ihr entlang",
    ),
    ahead="geradeaus",
    turn_round="umkehren",
    face_round="umdrehen",
    start="Start {inside}",
    start_facing="Start {inside}: {turn}",
    start_beside="Start {inside}, {landmark} {beside}",
    start_heading="Start {inside} in Richtung {compass}",
    compass=(
        *("Osten", "Nordosten", "Norden", "Nordwesten"),
        *("Westen", "Südwesten", "Süden", "Südosten"),
    ),
    start_towards="Start {inside} auf {landmark} zu",
    start_away="Start {inside}, {landmark} im Rücken",
    door_to="Tür {number} {into}",
    opening_to="die Öffnung {into}",
    after="nach {metres} m ",
    turn="{inside} {lead}{turn}",
    go="{lead}durch {door} {into} gehen{out}",
    go_turning="{lead}{turn} und durch {door} {into} gehen{out}",
    go_along="{along} durch {door} {into} gehen{out}",
    past=(
        " und",
        ", an der Öffnung vorbei und dahinter",
        ", an zwei Öffnungen vorbei und dahinter",
        ", an drei Öffnungen vorbei und dahinter",
    ),
    along_for=", etwa {metres} m weit,",
    via="{along}{past} bis zur {ordinal}n Tür, dann mit ihr im Rücken ",
    via_nearest="zur {nearest}n Tür gehen, dann mit ihr im Rücken ",
    leave="{lead}{itself} durch {door} verlassen und {into} gehen{out}",
    leave_turning="{lead}{turn}, {itself} durch {door} verlassen und {into} gehen{out}",
    go_on="{lead}weiter {into} gehen{out}",
    go_on_turning="{lead}{turn} und weiter {into} gehen{out}",
    door="Tür {number}{beside}",
    counted_door="die {ordinal} Tür{beside} (Tür {number})",
    opening="die Öffnung{beside}",
    counted_opening="die {ordinal} Öffnung{beside}",
    wide=" ({width} m breit)",
    out_turning=", dann {turn}",
    lift=_always("dem Aufzug „{name}“"),
    stairs=_always("die Treppe „{name}“"),
    ramp=_always("die Rampe „{name}“"),
    floor=NameWords(common="Etage „{name}“", titled="Etage „{name}“", plain="Etage {name}"),
    take_lift="{lead}mit {link} auf {floor} fahren{out}",
    take_stairs="{lead}über {link} auf {floor} gehen{out}",
    out_of_lift=", beim Aussteigen {turn}",
    out_of_stairs=", dann {turn}",
    straight_out=", dann geradeaus",
    arrive="{lead}am Ziel: {waypoint} {inside}",
    at_beside=", {landmark} {beside}",
    at_ahead=", {landmark} voraus",
    at_behind=", {landmark} im Rücken",
    arrive_at_goal="{lead}am Ziel {inside}",
    arrive_inside="{inside} {lead}am Ziel",
    there=", und Sie sind am Ziel",
)
