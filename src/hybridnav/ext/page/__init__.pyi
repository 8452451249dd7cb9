from .page import Opening as Opening
from .page import save_page as save_page
from .command import serve as serve
from .session import Session as Session
from .site import Site as Site

__all__: list[str]
