"""Names and numbers as people write them: checks, and what they may have meant."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Sequence

from hybridnav.errors import InvalidValueError, brief

MAX_NAME = 80
"""Characters of a name at most."""
MAX_NUMBER = 1_000_000_000
"""Number of a door at most."""


_DOOR = re.compile(r"(door|tur|tuer) ?[0-9]+")
"""What sentences call doors, folded: "door 4", and "Tür 4"."""


def read_point(text: str) -> tuple[float, ...] | None:
    """Return the numbers of a text like `1,2` or `1,2,0.5`; None for a name."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return numbers if len(numbers) in {2, 3} else None


def check_names(names: tuple[str, ...]) -> None:
    """Refuse names that are empty, too long, not one printable line, a point's or a door's, or
    given twice."""
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str) or not name.strip() or not name.isprintable():
            raise InvalidValueError(f"a room needs a name of one printable line, got {name!r:.80}")
        if len(name) > MAX_NAME:
            raise InvalidValueError(f"a name has at most {MAX_NAME} characters, got {name!r:.80}")
        if read_point(name) is not None:
            raise InvalidValueError(
                f"a name must not read as a point, got {brief(name)}: a plan could not go there"
            )
        if _DOOR.fullmatch(folded(name)):
            raise InvalidValueError(
                f"a name must not read as a door, got {brief(name)}: give the room another one"
            )
        if name in seen:
            raise InvalidValueError(f"room {brief(name)}: the name is given twice")
        seen.add(name)


_LETTERS = str.maketrans(
    {"ø": "o", "ł": "l", "đ": "d", "ð": "d", "ħ": "h", "\u0131": "i", "æ": "ae", "œ": "oe"}
)
"""Letters that Unicode does not take apart."""


def folded(text: str) -> str:
    """Return a text without case, accents and doubled spaces, to compare names as people type them.

    Examples
    --------
    >>> from hybridnav.maps.names import folded
    >>> folded("Große  Küche") == folded("GROSSE KUCHE")
    True
    """
    apart = unicodedata.normalize("NFKD", text.casefold()).translate(_LETTERS)
    kept = (letter for letter in apart if not unicodedata.combining(letter))
    return " ".join("".join(kept).split())


def natural_key(name: str) -> tuple[tuple[bool, int, str], ...]:
    """Return what sorts names as people do: numbers by their value, letters without case and
    accents.

    Examples
    --------
    >>> from hybridnav.maps.names import natural_key
    >>> sorted(["ward 10", "Ward 2", "Äpfel"], key=natural_key)
    ['Äpfel', 'Ward 2', 'ward 10']
    """
    parts = re.findall(r"[0-9]+|[^0-9]+", folded(name[:MAX_NAME]))
    digits = [part[0] in "0123456789" for part in parts]
    found = [
        (not number, int(part) if number else 0, "" if number else part)
        for part, number in zip(parts, digits, strict=True)
    ]
    return (*found, (False, -1, name))


def matching(text: str, names: Sequence[str]) -> list[int]:
    """Return which names a text may mean, as people type it: in any case, with or without accents,
    words in any order.

    Return their indices: first those that equal the text, then those that begin with it, that have
    a word that begins with it, and that hold each of its words; each in natural order.

    Examples
    --------
    >>> from hybridnav.maps.names import matching
    >>> names = ["tea kitchen", "ward 10", "Küche", "kitchen", "ward 2"]
    >>> [names[at] for at in matching("KIT", names)]
    ['kitchen', 'tea kitchen']
    >>> [names[at] for at in matching("kuche", names)]
    ['Küche']
    """
    wanted = folded(text)
    words = wanted.split()
    ranked = []
    for at, name in enumerate(names):
        own = folded(name)
        if all(word in own for word in words):
            is_like = (own == wanted, own.startswith(wanted), f" {wanted}" in own, True)
            ranked.append((is_like.index(True), natural_key(name), at))
    return [at for *_, at in sorted(ranked)]


def nearest(name: str, known: tuple[str, ...]) -> list[str]:
    """Return the names that are spelt most alike, three at most."""
    called: dict[str, str] = {}
    for each in known:
        called.setdefault(folded(each), each)
    near = difflib.get_close_matches(folded(name[:MAX_NAME]), called, n=3, cutoff=0.5)
    return [called[each] for each in near]


def did_you_mean(name: str, known: tuple[str, ...]) -> str:
    """Return a clause that suggests the nearest names, else some of all."""
    if not known:
        return ": the map has no names"
    if near := nearest(name, known):
        return f": did you mean {' or '.join(near)}?"
    shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")  # noqa: PLR2004
    return f": there are {shown}"


def place_of_name(name: str, known: tuple[str, ...], what: str) -> int:
    """Return the place of a name among those that are known.

    `known`: all names; `what`: what they are the names of, such as "floor". Raises
    `InvalidValueError` when it is none of them; the message suggests the nearest ones.
    """
    if name in known:
        return known.index(name)
    if not isinstance(name, str):
        raise InvalidValueError(
            f"the name of a {what} is a text, got {name!r:.80}: put it in quotes"
        )
    raise InvalidValueError(f"no {what} is called {name!r:.80}{did_you_mean(str(name), known)}")


def check_number(number: int) -> int:
    """Return the number of a door, refuse what is none."""
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number <= MAX_NUMBER:
        raise InvalidValueError(
            f"a door needs a whole number from 1 to {MAX_NUMBER}, got {number!r:.80}"
        )
    return number
