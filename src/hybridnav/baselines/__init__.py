"""Topological and metric layers of other methods, behind one protocol."""

from hybridnav.baselines.protocol import AnyAngleResult, Method, MethodResult

__all__ = ["AnyAngleResult", "Method", "MethodResult"]
