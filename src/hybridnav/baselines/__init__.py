"""Other methods' topological and metric layers, behind one protocol."""

from hybridnav.baselines.protocol import Answer, Method

__all__ = ["Answer", "Method"]
