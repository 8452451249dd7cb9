"""JSON whose long lists are read value by value, so that a large file never is one large tree."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from hybridnav.errors import MapError

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_BYTES = 2**28
"""Most bytes of a file: a million edges with metadata take about as many."""
MOST_VALUES = 2**24
"""Most values in a file, counted by its commas and brackets."""
_LONGEST = 2**22
"""Most characters of one node or edge, and of each value beside the lists."""
_BLANK = re.compile(r"[ \t\n\r]*")


def members_of(text: str, where: str) -> Iterator[tuple[str, int | None, Any]]:
    """Yield the members of a JSON object, and of its lists each value by itself.

    Parameters
    ----------
    text
        The file. NaN and infinities are read as such, as programs write them.
    where
        What messages begin with.

    Yields
    ------
    tuple
        The key of a member, the index in its list (None where it is no list; -1 with no value for
        an empty one), and the value.

    Raises
    ------
    MapError
        When the text is no JSON object, or too large; one line with the place.
    """
    if text.count(",") + text.count("[") + text.count("{") > MOST_VALUES:
        raise MapError(f"{where}: JSON of more than {MOST_VALUES} values is not read")
    try:
        yield from _Scanner(text).members()
    except json.JSONDecodeError as failure:
        at = f"line {failure.lineno}, column {failure.colno}"
        raise MapError(f"{where}, {at}: no JSON: {failure.msg}") from None
    except RecursionError:
        raise MapError(f"{where}: JSON nested deeper than anything meant") from None
    except ValueError:  # an integer of more than 4300 digits
        raise MapError(f"{where}: no JSON: a number has too many digits") from None


class _Scanner:
    """A place in a text, from which value after value is read."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._begin, self._part = 0, text[:_LONGEST]
        self._decoder = json.JSONDecoder()

    def members(self) -> Iterator[tuple[str, int | None, Any]]:
        """Yield as `members_of`."""
        self._take("{")
        if not self._skip("}"):
            while True:
                key = self._value()
                if not isinstance(key, str):
                    raise self._error("expected a key in quotes", self._at)
                self._take(":")
                if self._skip("["):
                    for index, value in self._items():
                        yield key, index, value
                else:
                    yield key, None, self._value()
                if not self._skip(","):
                    break
            self._take("}")
        self._blank()
        if self._at < len(self._text):
            raise self._error("more text after the end", self._at)

    def _items(self) -> Iterator[tuple[int, Any]]:
        if self._skip("]"):
            yield -1, None
            return
        index = 0
        while True:
            yield index, self._value()
            index += 1
            if not self._skip(","):
                break
        self._take("]")

    def _value(self) -> Any:
        """Read one value out of a part of the text, so that none is longer than that part."""
        self._blank()
        for is_new in (False, True):
            if is_new:
                self._begin, self._part = self._at, self._text[self._at : self._at + _LONGEST]
            is_last = self._begin + len(self._part) == len(self._text)
            try:
                value, end = self._decoder.raw_decode(self._part, self._at - self._begin)
            except json.JSONDecodeError as stop:
                failure = self._error(stop.msg, self._begin + stop.pos)
            else:
                if end < len(self._part) or is_last:
                    self._at = self._begin + end
                    return value
                failure = self._error(f"one value of more than {_LONGEST} characters", self._at)
            if is_last:
                break
        if is_last:
            raise failure
        raise self._error(f"one value of more than {_LONGEST} characters, or none", self._at)

    def _blank(self) -> None:
        found = _BLANK.match(self._text, self._at)
        self._at = self._at if found is None else found.end()

    def _skip(self, mark: str) -> bool:
        self._blank()
        is_there = self._text.startswith(mark, self._at)
        self._at += is_there
        return is_there

    def _take(self, mark: str) -> None:
        if not self._skip(mark):
            raise self._error(f"expected {mark!r:.80}", self._at)

    def _error(self, words: str, at: int) -> json.JSONDecodeError:
        return json.JSONDecodeError(words, self._text, at)
