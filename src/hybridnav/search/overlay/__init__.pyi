from .build import Overlay as Overlay, build_overlay as build_overlay
from .changes import PathsTooLongError as PathsTooLongError
from .search import (
    OverlayOptions as OverlayOptions,
    OverlayPath as OverlayPath,
    OverlaySearch as OverlaySearch,
    prepare_overlay as prepare_overlay,
)

__all__: list[str]
