from .pyramid import OnlinePyramid as OnlinePyramid, Update as Update

__all__: list[str]
