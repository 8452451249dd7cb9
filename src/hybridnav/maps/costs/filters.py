"""Costmap filters of Nav2 as messages: what `CostmapFilterInfo` and a filter mask state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav._base.messages import number_of
from hybridnav.errors import InvalidValueError
from hybridnav.maps.costs.layer import CostLayer
from hybridnav.maps.messages import read_cells

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid

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
        When a message lacks a field or holds a wrong value, the filter is of another type, or a
        keepout filter has a base or multiplier other than 0 and 1, which Nav2 calls wrong.

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
    if kind == _KEEPOUT:
        if (base, multiplier) != (0.0, 1.0):
            raise InvalidValueError(
                f"{what}: base and multiplier of a keepout filter must be 0 and 1, got {base:g} "
                f"and {multiplier:g}"
            )
        return CostLayer.keepout_mask(grid, values, frame.moved(pose))
    if kind not in {_PERCENT, _ABSOLUTE}:
        raise InvalidValueError(
            f"{what}: type must be 0 (keepout), 1 (speed in percent) or 2 (speed in m/s), "
            f"got {kind:g}"
        )
    return CostLayer.speed_mask(
        grid,
        values,
        frame.moved(pose),
        base=base,
        multiplier=multiplier,
        unit="percent" if kind == _PERCENT else "m/s",
        full_speed_mps=full_speed_mps,
    )
