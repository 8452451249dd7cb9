"""Names and numbers as people write them: checks, and what they may have meant."""

from __future__ import annotations

import difflib
from typing import Literal

from hybridnav.errors import InvalidValueError, brief

MAX_NAME = 80
"""Characters of a name at most."""
MAX_NUMBER = 1_000_000_000
"""Number of a door at most."""

Segmentation = Literal["judged", "walls", "watershed"]
"""How rooms may be found; see `hybridnav.topology.rooms.find_rooms`."""


def read_point(text: str) -> tuple[float, ...] | None:
    """Return the numbers of a text like `1,2` or `1,2,0.5`; None for a name."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return numbers if len(numbers) in {2, 3} else None


def check_names(names: tuple[str, ...]) -> None:
    """Refuse names that are empty, too long, not one printable line, a point's, or given twice."""
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
        if name in seen:
            raise InvalidValueError(f"room {brief(name)}: the name is given twice")
        seen.add(name)


def did_you_mean(name: str, known: tuple[str, ...]) -> str:
    """Return a clause that suggests the nearest names, else some of all."""
    if not known:
        return ": the map has no names"
    folded: dict[str, str] = {}
    for each in known:
        folded.setdefault(each.casefold(), each)
    near = difflib.get_close_matches(name[:MAX_NAME].casefold(), folded, n=3, cutoff=0.5)
    if near:
        return f": did you mean {' or '.join(folded[each] for each in near)}?"
    shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")  # noqa: PLR2004
    return f": there are {shown}"


def place_of_name(name: str, known: tuple[str, ...], what: str) -> int:
    """Return the place of a name among those that are known.

    Parameters
    ----------
    name
        The name.
    known
        All names.
    what
        What they are the names of, such as "floor".

    Raises
    ------
    InvalidValueError
        When it is none of them; the message suggests the nearest ones.
    """
    if name in known:
        return known.index(name)
    raise InvalidValueError(f"no {what} is called {name!r:.80}{did_you_mean(str(name), known)}")


def check_number(number: int) -> int:
    """Return the number of a door, refuse what is none."""
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number <= MAX_NUMBER:
        raise InvalidValueError(
            f"a door needs a whole number from 1 to {MAX_NUMBER}, got {number!r:.80}"
        )
    return number
