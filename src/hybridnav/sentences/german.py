"""The sentences in German."""

from hybridnav.sentences.language import HandWords, Language, SpaceWords

_NAMED = SpaceWords(inside="in „{name}“", into="in „{name}“", itself="„{name}“")
"""A name keeps no article: its gender is not known."""

GERMAN = Language(
    name="Deutsch",
    decimal=",",
    numbers=(
        *("zwei", "drei", "vier", "fünf", "sechs", "sieben"),
        *("acht", "neun", "zehn", "elf", "zwölf"),
    ),
    named=_NAMED,
    common=_NAMED,
    corridor=SpaceWords(inside="im Flur", into="in den Flur", itself="den Flur"),
    hall=SpaceWords(inside="in der Halle", into="in die Halle", itself="die Halle"),
    room=SpaceWords(inside="im Raum", into="in den Raum", itself="den Raum"),
    passage=SpaceWords(inside="im Durchgang", into="in den Durchgang", itself="den Durchgang"),
    left=HandWords(
        turn="links abbiegen",
        sharp="scharf links abbiegen",
        face="nach links drehen",
        beside="links",
        onward=", dann nach links",
    ),
    right=HandWords(
        turn="rechts abbiegen",
        sharp="scharf rechts abbiegen",
        face="nach rechts drehen",
        beside="rechts",
        onward=", dann nach rechts",
    ),
    turn_round="umkehren",
    face_round="umdrehen",
    start="Start {inside}",
    start_facing="Start {inside}: {turn}",
    after="nach {metres} m ",
    after_passing="nach {metres} m, vorbei an {passed}, ",
    passed_beside="{things} {beside}",
    passed_both="{things} auf jeder Seite",
    one_door="einer Tür",
    doors="{count} Türen",
    one_opening="einer Öffnung",
    openings="{count} Öffnungen",
    joint=" und ",
    turn="{inside} {lead}{turn}",
    go="{lead}durch {door} {into} gehen{out}",
    go_turning="{lead}{turn} und durch {door} {into} gehen{out}",
    leave="{lead}{itself} durch {door} verlassen und {into} gehen{out}",
    leave_turning="{lead}{turn}, {itself} durch {door} verlassen und {into} gehen{out}",
    go_on="{lead}weiter {into} gehen{out}",
    go_on_turning="{lead}{turn} und weiter {into} gehen{out}",
    door="Tür {number}",
    door_beside="Tür {number} ({beside})",
    opening="Öffnung {number} ({width} m breit)",
    out_turning=", dann {turn}",
    arrive="{lead}am Ziel: {waypoint} {inside}",
    arrive_at_goal="{lead}am Ziel {inside}",
    arrive_inside="{inside} {lead}am Ziel",
    there=", und Sie sind am Ziel",
)
