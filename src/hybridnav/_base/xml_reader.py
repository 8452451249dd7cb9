"""`XmlReader`: events of an XML text, guarded against entities, depth and size."""

from __future__ import annotations

from typing import Any
from xml.parsers import expat

from hybridnav._base.files import printable
from hybridnav.errors import MapError

MOST_BYTES = 2**25
"""Most characters of a file: some 100,000 ways, which take 150 MB of memory."""
_ENCODINGS = ("UTF-8", "UTF8", "US-ASCII", "ASCII")
"""Those that an XML declaration may state: files are read as UTF-8."""


class XmlReader:
    """What expat calls of a text that was read as UTF-8."""

    deepest, kind = 20, "XML"

    def __init__(self, where: str) -> None:
        self._where, self._depth = where, 0

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Begin an element."""

    def end(self, tag: str) -> None:
        """End an element."""

    def parse(self, text: str, parser: expat.XMLParserType) -> None:
        """Parse a text.

        Raises `MapError` when it is no XML, declares another encoding or a document type, by which
        it could be endless, or is nested too deep.
        """
        where = self._where

        def begin(tag: str, given: dict[str, str]) -> None:
            self._depth += 1
            if self._depth > self.deepest:
                raise MapError(f"{where}: XML nested more than {self.deepest} deep")
            self.start(tag, given)

        def end(tag: str) -> None:
            self._depth -= 1
            self.end(tag)

        def refuse(*_: Any) -> None:
            raise MapError(f"{where}: {self.kind} with a document type (DOCTYPE) is not read")

        def check(_version: str, encoding: str | None, _standalone: int) -> None:
            if encoding is not None and encoding.upper() not in _ENCODINGS:
                raise MapError(
                    f"{where}: declares the encoding {printable(encoding)!r:.40}, expected UTF-8: "
                    "save the file in that encoding"
                )

        parser.StartElementHandler, parser.EndElementHandler = begin, end
        parser.StartDoctypeDeclHandler, parser.XmlDeclHandler = refuse, check
        try:
            parser.Parse(text.encode(), True)
        except expat.ExpatError as failure:
            at = f"line {failure.lineno}, column {failure.offset + 1}"
            raise MapError(f"{where}, {at}: no XML: {expat.ErrorString(failure.code)}") from None
        except UnicodeEncodeError:
            raise MapError(f"{where}: not UTF-8 text") from None
