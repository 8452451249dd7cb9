"""Convex hulls of the fields of a level, from those of the level below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.pyramid._hull_kernels import hulls_of_points
from hybridnav.pyramid._kernels import Hulls

if TYPE_CHECKING:
    from hybridnav._typing import IntArray


def merge_hulls(hulls: Hulls, merged_into: IntArray, n_vertices: int) -> Hulls:
    """Compute the hulls of fields from the hulls of their parts.

    Parameters
    ----------
    hulls
        Hulls of the parts.
    merged_into
        int (n_parts,), the field that each part belongs to.
    n_vertices
        Number of fields.

    Returns
    -------
    Hulls
        Hulls of the fields.
    """
    of_point = np.repeat(merged_into, np.diff(hulls.start))
    rows, cols = hulls.points.T.astype(np.int64)
    row_bits, col_bits = (int(part.max(initial=0)).bit_length() for part in (rows, cols))
    # Sort with numpy: a sort in a kernel takes more than a second to compile.
    keys = np.sort((of_point.astype(np.int64) << row_bits | rows) << col_bits | cols)
    points = np.empty((len(keys), 2), np.int32)
    points[:, 0] = keys >> col_bits & (1 << row_bits) - 1
    points[:, 1] = keys & (1 << col_bits) - 1
    offset = np.zeros(n_vertices + 1, np.int64)
    np.cumsum(np.bincount(of_point, minlength=n_vertices), out=offset[1:])
    return Hulls(*hulls_of_points(offset, points))
