from .floors import BuildingSession as BuildingSession
from .opening import BuildingOpening as BuildingOpening, Opening as Opening
from .page import save_page as save_page
from .serving import serve as serve
from .session import Session as Session

__all__: list[str]
