from .build import Overlay as Overlay, build_overlay as build_overlay
from .prepare import OverlayOptions as OverlayOptions, prepare_overlay as prepare_overlay
from .search import OverlayPath as OverlayPath, OverlaySearch as OverlaySearch
from .changes import PathsTooLongError as PathsTooLongError

__all__: list[str]
