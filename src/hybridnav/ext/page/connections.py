"""Connections of the page's server: few at once, and none that waits for its request for long."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

if TYPE_CHECKING:
    import asyncio

    from starlette.types import ASGIApp

MOST_CONNECTIONS = 64
"""Connections at once; a browser opens six. With as many that wait to be accepted they are fewer
than the files that a process may open anywhere."""
REQUEST_S = 10.0
"""Seconds in which a whole request must come, its head and its body."""


class Connection(H11Protocol):
    """A connection that ends if its request does not come in time, or if it waits for the rest of
    one for longest when there are too many."""

    _due: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Take a connection, and end another if it is one too many."""
        super().connection_made(transport)
        self._watch()
        if len(self.connections) > MOST_CONNECTIONS:
            others = [one for one in self.connections if isinstance(one, Connection)]
            min(others, key=lambda one: one.ends_at).end()

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget a connection."""
        self._stop()
        super().connection_lost(exc)

    @property
    def ends_at(self) -> float:
        """When the rest of its request is due; infinite while the request is answered."""
        return math.inf if self._due is None else self._due.when()

    def end(self) -> None:
        """End the connection at once, without an answer."""
        self._stop()
        self.connections.discard(self)
        self.transport.abort()

    def _watch(self) -> None:
        """Give the request its time when it begins, and stop the clock when it is whole."""
        if self.conn.their_state not in {h11.IDLE, h11.SEND_BODY} or self.transport.is_closing():
            self._stop()
        elif self._due is None:
            self._due = self.loop.call_later(REQUEST_S, self.end)

    def _stop(self) -> None:
        if self._due is not None:
            self._due.cancel()
            self._due = None


def make_server(app: ASGIApp) -> uvicorn.Server:
    """Return a server of an application; its `run` takes the sockets that it listens on."""
    config = uvicorn.Config(
        app,
        http=Connection,
        backlog=MOST_CONNECTIONS,
        lifespan="off",
        ws="none",
        log_level="error",
        access_log=False,
        server_header=False,
    )
    return uvicorn.Server(config)
