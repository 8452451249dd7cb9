"""Contraction of a graph of corners into a hierarchy, and paths in it, for kernels."""

from hybridnav.search.kernels.contract import HEAD_SHIFT, contract, have_reverses, pack, renumbered
from hybridnav.search.kernels.unpack import NO_ARC, corners_between

__all__ = [
    "HEAD_SHIFT",
    "NO_ARC",
    "contract",
    "corners_between",
    "have_reverses",
    "pack",
    "renumbered",
]
