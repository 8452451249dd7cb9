"""The server on 127.0.0.1."""

from __future__ import annotations

import secrets
import socket
from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.ext.page.opening import Opening

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hybridnav.ext.page.site import Site


def serve(
    shown: Site | Opening,
    folder: Path,
    *,
    port: int = 0,
    allow_edits: bool = False,
    ready: Callable[[str], object] | None = None,
) -> None:
    """Serve a page on 127.0.0.1 until Ctrl-C.

    Parameters
    ----------
    shown
        The content of the page: a site, or one that is prepared meanwhile.
    folder
        The only folder in which anything is written.
    port
        The port; 0 for a free one.
    allow_edits
        Whether programs that call the server may change the map for others, as people may.
    ready
        Called with the address, which holds a token that nobody can guess.

    Raises
    ------
    InvalidValueError
        When the port is taken or out of range, or the extra `view` is not installed.
    HybridNavError
        When the map cannot be prepared.

    Examples
    --------
    >>> from contextlib import suppress
    >>> from pathlib import Path
    >>> from hybridnav.ext.page import Session, Site, serve
    >>> grid = hn.example_map("figure1")
    >>> hn.save(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> site = Site.of_map(Session(model, topology, model.fitted(None)))
    >>> def ready(address):
    ...     print(address[:17])
    ...     raise KeyboardInterrupt  # as Ctrl-C does
    >>> with suppress(KeyboardInterrupt):
    ...     serve(site, Path(), ready=ready)
    http://127.0.0.1:
    """
    try:
        from hybridnav.ext.page.app import (  # noqa: PLC0415 - an extra
            MOST_CONNECTIONS,
            make_app,
            make_server,
        )
    except ModuleNotFoundError as error:
        raise InvalidValueError(
            f"the page needs the package {error.name}, which is not installed: "
            "pip install 'hybridnav[view]'"
        ) from None
    token = secrets.token_urlsafe(24)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", "expected one from 0 to 65535")
            raise InvalidValueError(f"port {port} cannot be used: {reason}") from None
        listening.listen(MOST_CONNECTIONS)
        port = listening.getsockname()[1]
        app = make_app(shown, token=token, port=port, folder=folder, allow_edits=allow_edits)
        server = make_server(app)
        opening = shown if isinstance(shown, Opening) else None
        if opening is not None:
            opening.begin(on_failure=lambda: setattr(server, "should_exit", True))
        if ready is not None:
            ready(f"http://127.0.0.1:{port}/{token}/")
        server.run(sockets=[listening])
    if opening is not None and opening.problem is not None:
        raise opening.problem
