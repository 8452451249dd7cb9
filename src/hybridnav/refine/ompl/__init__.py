"""Refinement by OMPL's sampling-based planners, in a process of its own.

I. Sucan, M. Moll, L. Kavraki: The Open Motion Planning Library, 2012. Only the worker process
imports `ompl`; this package works without it up to the first query.
"""

from hybridnav.refine.ompl.messages import Query, Reply, Search, Setup, Worker, require_ompl
from hybridnav.refine.ompl.search_area import Clearance

__all__ = ["Clearance", "Query", "Reply", "Search", "Setup", "Worker", "require_ompl"]
