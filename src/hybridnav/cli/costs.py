"""The option `--costs`: clearance, and masks of Nav2."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybridnav.cli.errors import UsageError

if TYPE_CHECKING:
    import hybridnav as hn

CostsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--costs",
        metavar="WHAT",
        help="Plan the cheapest path, by clearance[:KEY=VALUE,...], speed:FILE[,KEY=VALUE,...] or "
        "keepout:FILE[,multiplier=M] (masks of Nav2); may be repeated.",
    ),
]

PRESET = "grid-astar"
"""The preset that plans by costs unless another is named."""

_KEYS = {
    "clearance": ("inflation_radius_m", "scaling", "inscribed_radius_m", "multiplier"),
    "speed": ("base", "multiplier", "unit", "full_speed_mps"),
    "keepout": ("multiplier",),
}
_TEXTS = frozenset({"unit"})


@dataclass(frozen=True)
class Costs:
    """What a command line states about costs."""

    overrides: tuple[str, ...] = ()
    """Settings of the preset."""
    masks: tuple[tuple[str, Path, dict[str, Any]], ...] = field(default=())
    """Kind, file and settings of each mask."""

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.overrides or self.masks)

    def read(self, grid: hn.OccupancyGrid) -> hn.CostLayer | None:
        """Read the masks, on the cells of a map; None for no masks."""
        import hybridnav as hn  # noqa: PLC0415 - loads numpy

        loaders = {"speed": hn.load_speed_mask, "keepout": hn.load_keepout_mask}
        layer: hn.CostLayer | None = None
        for kind, path, settings in self.masks:
            mask = loaders[kind](path, grid, **settings)
            layer = mask if layer is None else layer | mask
        return layer


def parsed_costs(specs: list[str] | None) -> Costs:
    """Return what the options `--costs` state.

    Raises
    ------
    UsageError
        When one of them has another form.
    """
    overrides: list[str] = []
    masks: list[tuple[str, Path, dict[str, Any]]] = []
    for spec in specs or ():
        kind, _, rest = spec.partition(":")
        if kind not in _KEYS:
            raise UsageError(f"--costs must begin with {', '.join(_KEYS)}, got {spec!r:.80}")
        parts = rest.split(",") if rest else []
        if kind == "clearance":
            settings = _settings(kind, parts)
            if overrides:
                raise UsageError("--costs clearance is given twice, put its settings into one")
            overrides.append("planner.costs.clearance={}")
            overrides += [f"planner.costs.clearance.{key}={settings[key]!r}" for key in settings]
            continue
        if not parts or not parts[0]:
            raise UsageError(f"--costs {kind}: expected {kind}:FILE, got {spec!r:.80}")
        masks.append((kind, Path(parts[0]), _settings(kind, parts[1:])))
    return Costs(tuple(overrides), tuple(masks))


def _settings(kind: str, parts: list[str]) -> dict[str, Any]:
    """Return the settings of `KEY=VALUE` parts."""
    settings: dict[str, Any] = {}
    for part in parts:
        key, equals, text = part.partition("=")
        known = _KEYS[kind]
        if not equals or key not in known:
            raise UsageError(
                f"--costs {kind} takes KEY=VALUE with {', '.join(known)}, got {part!r:.80}"
            )
        if key in _TEXTS:
            settings[key] = text
            continue
        try:
            settings[key] = float(text)
        except ValueError:
            raise UsageError(f"--costs {kind}: {key} must be a number, got {text!r:.80}") from None
    return settings
