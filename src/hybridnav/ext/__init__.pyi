from . import fleet as fleet, live as live, page as page

__all__: list[str]
