"""Generated worlds: the pixels of a map file, their frame and their thresholds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.grid.occupancy import OccupancyGrid

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray
    from hybridnav.grid.frame import Frame

FREE = np.uint8(254)
UNEXPLORED = np.uint8(205)
OCCUPIED = np.uint8(0)
"""The three grey values that map_server writes."""


@copies_alike
@dataclass(frozen=True, eq=False)
class World:
    """A generated map, as in a map_server file.

    Parameters
    ----------
    pixels
        Grey values as in the image file, shape `(rows, cols)`, uint8: the top row, which has the
        highest y, comes first. 0 is occupied, 205 unexplored, 254 free; copied.
    frame
        Resolution and pose of the map; cell (0, 0) is the lower-left pixel.
    name
        Name of the map in messages and pictures.
    free_threshold, occupied_threshold
        U1 and U2 of the paper: `free_thresh` and `occupied_thresh` of the map file.

    Raises
    ------
    InvalidValueError
        When the pixels are no two-dimensional uint8 array.
    """

    pixels: ByteArray
    frame: Frame
    name: str
    free_threshold: float = 0.196
    occupied_threshold: float = 0.65

    def __post_init__(self) -> None:
        pixels = np.array(self.pixels, order="C")
        if pixels.dtype != np.uint8 or pixels.ndim != 2:  # noqa: PLR2004
            raise InvalidValueError(
                "the pixels of a world must be a two-dimensional uint8 array, "
                f"got {pixels.dtype} of shape {pixels.shape}"
            )
        pixels.flags.writeable = False
        object.__setattr__(self, "pixels", pixels)

    def grid(self, *, robot_radius_m: float | None = None) -> OccupancyGrid:
        """Return the occupancy grid of the world, with the same classes as its loaded map file.

        Parameters
        ----------
        robot_radius_m
            Radius in metres by which occupied cells are inflated, 0 for a robot that is a point;
            None as in `OccupancyGrid`.

        Returns
        -------
        OccupancyGrid
            Probabilities `1 - pixel / 255`, row 0 at the lowest y.

        Raises
        ------
        InvalidValueError
            When the radius is negative or not finite.
        """
        darkness = ((255 - np.arange(256)) / 255).astype(np.float32)
        return OccupancyGrid(
            darkness[self.pixels[::-1]],
            self.frame,
            free_threshold=self.free_threshold,
            occupied_threshold=self.occupied_threshold,
            robot_radius_m=robot_radius_m,
            name=self.name,
        )
