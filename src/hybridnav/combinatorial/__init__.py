"""Plane graphs as permutations of darts, contraction and removal on them."""

from hybridnav.combinatorial.maps import CombinatorialMap

__all__ = ["CombinatorialMap"]
