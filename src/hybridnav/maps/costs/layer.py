"""Layers of costs: a factor for each cell, by which a metre in it costs more than a metre."""

from __future__ import annotations

import hashlib
import math
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import AnyArray, BoolArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.maps.cells import Box
from hybridnav.maps.checks import checked_cell, checked_type
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs.factors import (
    HIGHEST,
    MOST_FACTOR,
    UNIT_BITS,
    changed_cells,
    changed_source,
    checked_box,
    checked_cells,
    checked_factors,
    checked_multiplier,
    checked_setting,
    checked_speeds,
    checked_values,
    holding_centres,
    inflated_costs,
    joined_cells,
    joined_source,
    keepout_costs,
    mask_on_map,
    rounded,
)


@copies_alike
@dataclass(frozen=True, eq=False)
class CostLayer:
    """A factor for each cell of a map, and the cells that are closed.

    A move from cell a to cell b costs its length times (f(a) + f(b)) / 2: the exact integral of the
    factors along the move. Costs are symmetric and never below the length, so that every bound on
    lengths is one on costs.

    Two layers are joined by `first | second`, which takes the larger factor of each cell, as Nav2's
    costmap does. `first * second` is for factors that do not depend on each other: a wall is to be
    avoided in a slow zone too. Cells that either layer closes are closed.

    Parameters
    ----------
    factors
        Shape `(rows, cols)`, row 0 at the lowest y: numbers from 1 to 1000. Rounded down to
        multiples of 2^-14, so that integers can count costs exactly.
    closed
        bool (rows, cols), obstacles such as pallets and shut doors: a planner keeps the robot's
        radius off these cells, as off occupied ones; None for none.
    source
        Origin of the factors, which results record: plain values for JSON. After changes it lists
        the first one and the last seven, and counts the others as `left_out`.
    keepout
        bool (rows, cols), cells that the *centre* of the robot does not enter, as in a keepout zone
        of Nav2: nothing is added to them; None for none.

    Raises
    ------
    InvalidValueError
        When the factors are no numbers from 1 to 1000, or the arrays have other shapes.

    Examples
    --------
    >>> layer = hn.CostLayer(np.array([[1.0, 1.5, 3.0]]))
    >>> (layer | hn.CostLayer(np.array([[2.0, 1.0, 1.0]]))).factors
    array([[2. , 1.5, 3. ]], dtype=float32)
    >>> (layer * layer).factors
    array([[1.  , 2.25, 9.  ]], dtype=float32)
    """

    factors: NDArray[np.float32]
    closed: BoolArray | None = None
    source: dict[str, Any] = field(default_factory=lambda: {"kind": "array"})
    keepout: BoolArray | None = None

    def __post_init__(self) -> None:
        factors = checked_factors(self.factors)
        object.__setattr__(self, "factors", frozen(factors))
        rows, cols = factors.shape
        for name in ("closed", "keepout"):
            cells = checked_cells(name, getattr(self, name), (rows, cols))
            object.__setattr__(self, name, cells)

    @classmethod
    def clearance(
        cls,
        grid: OccupancyGrid,
        *,
        inflation_radius_m: float = 0.70,
        scaling: float = 3.0,
        inscribed_radius_m: float | None = None,
        multiplier: float = 2.0,
    ) -> CostLayer:
        """Make the layer of Nav2's inflation: factors that fall off with distance from obstacles.

        The cost of a cell is that of `computeCost` in `nav2_costmap_2d/inflation_layer.hpp`: 254 in
        an occupied cell, 253 up to the inscribed radius. Then it is 252 exp(-scaling (distance -
        inscribed radius)), truncated to a whole number, up to the inflation radius, rounded up to
        whole cells; 0 beyond. The factor is 1 + multiplier * cost / 252. Distances are Euclidean,
        between the centres of cells, from the cells measured as occupied: cells that the robot's
        radius blocks are no obstacles. Unexplored cells are none either; their own factor is that
        of a free cell (in Nav2 `inflate_around_unknown: false`, `inflate_unknown: true`).

        Parameters
        ----------
        grid
            The map.
        inflation_radius_m
            Distance in metres up to which cells cost more, `inflation_radius`, finite, >= 0.
        scaling
            `cost_scaling_factor`, 1 / m, finite, >= 0. The defaults of both are those of Nav2's
            bringup.
        inscribed_radius_m
            Distance in metres from which the cost falls off, finite, >= 0; None for the robot's
            radius.
        multiplier
            Factor above 1 of a cell that costs 252, finite, >= 0.

        Raises
        ------
        InvalidValueError
            When a value is out of range.

        Examples
        --------
        >>> grid = hn.OccupancyGrid(np.array([[1.0, 0, 0, 0, 0]]), hn.Frame(0.25))
        >>> layer = hn.CostLayer.clearance(grid, inflation_radius_m=0.75)
        >>> layer.factors.round(2)
        array([[3.02, 3.01, 1.94, 1.44, 1.  ]], dtype=float32)
        """
        inscribed_m = grid.robot_radius_m if inscribed_radius_m is None else inscribed_radius_m
        settings = {
            "inflation_radius_m": inflation_radius_m,
            "scaling": scaling,
            "inscribed_radius_m": inscribed_m,
            "multiplier": multiplier,
        }
        values = {name: checked_setting(name, value) for name, value in settings.items()}
        per_cost = checked_multiplier(values["multiplier"]) / HIGHEST
        costs = inflated_costs(
            grid, values["inflation_radius_m"], values["scaling"], values["inscribed_radius_m"]
        )
        factor_of = rounded(1 + per_cost * np.arange(256))
        return cls(factor_of[costs], source={"kind": "clearance", **values})

    @classmethod
    def speed_mask(  # noqa: PLR0913 - the last four have defaults
        cls,
        grid: OccupancyGrid,
        values: ArrayLike,
        frame: Frame | None = None,
        *,
        base: float = 100.0,
        multiplier: float = -1.0,
        unit: Literal["percent", "m/s"] = "percent",
        full_speed_mps: float | None = None,
    ) -> CostLayer:
        """Make the layer of a speed mask of Nav2: a metre costs as much more as it takes longer.

        The speed limit of a cell is `base + multiplier * value`, as Nav2's `SpeedFilter` computes
        it; the factor is full speed / limit. Value 0, unknown (-1), cells outside the mask, and
        limits out of range or of 0 limit nothing.

        Parameters
        ----------
        grid
            The map.
        values
            Integers (rows, cols) from 0 to 100, or -1, row 0 at the lowest y: the cells of a mask.
        frame
            Place of the mask in the map frame; None for that of the map. The cell of the mask in
            which the centre of a map cell lies counts for it.
        base, multiplier
            Those of Nav2's `CostmapFilterInfo`. The defaults are those of Nav2's tutorial.
        unit
            `"percent"` of full speed (filter type 1) or `"m/s"` (type 2).
        full_speed_mps
            Full speed in m/s; goes with the unit m/s.

        Raises
        ------
        InvalidValueError
            When the mask or a setting is out of range.

        Examples
        --------
        >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
        >>> hn.CostLayer.speed_mask(grid, [[0, 50, 75]]).factors
        array([[1., 2., 4.]], dtype=float32)
        """
        limits = checked_speeds(base, multiplier, unit, full_speed_mps)
        factor_of = rounded(limits.factors(MOST_FACTOR))
        on_map = mask_on_map(grid, checked_values(values), frame)
        return cls(factor_of[on_map], source={"kind": "speed mask", **asdict(limits)})

    @classmethod
    def keepout_mask(
        cls,
        grid: OccupancyGrid,
        values: ArrayLike,
        frame: Frame | None = None,
        *,
        multiplier: float = 2.0,
    ) -> CostLayer:
        """Make the layer of a keepout mask of Nav2: closed zones, and lanes of preference.

        A value costs round(2.54 value), as Nav2's `KeepoutFilter` converts it. Cells that cost 253
        or more are `keepout`; the others have the factor 1 + multiplier * cost / 252. Unknown
        values (-1) and cells outside the mask cost nothing. The robot's *centre* keeps out of a
        zone, and its radius is not added, as Nav2 lays filters over its inflation. The value at the
        centre of a map cell counts, as in Nav2. A cell is also closed if the centre of a closed
        cell of a finer mask lies in it. Unlike Nav2, this loses no thin zone.

        Parameters
        ----------
        grid
            The map.
        values, frame
            As in `speed_mask`.
        multiplier
            Factor above 1 of a cell that costs 252, finite, >= 0.

        Raises
        ------
        InvalidValueError
            When the mask or the multiplier is out of range.

        Examples
        --------
        >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
        >>> layer = hn.CostLayer.keepout_mask(grid, [[0, 50, 100]])
        >>> layer.factors.round(2), layer.keepout
        (array([[1.  , 2.01, 1.  ]], dtype=float32), array([[False, False,  True]]))
        """
        value = checked_multiplier(checked_setting("multiplier", multiplier))
        costs = keepout_costs()
        factor_of = rounded(1 + np.where(costs > HIGHEST, 0, value / HIGHEST * costs))
        given = checked_values(values)
        on_map = mask_on_map(grid, given, frame)
        closed = (costs > HIGHEST)[on_map]
        closed |= holding_centres(grid, (costs > HIGHEST)[given], frame)
        source = {"kind": "keepout mask", "multiplier": value}
        return cls(factor_of[on_map], source=source, keepout=closed)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, cols = self.factors.shape
        return rows, cols

    @cached_property
    def units(self) -> NDArray[np.int32]:
        """int32 (rows, cols), the factors in units of 2^-14."""
        return frozen((self.factors * np.float32(1 << UNIT_BITS)).astype(np.int32))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the factors and of the closed cells, for layers whose sources are alike."""
        made = hashlib.sha256(repr(self.shape).encode() + self.units.tobytes())
        for name in ("closed", "keepout"):
            cells = getattr(self, name)
            made.update(b"" if cells is None else name.encode() + np.packbits(cells).tobytes())
        return made.hexdigest()

    @cached_property
    def closed_flat(self) -> LongArray:
        """int64 (n,), the cells of `closed` and `keepout` as `row * cols + col`, in order."""
        shut = joined_cells(self.closed, self.keepout)
        return frozen(np.empty(0, dtype=np.int64) if shut is None else np.flatnonzero(shut))

    def inflated(self, grid: OccupancyGrid) -> CostLayer:
        """Return the layer with `keepout` alone: all cells that the robot's centre may not enter.

        Parameters
        ----------
        grid
            The map of the layer; cells within the robot's radius of closed ones are added, as they
            are round occupied ones.

        Examples
        --------
        >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=1)
        >>> layer = hn.CostLayer(np.ones((1, 4)), np.array([[True, False, False, False]]))
        >>> layer.inflated(grid).keepout
        array([[ True,  True, False, False]])
        """
        if self.closed is None:
            return self
        near = within_radius(self.closed, radius_cells=grid.robot_radius_m / grid.resolution_m)
        keepout = joined_cells(near, self.keepout)
        return replace(self, closed=None, keepout=keepout)

    def check_fits(self, grid: OccupancyGrid) -> None:
        """Raise `InvalidValueError` if a map has another number of cells."""
        if self.shape != grid.shape:
            (rows, cols), (map_rows, map_cols) = self.shape, grid.shape
            raise InvalidValueError(
                f"costs of {cols} x {rows} cells are not those of a map of {map_cols} x {map_rows} "
                "cells: make them for this map"
            )

    def cost_of_cells(self, cells: AnyArray) -> float:
        """Return the cost of a path of 8-neighbour moves, in cells.

        Parameters
        ----------
        cells
            Integers (n, 2), (row, col), n >= 1.

        Examples
        --------
        >>> hn.CostLayer(np.array([[1.0, 2.0, 2.0]])).cost_of_cells(np.array([[0, 0], [0, 1]]))
        1.5
        """
        # Without `units`, which a layer that has just been changed would compute for the whole map.
        own = self.factors[cells[:, 0], cells[:, 1]]
        units = (own * np.float32(1 << UNIT_BITS)).astype(np.int64)
        sums = units[:-1] + units[1:]
        diagonal = int(sums[(cells[1:] != cells[:-1]).all(axis=1)].sum())
        straight = int(sums.sum()) - diagonal
        return (straight + diagonal * math.sqrt(2.0)) / (2 << UNIT_BITS)

    def part(self, box: Box) -> CostLayer:
        """Return the layer of the cells in a box.

        Parameters
        ----------
        box
            First row, last row + 1, first column, last column + 1, inside the layer; not empty.

        Raises
        ------
        InvalidValueError
            When the box is not such four whole numbers.
        """
        top, bottom, left, right = checked_box(box, self.shape)
        inside = slice(top, bottom), slice(left, right)
        closed, keepout = (
            None if cells is None else cells[inside] for cells in (self.closed, self.keepout)
        )
        return CostLayer(self.factors[inside], closed, self.source, keepout)

    def changed(self, part: CostLayer, row: int, col: int) -> CostLayer:
        """Return the layer with some of its cells as in another one; the time is that of a copy.

        Parameters
        ----------
        part
            The new factors and closed cells of a box of cells.
        row, col
            The first row and column of the box.

        Raises
        ------
        InvalidValueError
            When the part is no layer, or the box is not inside the layer.

        Examples
        --------
        >>> layer = hn.CostLayer(np.ones((1, 4)))
        >>> layer.changed(hn.CostLayer(np.full((1, 2), 3.0)), 0, 1).factors
        array([[1., 3., 3., 1.]], dtype=float32)
        """
        rows, cols = checked_type("part", part, CostLayer).shape
        row, col = checked_cell("first cell", (row, col))
        if not (0 <= row <= self.shape[0] - rows and 0 <= col <= self.shape[1] - cols):
            raise InvalidValueError(
                f"{cols} x {rows} cells at row {brief(row)}, column {brief(col)} do not lie inside "
                f"costs of {self.shape[1]} x {self.shape[0]} cells: give a box of this map"
            )
        inside = slice(row, row + rows), slice(col, col + cols)
        factors, box = self.factors.copy(), (row, row + rows, col, col + cols)
        factors[inside] = part.factors
        # Made without the checks of all cells: both layers have passed them.
        layer = object.__new__(CostLayer)
        object.__setattr__(layer, "factors", frozen(factors))
        for name in ("closed", "keepout"):
            cells = changed_cells(getattr(self, name), getattr(part, name), box, self.shape)
            object.__setattr__(layer, name, cells)
        object.__setattr__(layer, "source", changed_source(self.source, part.source))
        return layer

    def __or__(self, other: CostLayer) -> CostLayer:
        """Return the layer of the larger factors."""
        return self._joined(other, "maximum")

    def __mul__(self, other: CostLayer) -> CostLayer:
        """Return the layer of the products of the factors."""
        return self._joined(other, "product")

    def _joined(self, other: CostLayer, how: Literal["maximum", "product"]) -> CostLayer:
        if not isinstance(other, CostLayer):
            return NotImplemented
        if self.shape != other.shape:
            raise InvalidValueError(
                f"layers of costs of shapes {self.shape} and {other.shape} cannot be joined: make "
                "both for one map"
            )
        first, second = self.factors.astype(np.float64), other.factors.astype(np.float64)
        factors = np.maximum(first, second) if how == "maximum" else first * second
        source = joined_source(self.source, other.source, how)
        closed = joined_cells(self.closed, other.closed)
        return CostLayer(
            rounded(factors), closed, source, joined_cells(self.keepout, other.keepout)
        )
