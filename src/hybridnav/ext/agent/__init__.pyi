from .answers import MapAnswers as MapAnswers
from .building import BuildingAnswers as BuildingAnswers
from .questions import TOOLS as TOOLS, Tool as Tool
from .command import serve_stdio as serve_stdio

__all__: list[str]
