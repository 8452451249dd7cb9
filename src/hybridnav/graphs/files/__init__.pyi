from .nav2 import export_nav2 as export_nav2

__all__: list[str]
