"""How well found rooms agree with true ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, FloatArray, LongArray


@dataclass(frozen=True, eq=False)
class RoomAgreement:
    """Found rooms against true ones, each true room with at most one found room as its partner."""

    true_labels: LongArray
    """Labels of the true rooms that were compared, ascending."""
    partners: LongArray
    """The found label that is each one's partner, -1 for none."""
    precision: FloatArray
    """Share of the partner's cells that lie in the true room; 0 without a partner."""
    recall: FloatArray
    """Share of the true room's cells that lie in the partner; 0 without one."""
    mcc: float
    """Matthews correlation over all cells and rooms, from -1 to 1; NaN where either side is one
    single room."""
    n_found: int
    """Found rooms that hold compared cells."""


def compare_rooms(true: AnyArray, found: AnyArray) -> RoomAgreement:
    """Set found rooms against true ones, cell by cell.

    Partners are chosen one to one so that most cells agree; a room that is split counts with its
    largest part alone, and the others are classes of their own. The coefficient for many classes is
    that of J. Gorodkin: Comparing two K-category assignments by a K-category correlation
    coefficient, 2004.

    Parameters
    ----------
    true, found
        Integer labels of the same cells, shape (n,), n >= 1; -1 in `found` for no room.

    Raises
    ------
    InvalidValueError
        When the shapes differ or there are no cells.
    """
    if true.shape != found.shape or true.ndim != 1 or len(true) == 0:
        raise InvalidValueError(
            f"expected labels of the same cells, got shapes {true.shape} and {found.shape}"
        )
    true_labels, row = np.unique(true, return_inverse=True)
    found_labels, col = np.unique(found, return_inverse=True)
    cells = np.zeros((len(true_labels), len(found_labels)))
    np.add.at(cells, (row, col), 1)
    # No room is nobody's partner.
    wanted = np.where(found_labels[None, :] < 0, -1.0, cells)
    rows, cols = linear_sum_assignment(-wanted)
    real = wanted[rows, cols] > 0
    rows, cols = rows[real], cols[real]
    of_true, of_found = cells.sum(axis=1), cells.sum(axis=0)
    agree = cells[rows, cols]
    partners = np.full(len(true_labels), -1, dtype=np.int64)
    partners[rows] = found_labels[cols]
    precision, recall = np.zeros(len(true_labels)), np.zeros(len(true_labels))
    precision[rows] = agree / of_found[cols]
    recall[rows] = agree / of_true[rows]
    n = float(len(true))
    covariance = agree.sum() * n - (of_true[rows] * of_found[cols]).sum()
    spread = math.sqrt(n * n - (of_true**2).sum()) * math.sqrt(n * n - (of_found**2).sum())
    return RoomAgreement(
        true_labels.astype(np.int64),
        partners,
        precision,
        recall,
        float(covariance / spread) if spread > 0 else math.nan,
        int((found_labels >= 0).sum()),
    )
