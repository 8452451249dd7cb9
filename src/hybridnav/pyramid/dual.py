"""The dual of a level: faces as dual vertices, boundaries as dual edges."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike

if TYPE_CHECKING:
    from hybridnav._base.typing import ByteArray, LongArray
    from hybridnav.pyramid import CombinatorialMap


class FaceKind(IntEnum):
    """Meaning of a dual vertex."""

    ORDINARY = 0
    """A meeting point of boundaries, or a boundary that closes into a ring."""
    PROTECTED = 1
    """A hole: occupied cells, with all that they wall off."""
    OUTSIDE = 2
    """The surroundings of a component of the graph; every component has one."""


@copies_alike
@dataclass(frozen=True, eq=False)
class DualGraph:
    """Dual of one level.

    Dual vertices are faces, numbered in the order of their first darts; dual edge a crosses arc a.
    """

    face_of: LongArray
    """int64 (2 n_arcs,), face on the right of each dart."""
    kinds: ByteArray
    """uint8 (n_faces,), `FaceKind`."""

    def __post_init__(self) -> None:
        self.face_of.flags.writeable = False
        self.kinds.flags.writeable = False

    @property
    def n_faces(self) -> int:
        """Faces; those of vertices without an arc are not counted."""
        return len(self.kinds)

    @property
    def edges(self) -> LongArray:
        """int64 (n_arcs, 2), the faces on the right of darts 2a and 2a + 1: the endpoints of the
        dual edge that crosses arc a."""
        return self.face_of.reshape(-1, 2)

    @classmethod
    def of_map(cls, darts: CombinatorialMap, outer_darts: LongArray) -> DualGraph:
        """Label the faces of a map.

        Parameters
        ----------
        darts
            The map.
        outer_darts
            One dart on the outer face of each component that has an arc.
        """
        face_of = darts.faces()
        kinds = np.full(int(face_of.max(initial=-1)) + 1, FaceKind.ORDINARY, dtype=np.uint8)
        kinds[face_of[darts.protected]] = FaceKind.PROTECTED
        kinds[face_of[outer_darts]] = FaceKind.OUTSIDE
        return cls(face_of, kinds)
