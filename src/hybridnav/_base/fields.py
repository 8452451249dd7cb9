"""Shortest distances inside fields."""

from __future__ import annotations

from hybridnav._base.kernels.fields import field_distances

__all__ = ["field_distances"]
