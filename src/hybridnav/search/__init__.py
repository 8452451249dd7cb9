"""Searches: A* on cells, shortest distances inside fields, cheapest arcs."""
