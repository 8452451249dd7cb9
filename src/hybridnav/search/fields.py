"""Shortest distances inside fields."""

from __future__ import annotations

from hybridnav.search._kernels import field_distances

__all__ = ["field_distances"]
