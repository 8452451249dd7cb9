"""The agreement of found rooms with true ones."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError


@dataclass(frozen=True, eq=False)
class RoomAgreement:
    """Agreement of found rooms with true ones, each with at most one partner."""

    true_labels: LongArray
    """Labels of the true rooms that were compared, ascending."""
    partners: LongArray
    """The found label that is the partner of each true room, -1 for none."""
    precision: FloatArray
    """Share of the partner's cells that lie in the true room; 0 without a partner."""
    recall: FloatArray
    """Share of the true room's cells that lie in the partner; 0 without one."""
    mcc: float
    """Matthews correlation over all cells and rooms, from -1 to 1; NaN if either side is one single
    room."""
    mcc_per_zone: float
    """Mean of the binary Matthews correlations of single rooms, from -1 to 1, as MAORIS measures
    it."""
    iou: FloatArray
    """Greatest intersection over union of each true room with any found one."""
    n_found: int
    """Number of found rooms with compared cells."""

    def recall_at(self, iou: float) -> float:
        """Return the share of true rooms that a found room meets with at least this intersection
        over union, in [0, 1]."""
        return float((self.iou >= iou).mean())


def compare_rooms(true: AnyArray, found: AnyArray) -> RoomAgreement:
    """Compare found rooms with true ones, cell by cell.

    Partners are chosen one to one so that most cells agree; a split room counts with its largest
    part alone, and the other parts are classes of their own. For the coefficient for many classes
    see J. Gorodkin: Comparing two K-category assignments by a K-category correlation coefficient,
    2004. For the one of single rooms see `mcc_per_zone`.

    Parameters
    ----------
    true, found
        Integer labels of the same cells, shape (n,), n >= 1; -1 in `found` for no room.

    Returns
    -------
    RoomAgreement
        Precision and recall of each true room, and the coefficient.

    Raises
    ------
    InvalidValueError
        When the shapes differ or there are no cells.

    Examples
    --------
    >>> from research._rooms_agreement import compare_rooms
    >>> compare_rooms(np.array([0, 0, 0, 1]), np.array([5, 5, 6, 6])).partners
    array([5, 6])
    """
    if true.shape != found.shape or true.ndim != 1 or len(true) == 0:
        raise InvalidValueError(
            f"expected labels of the same cells, got shapes {true.shape} and {found.shape}"
        )
    true_labels, row = np.unique(true, return_inverse=True)
    found_labels, col = np.unique(found, return_inverse=True)
    cells = np.zeros((len(true_labels), len(found_labels)))
    np.add.at(cells, (row, col), 1)
    # "No room" is never a partner.
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
        mcc_per_zone(cells[:, found_labels >= 0]),
        _best_iou(cells, found_labels >= 0),
        int((found_labels >= 0).sum()),
    )


def mcc_per_zone(cells: FloatArray) -> float:
    """Return the mean of the binary Matthews correlations of single rooms.

    Found rooms choose partners greedily, the one with the largest overlap first, each the free true
    room that it overlaps most. A room of either side without a partner counts 0. See M. Mielle, M.
    Magnusson, A. J. Lilienthal: A method to segment maps from different modalities using free space
    layout: MAORIS, ICRA 2018. Their published program differs in three points, which are mended
    here: it counts the true negatives as n - fp + tp + fn instead of n - tp - fp - fn, it lets a
    found room whose true rooms are all taken share the last of them, and it counts a true room
    without a partner once for each found room that touches it.

    `cells`: float64 (n_true, n_found), number of cells in each pair of rooms, n_true >= 1. Result:
    from -1 to 1; 0 when no room was found.
    """
    left = cells.copy()
    total, n_partners, n = 0.0, 0, cells.sum()
    of_true, of_found = cells.sum(axis=1), cells.sum(axis=0)
    for col in np.argsort(-cells.max(axis=0), kind="stable").tolist():
        row = int(left[:, col].argmax())
        tp = left[row, col]
        if tp == 0:
            continue
        left[row] = 0
        n_partners += 1
        fp, fn = of_found[col] - tp, of_true[row] - tp
        tn = n - tp - fp - fn
        spread = math.sqrt((tp + fp) * (tp + fn) * (tn + fp) * (tn + fn))
        total += (tp * tn - fp * fn) / spread if spread > 0 else float(fp == fn == 0)
    return float(total / (sum(cells.shape) - n_partners))


def _best_iou(cells: FloatArray, is_room: BoolArray) -> FloatArray:
    """Return the greatest intersection over union of each row with any column that is a room."""
    union = cells.sum(axis=1)[:, None] + cells.sum(axis=0) - cells
    return np.where(is_room, cells / union, 0.0).max(axis=1)
