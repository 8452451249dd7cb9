"""Topological and metric layers of other methods, behind one protocol."""

from hybridnav.baselines.protocol import Answer, Line, Method

__all__ = ["Answer", "Line", "Method"]
