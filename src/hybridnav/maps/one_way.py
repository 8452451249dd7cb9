"""What may be passed in one direction alone, as files and people state it: `OneWayRule`."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from hybridnav.errors import InvalidValueError, brief

_RULE = re.compile(r"door:(?P<door>[1-9][0-9]{0,8})=(?P<into>.*)|line:(?P<line>[^:]+(?::[^:]+)+)")


@dataclass(frozen=True)
class OneWayRule:
    """A door that is passed into one of its rooms alone, or a line that is crossed from its left.

    As text a rule is `door:5=corridor`, or `line:X,Y:X,Y` with two points or more.

    Raises
    ------
    InvalidValueError
        When it is neither, or a line has no two different points of finite numbers.

    Examples
    --------
    >>> rule = hn.OneWayRule.of("door:5=corridor")
    >>> rule.door, rule.into, str(rule)
    (5, 'corridor', 'door:5=corridor')
    >>> str(hn.OneWayRule(line=((1, 2), (1, 4.5))))
    'line:1,2:1,4.5'
    """

    door: int | None = None
    """Number of the door; None for a line."""
    into: str | None = None
    """Name of the room that the door leads into; None for space without a name."""
    line: tuple[tuple[float, float], ...] = ()
    """Points `(x, y)` in metres, map frame: who crosses it comes from the left of one who follows
    it."""

    def __post_init__(self) -> None:
        points = tuple((float(x), float(y)) for x, y in self.line)
        object.__setattr__(self, "line", points)
        is_line = len(set(points)) > 1 and all(map(math.isfinite, sum(points, ())))
        if (self.door is None) != is_line or (points and not is_line):
            raise _refused(self)

    @classmethod
    def of(cls, text: str | OneWayRule) -> OneWayRule:
        """Read a rule from its text.

        Raises
        ------
        InvalidValueError
            When it has another form.
        """
        if isinstance(text, OneWayRule):
            return text
        match = _RULE.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise _refused(text)
        if match["door"]:
            return cls(int(match["door"]), match["into"] or None)
        try:
            points = [tuple(map(float, part.split(","))) for part in match["line"].split(":")]
            return cls(line=tuple((x, y) for x, y in points))
        except ValueError:
            raise _refused(text) from None

    def renamed(self, name_of: Mapping[str, str]) -> OneWayRule:
        """Return the rule with the new name of its room; other rooms keep theirs."""
        return self if self.into is None else replace(self, into=name_of.get(self.into, self.into))

    def __str__(self) -> str:
        """Return the text that `of` reads."""
        if self.door is not None:
            return f"door:{self.door}={self.into or ''}"
        points = (",".join(repr(n + 0.0).removesuffix(".0") for n in at) for at in self.line)
        return f"line:{':'.join(points)}"


def _refused(given: object) -> InvalidValueError:
    return InvalidValueError(
        "a one-way rule must be door:N=ROOM, the room that the door leads into, or line:X,Y:X,Y "
        f"in metres, crossed from its left to its right, got {brief(given)}"
    )
