"""`hybridnav closed`: what is out of order in a building or on a map, until it is opened again."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated

from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, answer
from hybridnav.cli.map_options import FloorOptions
from hybridnav.cli.options import OneMap, option
from hybridnav.cli.reading import grow_topology

if TYPE_CHECKING:
    from hybridnav.closures import OutOfOrder

CloseOption = Annotated[
    list[str] | None,
    option(
        "--close WHAT",
        "Close door:N or room:NAME, or close it one way, one-way:door:N=ROOM; in a building with "
        "FLOOR: before it, or link:NAME, link:NAME@FLOOR, link:NAME=up. May be repeated.",
    ),
]
OpenOption = Annotated[
    list[str] | None, option("--open WHAT", "Open a closed thing again, or all. May be repeated.")
]
WhyOption = Annotated[str | None, option("--why TEXT", "The reason for --close, one line.")]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ClosedOptions(FloorOptions):
    """The options of `hybridnav closed`."""

    close: CloseOption = None
    open_again: OpenOption = None
    why: WhyOption = None
    rooms_file: OneMap[options.RoomsOption] = None
    as_json: options.JsonOption = False


def closed(args: ClosedOptions) -> None:
    """List things out of order in MAP; close and open things.

    Doors, rooms and links stay closed for plans, pages and programs until they are opened again:
    NAME.closed.yaml beside MAP holds them. MAP may be a building.

    Example: hybridnav closed map.yaml --close door:3 --why "it is stuck"
    """
    from hybridnav.closures import Journal  # noqa: PLC0415 - loads shapely

    _change(args)
    journal = Journal(args.map_file)
    items = journal.items()
    if args.as_json:
        values = {"journal": str(journal.path), "closed": [asdict(item) for item in items]}
        answer(json.dumps(values) + "\n")
        return
    width = max((len(item.what) for item in items), default=0)
    lines = [f"closed     {len(items)}" + (f", in {printable(journal.path)}" if items else "")]
    for item in items:
        facts = item.since and f"since {item.since} UTC", item.by and f"by {item.by}", item.why
        lines.append(f"{item.what:<{width}}  {', '.join(filter(None, facts))}".rstrip())
    answer("\n".join(lines) + "\n")


def _change(args: ClosedOptions) -> None:
    """Close and open things in the journal of a file; all are checked before one is closed."""
    from hybridnav.closures import Journal, OutOfOrder  # noqa: PLC0415 - loads shapely

    close, open_again, why = args.close or (), args.open_again or (), args.why or ""
    if args.why is not None and not close:
        raise UsageError("--why is for --close: add --close WHAT, or leave it out")
    if not args.map_file.is_file():
        raise UsageError(f"there is no file '{printable(args.map_file)}'")
    journal = Journal(args.map_file)
    closed_now = [item.what for item in journal.items()]
    for what in open_again:
        if what != "all" and what not in closed_now:
            listed = ", ".join(closed_now) or "nothing"
            raise UsageError(f"--open: {what!r:.80} is not closed; closed is {listed:.400}")
    items = [OutOfOrder(what, why=why) for what in close]
    if items and args.is_building:
        extension("formats", "building").check_closing_over_floors(args, items)
    elif items:
        _check_on_map(args, items)
    for what in closed_now if "all" in open_again else open_again:
        journal.open(what)
    for what in close:
        journal.close(what, why=why, by=os.environ.get("USER", ""))


def _check_on_map(args: ClosedOptions, items: list[OutOfOrder]) -> None:
    settings = args.settings()
    model = args.load(settings, {})
    file, map_file = args.rooms_file, args.map_file
    topology = grow_topology(
        model, settings, {}, rooms_file=file, find_rooms=True, map_file=map_file
    )
    for item in items:
        item.check_on(topology)
