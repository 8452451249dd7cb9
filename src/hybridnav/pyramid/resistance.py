"""Boundaries that resist contraction: the levels above the places, steered by clearance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import _field_kernels, _steering_kernels
from hybridnav.pyramid._kernels import ATTRIBUTE_MAX

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.combinatorial.darts import Darts
    from hybridnav.pyramid._kernels import Vertices


@copies_alike
@dataclass(frozen=True, eq=False)
class Resistance:
    """The rule by which an arc resists: its boundary is narrow against both fields that it joins.

    The width of an arc is the greatest clearance along its boundary, the peak of a vertex the
    greatest clearance in its field. An arc is contracted while its width is at least a share of the
    lower of its two peaks, the widest arcs first. Peaks only grow, so that a door resists once both
    rooms have grown to it, at every level from there to the apex. These are the saddles and peaks
    of a watershed, on the arcs of a level: two doors between the same rooms are judged one by one.

    Parameters
    ----------
    clearance
        float64 (rows, cols), finite, >= 0, any unit.
    share
        In (0, 1].

    Raises
    ------
    InvalidValueError
        When the clearance has another shape, is not finite or negative, or the share is not in
        that range.

    Examples
    --------
    >>> from hybridnav.pyramid import Resistance
    >>> grid = hn.example_map("figure1")
    >>> resistance = Resistance(np.ones(grid.shape), share=0.7)
    >>> hn.DualGraphPyramid.build(grid, resistance=resistance)[-1].n_vertices
    3
    """

    clearance: FloatArray
    share: float

    def __post_init__(self) -> None:
        if not 0 < self.share <= 1:
            raise InvalidValueError(f"share must be above 0 and at most 1, got {self.share}")
        try:
            clearance = np.array(self.clearance, dtype=np.float64)
        except (TypeError, ValueError):
            raise InvalidValueError("clearance must be an array of numbers (rows, cols)") from None
        if clearance.ndim != 2:  # noqa: PLR2004
            raise InvalidValueError(f"clearance must be (rows, cols), got {clearance.shape}")
        if not (np.isfinite(clearance) & (clearance >= 0)).all():
            raise InvalidValueError("clearance must be finite and >= 0 in every cell")
        clearance.flags.writeable = False
        object.__setattr__(self, "clearance", clearance)

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns of the clearance."""
        return self.clearance.shape

    @property
    def kept_apart(self) -> None:
        """None: places are those of a pyramid without resistance."""
        return

    def steering(self, field_of: IntArray, n_vertices: int) -> Resisting:
        """Return the steering from a level on; see `Resists`."""
        return Resisting(self, field_of, n_vertices)

    def peaks(self, field_of: IntArray, n_vertices: int) -> FloatArray:
        """Return the greatest clearance in each field, float64 (n_vertices,).

        Parameters
        ----------
        field_of
            int32 (n_cells,), -1 for none.
        n_vertices
            Number of fields.
        """
        inside = field_of >= 0
        peaks = np.zeros(n_vertices)
        np.maximum.at(peaks, field_of[inside], self.clearance.ravel()[inside])
        return peaks

    def widths(self, field_of: IntArray, base_edges: IntArray) -> FloatArray:
        """Return the greatest clearance along each arc's boundary, float64 (n_arcs,).

        The lower clearance of the two cells of a crack counts. Self-loops have 0.

        Parameters
        ----------
        field_of
            int32 (n_cells,), -1 for none.
        base_edges
            int (n_arcs,), the base edge that represents each arc.
        """
        rows, cols = self.clearance.shape
        cracks, classes = _field_kernels.find_cracks(field_of, rows, cols)
        clearance = self.clearance.ravel()
        first = cracks >> 1
        second = first + np.where(cracks & 1, cols, 1)
        widest = np.zeros(len(cracks))
        np.maximum.at(widest, classes, np.minimum(clearance[first], clearance[second]))
        at = np.searchsorted(cracks, base_edges)
        plain = np.append(cracks, -1)[at] == base_edges
        widths = np.zeros(len(base_edges))
        widths[plain] = widest[classes[at[plain]]]
        return widths


class Resisting:
    """A steering by resistance; see `Steering`.

    Parameters
    ----------
    resistance
        The rule.
    field_of
        int32 (n_cells,), the vertex of each cell at the level to start from, -1 for none.
    n_vertices
        Vertices of that level.
    """

    def __init__(self, resistance: Resistance, field_of: IntArray, n_vertices: int) -> None:
        self._resistance = resistance
        self._peaks = resistance.peaks(field_of, n_vertices)
        self._widths = np.empty(0)

    def candidates(
        self, field_of: Callable[[], IntArray], darts: Darts, vertices: Vertices
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that do not resist, and the narrowness of each."""
        widths = self._widths = self._resistance.widths(field_of(), darts.base_edge)
        u, v = darts.origin[::2], darts.origin[1::2]
        lower = np.minimum(self._peaks[u], self._peaks[v])
        kinds = vertices.classes
        may = (u != v) & (kinds[u] == kinds[v]) & (widths >= self._resistance.share * lower)
        arcs, widest = np.flatnonzero(may), widths.max(initial=0.0)
        narrowness = 1.0 - widths[arcs] / widest if widest > 0 else np.ones(len(arcs))
        return arcs, (ATTRIBUTE_MAX * narrowness).astype(np.int64)

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo the joins of stars that would merge two rooms through the threshold between them."""
        leaves = np.flatnonzero(kernel_dart >= 0)
        widths = self._widths[kernel_dart[leaves] >> 1]
        leaves = leaves[np.argsort(-widths, kind="stable")]
        _steering_kernels.refuse_narrow_leaves(
            leaves, parent, kernel_dart, self._widths, self._peaks, self._resistance.share
        )

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        """Let each vertex of the next level have the highest peak of its sons."""
        peaks = np.zeros(n_vertices)
        np.maximum.at(peaks, merged_into, self._peaks)
        self._peaks = peaks
