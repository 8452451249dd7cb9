from .build import Overlay as Overlay, build_overlay as build_overlay
from .changes import PathsTooLongError as PathsTooLongError
from .prepare import OverlayOptions as OverlayOptions, prepare_overlay as prepare_overlay
from .search import OverlayPath as OverlayPath, OverlaySearch as OverlaySearch

__all__: list[str]
