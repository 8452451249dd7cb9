"""Other methods' topological and metric layers, behind one protocol."""

from hybridnav.baselines.protocol import Answer, Line, Method

__all__ = ["Answer", "Line", "Method"]
