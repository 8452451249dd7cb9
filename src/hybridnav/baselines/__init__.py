"""Topological and metric layers of other methods, behind one protocol."""

from hybridnav.baselines.regions import AnyAngleResult, CostClaim, Method, MethodResult

__all__ = ["AnyAngleResult", "CostClaim", "Method", "MethodResult"]
