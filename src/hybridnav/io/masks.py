"""Filter masks of Nav2 in files of map_server, as layers of costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from hybridnav.costs import CostLayer
from hybridnav.grid import DEFAULT_MAX_CELLS
from hybridnav.io.ros import read_mask

if TYPE_CHECKING:
    from hybridnav._typing import PathLike
    from hybridnav.grid import OccupancyGrid


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

    Returns
    -------
    CostLayer
        The factors of the map's cells.

    Raises
    ------
    MapNotFoundError
        When the file, or the image that it names, does not exist.
    MapError
        When a file cannot be read, or holds too many cells.
    InvalidValueError
        When a setting or the pose is out of range.

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
    return CostLayer.speed_mask(
        grid,
        values,
        frame.moved(pose),
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
        The factors of the map's cells, and in `keepout` those that are closed, None without any.

    Raises
    ------
    MapNotFoundError
        When the file, or the image that it names, does not exist.
    MapError
        When a file cannot be read, or holds too many cells.
    InvalidValueError
        When the multiplier or the pose is out of range.

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
    return CostLayer.keepout_mask(grid, values, frame.moved(pose), multiplier=multiplier)
