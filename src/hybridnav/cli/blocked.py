"""The option `--blocked`: closed doors and rooms, obstacles and keepout zones in files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybridnav._base.files import printable
from hybridnav.cli.errors import UsageError
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    import hybridnav as hn
    from hybridnav.maps.costs.files import CostSpec

BlockedOption = Annotated[
    list[str] | None,
    typer.Option(
        "--blocked",
        metavar="WHAT",
        help="Close door:N, room:NAME, or the areas of a GeoJSON FILE or mask: obstacles, off "
        "which the robot keeps its radius. keepout:FILE[,x=X,y=Y,yaw=A] keeps out its centre "
        "alone, as Nav2 takes its masks. May be repeated.",
    ),
]


_KINDS = frozenset({"door", "room", "keepout"})


@dataclass(frozen=True)
class Closing:
    """The closures of a command line."""

    given: tuple[str, ...] = ()
    """As it was given, printable."""
    doors: tuple[int, ...] = ()
    rooms: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    masks: tuple[CostSpec, ...] = ()
    """Files of zones for the centre of the robot."""

    @property
    def needs_rooms(self) -> bool:
        """Whether the closures make sense only on a map with rooms."""
        return bool(self.doors or self.rooms)

    def to_dict(self) -> dict[str, Any]:
        """Return the closures as plain values for JSON: null for none."""
        return {"blocked": list(self.given) or None}

    def read(self, grid: hn.OccupancyGrid) -> hn.Blocked | None:
        """Read the files and join all closures; return None for none."""
        if not self.given:
            return None
        # They load shapely.
        from hybridnav.planner import Blocked, load_blocked  # noqa: PLC0415

        closed = Blocked(doors=self.doors, rooms=self.rooms)
        for path in self.files:
            closed |= load_blocked(path, grid)
        for mask in self.masks:
            closed |= load_blocked(mask.file, grid, keepout=True, pose=mask.pose)
        return closed


def closing_lines(figures: dict[str, Any]) -> list[str]:
    """Return the line of a summary about closures, if there are any."""
    closed = figures.get("blocked")
    return [f"blocked    {', '.join(closed)}"] if closed else []


def parsed_closing(texts: list[str] | None) -> Closing:
    """Read the values of the option.

    Raises
    ------
    UsageError
        When a door has no number, a room or a file no name, or a mask other settings.
    """
    doors, rooms, files, masks = [], [], [], []
    for text in texts or ():
        kind, colon, name = text.partition(":")
        if not text or (colon and kind in _KINDS and not name.strip()):
            kinds = "door:N, room:NAME, keepout:FILE"
            raise UsageError(f"--blocked must be {kinds} or a file, got {text!r:.80}")
        if colon and kind == "door":
            doors.append(_number(name))
        elif colon and kind == "room":
            rooms.append(name)
        elif colon and kind == "keepout":
            masks.append(_mask(text))
        else:
            files.append(Path(text))
    given = tuple(map(printable, texts or ()))
    return Closing(given, tuple(doors), tuple(rooms), tuple(files), tuple(masks))


def _mask(text: str) -> CostSpec:
    from hybridnav.maps.costs.files import parse_costs  # noqa: PLC0415 - loads numpy

    try:
        (mask,) = parse_costs([text])
    except InvalidValueError as error:
        raise UsageError(f"--blocked: {str(error).removeprefix('costs ')}") from None
    if "multiplier" in mask.settings:
        raise UsageError(
            "--blocked keepout takes x, y and yaw, as closed cells have no cost, got multiplier: "
            "leave it out, or plan by --costs"
        )
    return mask


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise UsageError(
            f"--blocked door: expected the number of a door, as hybridnav rooms MAP --plot draws "
            f"it, got {text!r:.80}"
        ) from None
