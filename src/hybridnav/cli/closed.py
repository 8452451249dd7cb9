"""`hybridnav closed`: what is out of order in a building or on a map, until it is opened again."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, answer
from hybridnav.cli.reading import MapOptions, grow_topology, load_model, with_map

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hybridnav.closures import OutOfOrder

CloseOption = Annotated[
    list[str] | None,
    typer.Option(
        "--close",
        metavar="WHAT",
        help="Close door:N or room:NAME; in a building link:NAME, link:NAME@FLOOR, "
        "FLOOR:door:N or FLOOR:room:NAME. "
        "May be repeated.",
    ),
]
OpenOption = Annotated[
    list[str] | None,
    typer.Option(
        "--open", metavar="WHAT", help="Open a closed thing again, or all. May be repeated."
    ),
]
WhyOption = Annotated[
    str | None, typer.Option("--why", metavar="TEXT", help="The reason for --close, one line.")
]


@with_map(over_floors=lambda: extension("formats", "building").close_over_floors)
def closed(
    map_file: options.MapOrBuildingArgument,
    close: CloseOption = None,
    open_again: OpenOption = None,
    why: WhyOption = None,
    rooms_file: options.RoomsOption = None,
    as_json: options.JsonOption = False,
    *,
    reading: MapOptions,
) -> None:
    """List things out of order in MAP, or close and open links, doors and rooms.

    It stays closed for plans, pages and programs until it is opened again: NAME.closed.yaml beside
    MAP holds it.
    """

    def check(item: OutOfOrder) -> None:
        """Refuse what is not on the map."""
        settings = reading.settings(map_file)
        model = load_model(map_file, settings, {}, reading)
        beside = map_file.parent / "rooms.yaml"
        file = rooms_file or (beside if beside.is_file() else None)
        item.check_on(grow_topology(model, settings, {}, rooms_file=file, find_rooms=True))

    change_closed(map_file, close or (), open_again or (), why, check=check)
    list_closed(map_file, as_json=as_json)


def change_closed(
    map_file: Path,
    close: Sequence[str],
    open_again: Sequence[str],
    why: str | None,
    *,
    check: Callable[[OutOfOrder], None],
) -> None:
    """Close and open things in the journal of a file; all are checked before one is closed.

    `map_file`: a map or a building; `close`, `open_again`, `why`: as the options of
    `hybridnav closed`; `check`: refuses what is not there.
    """
    from hybridnav.closures import Journal, OutOfOrder  # noqa: PLC0415 - loads shapely

    if why is not None and not close:
        raise UsageError("--why is for --close: add --close WHAT, or leave it out")
    if not map_file.is_file():
        raise UsageError(f"there is no file '{printable(map_file)}'")
    journal = Journal(map_file)
    known = [item.what for item in journal.items()]
    for what in open_again:
        if what != "all" and what not in known:
            listed = ", ".join(known) or "nothing"
            raise UsageError(f"--open: {what!r:.80} is not closed; closed is {listed:.400}")
    for what in close:
        check(OutOfOrder(what, why=why or ""))
    for what in known if "all" in open_again else open_again:
        journal.open(what)
    for what in close:
        journal.close(what, why=why or "", by=os.environ.get("USER", ""))


def list_closed(map_file: Path, *, as_json: bool) -> None:
    """Print what the journal of a file closes."""
    from hybridnav.closures import Journal  # noqa: PLC0415 - loads shapely

    journal = Journal(map_file)
    items = journal.items()
    if as_json:
        values = {"journal": str(journal.path), "closed": [asdict(item) for item in items]}
        answer(json.dumps(values) + "\n")
        return
    width = max((len(item.what) for item in items), default=0)
    lines = [f"closed     {len(items)}" + (f", in {printable(journal.path)}" if items else "")]
    for item in items:
        facts = item.since and f"since {item.since} UTC", item.by and f"by {item.by}", item.why
        lines.append(f"{item.what:<{width}}  {', '.join(filter(None, facts))}".rstrip())
    answer("\n".join(lines) + "\n")
