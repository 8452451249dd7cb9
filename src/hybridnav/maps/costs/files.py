"""Costs that others state: words of people as in `clearance:multiplier=4`, `speed:FILE`,
`keepout:FILE`, mask files, and Nav2's costmap filters as messages, which are `CostmapFilterInfo`
and a filter mask.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import reduce
from operator import or_
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError, MapWarning
from hybridnav.maps import DEFAULT_MAX_CELLS, Frame, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.costs.factors import SpeedLimits, checked_speeds, mask_on_map
from hybridnav.maps.files.ros import read_mask
from hybridnav.maps.messages import read_cells
from hybridnav.maps.occupancy import extent
from hybridnav.messages import number_of

_KEYS = {
    "clearance": ("inflation_radius_m", "scaling", "inscribed_radius_m", "multiplier"),
    "speed": ("base", "multiplier", "unit", "full_speed_mps", "x", "y", "yaw"),
    "keepout": ("multiplier", "x", "y", "yaw"),
}
_POSE = ("x", "y", "yaw")
"""Keys of the pose of a mask's frame in the map frame."""
_TEXTS = frozenset({"unit"})


@dataclass(frozen=True)
class CostSpec:
    """One source of costs."""

    kind: str
    """`clearance`, `speed` or `keepout`."""
    file: str = ""
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def pose(self) -> tuple[float, float, float]:
        """Pose of the frame of a mask in the map frame, `(x, y, yaw)`."""
        x, y, yaw = (self.settings.get(key, 0.0) for key in _POSE)
        return x, y, yaw

    def layer(self, grid: OccupancyGrid) -> CostLayer:
        """Return the costs of the cells of a map; see `CostLayer` and `load_speed_mask`."""
        others = {key: value for key, value in self.settings.items() if key not in _POSE}
        if self.kind == "clearance":
            return CostLayer.clearance(grid, **others)
        if self.kind == "speed":
            return load_speed_mask(self.file, grid, pose=self.pose, **others)
        return load_keepout_mask(self.file, grid, pose=self.pose, **others)


def parse_costs(texts: Sequence[str]) -> tuple[CostSpec, ...]:
    """Return what some texts state.

    `texts`: `clearance[:KEY=VALUE,...]`, at most once, `speed:FILE[,KEY=VALUE,...]` or
    `keepout:FILE[,KEY=VALUE,...]`; keys are the parameters of `CostLayer.clearance`,
    `load_speed_mask` and `load_keepout_mask`, and x, y, yaw instead of a pose. Raises
    `InvalidValueError` when one of them has another form.
    """
    specs: list[CostSpec] = []
    for text in texts:
        kind, _, rest = text.partition(":")
        if kind not in _KEYS:
            raise InvalidValueError(f"costs must begin with {', '.join(_KEYS)}, got {text!r:.80}")
        parts = rest.split(",") if rest else []
        if kind == "clearance":
            if any(spec.kind == kind for spec in specs):
                raise InvalidValueError("costs clearance is given twice, put its settings into one")
            specs.append(CostSpec(kind, settings=_settings(kind, parts)))
            continue
        if not parts or not parts[0]:
            raise InvalidValueError(f"costs {kind}: expected {kind}:FILE, got {text!r:.80}")
        specs.append(CostSpec(kind, parts[0], _settings(kind, parts[1:])))
    return tuple(specs)


def read_costs(texts: Sequence[str], grid: OccupancyGrid) -> CostLayer | None:
    """Return the layer of the larger factors that some texts state, None for no texts.

    Raises `InvalidValueError` when a text has another form, or a setting is out of range. Raises
    `MapError` when a mask cannot be read.
    """
    layers = [spec.layer(grid) for spec in parse_costs(texts)]
    return reduce(or_, layers) if layers else None


def _settings(kind: str, parts: list[str]) -> dict[str, Any]:
    """Return the settings of `KEY=VALUE` parts."""
    settings: dict[str, Any] = {}
    for part in parts:
        key, equals, text = part.partition("=")
        known = _KEYS[kind]
        if not equals or key not in known:
            raise InvalidValueError(
                f"costs {kind} takes KEY=VALUE with {', '.join(known)}, got {part!r:.80}"
            )
        if key in _TEXTS:
            settings[key] = text
            continue
        try:
            settings[key] = float(text)
        except ValueError:
            raise InvalidValueError(
                f"costs {kind}: {key} must be a number, got {text!r:.80}"
            ) from None
    return settings


# Filter masks of Nav2 in files of map_server, as layers of costs.


def load_speed_mask(  # noqa: PLR0913 - the last six have defaults
    path: PathLike,
    grid: OccupancyGrid,
    *,
    base: float = 100.0,
    multiplier: float = -1.0,
    unit: Literal["percent", "m/s"] = "percent",
    full_speed_mps: float | None = None,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    max_cells: int = DEFAULT_MAX_CELLS,
) -> CostLayer:
    """Read a speed mask of Nav2: a metre in a slow zone costs as much more as it takes longer.

    Parameters
    ----------
    path
        YAML file of map_server beside the image; mode `raw`, `scale` or `trinary`. Dark pixels have
        high values, unless it says `negate`; in the mode `raw` the number of a pixel is the value.
    grid
        The map. The mask may have another resolution, place and size.
    base, multiplier, unit, full_speed_mps
        As in `CostLayer.speed_mask`.
    pose
        `(x, y, yaw)` of the frame of the mask in the map frame, in metres and radians; the default
        is for a mask in the map frame.
    max_cells
        The most cells that the mask may have.

    Raises
    ------
    MapNotFoundError
        When the file, or the image that it names, does not exist.
    MapError
        When a file cannot be read, or holds too many cells.
    InvalidValueError
        When a setting or the pose is out of range.

    Warns
    -----
    MapWarning
        When no cell of the mask lies on the map, or a mask of another resolution covers less than a
        tenth of it. When a value limits nothing, such as 100.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("slow.pgm").write_bytes(b"P5 3 1 255 " + bytes([0, 50, 75]))
    >>> _ = Path("slow.yaml").write_text(
    ...     "{image: slow.pgm, resolution: 1.0, origin: [0, 0, 0], negate: 0, mode: raw, "
    ...     "free_thresh: 0.196, occupied_thresh: 0.65}"
    ... )
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> hn.load_speed_mask("slow.yaml", grid).factors
    array([[1., 2., 4.]], dtype=float32)
    """
    values, frame = read_mask(path, max_cells=max_cells)
    frame = frame.moved(pose)
    limits = checked_speeds(base, multiplier, unit, full_speed_mps)
    _warn_of(f"mask {printable(path)}", grid, values, frame, limits)
    return CostLayer.speed_mask(
        grid,
        values,
        frame,
        base=base,
        multiplier=multiplier,
        unit=unit,
        full_speed_mps=full_speed_mps,
    )


def load_keepout_mask(
    path: PathLike,
    grid: OccupancyGrid,
    *,
    multiplier: float = 2.0,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    max_cells: int = DEFAULT_MAX_CELLS,
) -> CostLayer:
    """Read a keepout mask of Nav2: zones that are closed, and lanes of preference.

    Parameters
    ----------
    path, grid, pose, max_cells
        As in `load_speed_mask`.
    multiplier
        As in `CostLayer.keepout_mask`.

    Returns
    -------
    CostLayer
        The factors of the map's cells, and in `keepout` the closed ones, None without any.

    Raises
    ------
    MapNotFoundError
        When the file, or the image that it names, does not exist.
    MapError
        When a file cannot be read, or holds too many cells.
    InvalidValueError
        When the multiplier or the pose is out of range.

    Warns
    -----
    MapWarning
        When the mask covers too little of the map, as in `load_speed_mask`.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("zones.pgm").write_bytes(b"P5 3 1 255 " + bytes([254, 0, 254]))
    >>> _ = Path("zones.yaml").write_text(
    ...     "{image: zones.pgm, resolution: 1.0, origin: [0, 0, 0], negate: 0, "
    ...     "free_thresh: 0.196, occupied_thresh: 0.65}"
    ... )
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> hn.load_keepout_mask("zones.yaml", grid).keepout
    array([[False,  True, False]])
    """
    values, frame = read_mask(path, max_cells=max_cells)
    frame = frame.moved(pose)
    _warn_of(f"mask {printable(path)}", grid, values, frame)
    return CostLayer.keepout_mask(grid, values, frame, multiplier=multiplier)


_FEW = 0.1
"""Part of a map below which a mask of another resolution is said to cover few cells."""


def _warn_of(
    what: str,
    grid: OccupancyGrid,
    values: NDArray[np.int8],
    frame: Frame,
    limits: SpeedLimits | None = None,
) -> None:
    """Warn, for a public function, of a mask that covers few cells of a map or limits nothing."""
    idle = sorted(set(np.unique(values[values > 0])) - set(limits.limiting)) if limits else []
    if idle:
        text = (
            f"{what}: value {idle[-1]} limits nothing, as in Nav2, for which a limit of 0 or out "
            "of range is none: state a slower value that is one, or close the zone by a keepout "
            "mask"
        )
        warnings.warn(text, MapWarning, stacklevel=3)
    if frame == grid.frame and values.shape == grid.shape:
        return
    covered = np.count_nonzero(mask_on_map(grid, np.zeros_like(values), frame) == 0)
    doubt = ""
    if not covered:
        x, y = frame.origin_m
        doubt = (
            f"no cell of the mask lies on the map: its origin is ({x:g}, {y:g}), the map spans "
            f"{extent(grid)}"
        )
    elif frame.resolution_m != grid.resolution_m and covered < _FEW * grid.classes.size:
        doubt = (
            f"the mask covers {covered} of {grid.classes.size} cells of the map: its cells have "
            f"{frame.resolution_m:g} m, those of the map {grid.resolution_m:g} m"
        )
    if doubt:
        text = f"{what}: {doubt}: set its origin and resolution if that is wrong"
        warnings.warn(text, MapWarning, stacklevel=3)


_KEEPOUT, _PERCENT, _ABSOLUTE = 0, 1, 2
"""Values of `type`, from `nav2_costmap_2d/costmap_filters/filter_values.hpp`."""
_FIELDS = ("type", "base", "multiplier")


def filter_costs(
    grid: OccupancyGrid,
    info: Any,
    mask: Any,
    *,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    full_speed_mps: float | None = None,
) -> CostLayer:
    """Make the layer of a costmap filter of Nav2 from its two messages; ROS is not needed.

    Parameters
    ----------
    grid
        The map.
    info
        Any object or mapping with the fields of a `nav2_msgs/CostmapFilterInfo`: `type` (0 keepout,
        1 speed in percent, 2 speed in m/s), `base` and `multiplier`.
    mask
        The mask, a `nav_msgs/OccupancyGrid`, as in `OccupancyGrid.from_message`.
    pose
        `(x, y, yaw)` of the frame of the mask, its `header.frame_id`, in the map frame, in metres
        and radians.
    full_speed_mps
        Full speed in m/s; goes with type 2.

    Returns
    -------
    CostLayer
        As of `CostLayer.keepout_mask` or `CostLayer.speed_mask`.

    Raises
    ------
    InvalidValueError
        When a message lacks a field or holds a wrong value, or the filter is of another type. When
        a keepout filter has a base or multiplier other than 0 and 1, which Nav2 calls wrong.

    Warns
    -----
    MapWarning
        As of `load_keepout_mask` or `load_speed_mask`.

    Examples
    --------
    >>> from hybridnav.maps.costs import filter_costs
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> mask = grid.to_message() | {"data": [0, 50, 75]}
    >>> filter_costs(grid, {"type": 1, "base": 100.0, "multiplier": -1.0}, mask).factors
    array([[1., 2., 4.]], dtype=float32)
    """
    what = "costmap filter info"
    kind, base, multiplier = (number_of(info, name, what) for name in _FIELDS)
    values, frame = read_cells(mask, "filter mask")
    frame = frame.moved(pose)
    if kind == _KEEPOUT:
        if (base, multiplier) != (0.0, 1.0):
            raise InvalidValueError(
                f"{what}: base and multiplier of a keepout filter must be 0 and 1, got {base:g} "
                f"and {multiplier:g}"
            )
        _warn_of("filter mask", grid, values, frame)
        return CostLayer.keepout_mask(grid, values, frame)
    if kind not in {_PERCENT, _ABSOLUTE}:
        raise InvalidValueError(
            f"{what}: type must be 0 (keepout), 1 (speed in percent) or 2 (speed in m/s), "
            f"got {kind:g}"
        )
    unit = "percent" if kind == _PERCENT else "m/s"
    limits = checked_speeds(base, multiplier, unit, full_speed_mps)
    _warn_of("filter mask", grid, values, frame, limits)
    return CostLayer.speed_mask(
        grid,
        values,
        frame,
        base=base,
        multiplier=multiplier,
        unit=limits.unit,
        full_speed_mps=full_speed_mps,
    )
