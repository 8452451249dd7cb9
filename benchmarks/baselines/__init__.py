"""Baselines of the study alone: HPA* on clusters of cells, and Thrun's regions."""
