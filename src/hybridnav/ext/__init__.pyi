from . import fleet as fleet, graphs as graphs, live as live, page as page

__all__: list[str]
