"""The server of the page: few connections, checked requests in, JSON, tiles and files out."""

from __future__ import annotations

import json
import math
import secrets
from typing import TYPE_CHECKING, Any

import h11
import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from uvicorn.protocols.http.h11_impl import H11Protocol

from hybridnav._base.extension import extension
from hybridnav.errors import HybridNavError, InvalidValueError, MapError
from hybridnav.ext.page import page as pages
from hybridnav.ext.page import requests as ask
from hybridnav.ext.page.drawing import GRID
from hybridnav.ext.page.kept import Finder
from hybridnav.ext.page.session import ConflictError, Session

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable
    from pathlib import Path

    from pydantic import BaseModel
    from starlette.types import ASGIApp, Receive, Scope, Send

    from hybridnav.ext.page.site import Site
    from hybridnav.ext.page.tiles import Theme

_OPTIMUM = {"preset": GRID, "brief": True}
_MOST_BYTES = 2_000_000
"""Size of a request's body."""
_HEADERS = (
    (b"content-security-policy", pages.POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"x-frame-options", b"DENY"),
)
_FORBIDDEN, _TOO_LARGE, _WRONG_KIND, _UNPROCESSABLE, _CONFLICT, _FULL, _NOT_YET = (
    *(403, 413, 415, 422, 409, 507, 503),
)


class Guard:
    """What answers only the page itself: its token, its host, its origin.

    A page of another site knows no token, and a name that points to 127.0.0.1 is not a host of
    this server.
    """

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app = app
        self._prefix = f"/{token}/".encode()
        self._hosts = {f"{name}:{port}".encode() for name in ("127.0.0.1", "localhost")}
        self._origins = {b"http://" + host for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return

        async def send_safely(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        refusal = self._refusal(scope) if scope["type"] == "http" else "no such protocol"
        if refusal is not None:
            await _error(refusal, _FORBIDDEN)(scope, receive, send_safely)
            return
        await self._app(scope, receive, send_safely)

    def _refusal(self, scope: Scope) -> str | None:
        headers: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.lower(), []).append(value)
        raw: bytes = scope.get("raw_path") or scope["path"].encode()
        given = raw[: len(self._prefix)]
        if not secrets.compare_digest(given, self._prefix):
            return "the address has no valid token: open the address that the command printed"
        hosts = headers.get(b"host", [])
        if len(hosts) != 1 or hosts[0].lower() not in self._hosts:
            return "wrong host"
        if any(origin not in self._origins for origin in headers.get(b"origin", [])):
            return "wrong origin"
        if headers.get(b"sec-fetch-site", [b"none"])[0] not in {b"same-origin", b"none"}:
            return "wrong site"
        return None


def make_app(
    shown: Site | pages.Opening, *, token: str, port: int, folder: Path, allow_edits: bool = False
) -> ASGIApp:
    """Return the application of a page.

    `shown`: what it shows: a site, or one that is still being prepared; `token`: the first part of
    every path; `port`: the port on 127.0.0.1; `folder`: the only folder in which anything is
    written; `allow_edits`: whether programs may change what others see, as people may on the page.
    """
    at = f"/{token}"
    routes = [
        Route(f"{at}/", _get(lambda _: pages.live_page(), "text/html")),
        *(Route(f"{at}/{name}", _get(_asset_reader(name), kind)) for name, kind in pages.ASSETS),
        *_Answers(shown, folder).routes(at, allow_edits=allow_edits),
    ]
    return Guard(Starlette(routes=routes), token, port)


class _Answers:
    """What each request does."""

    def __init__(self, shown: Site | pages.Opening, folder: Path) -> None:
        self._shown, self._folder, self._finder = shown, folder, Finder(folder)

    def routes(self, at: str, *, allow_edits: bool) -> list[Route]:
        """Return the routes below a path: those of the whole site, and those of its floors."""
        floor, on = f"{at}/floor/{{floor}}", self._session
        tools = extension("formats", "tools").HttpTools(
            self._session, _body, allow_edits=allow_edits
        )
        gets: dict[str, Callable[[Request], Any]] = {
            f"{at}/map.json": lambda _: self._shown.describe(),
            f"{at}/state.json": lambda _: self._shown.state(),
            f"{at}/closed.json": lambda _: self._site.changes(),
            f"{floor}/map.json": lambda request: self._floor(request).describe(),
            f"{floor}/rooms.json": lambda request: on(request).describe_rooms(),
            f"{floor}/outlines.json": lambda request: on(request).outlines(),
            f"{floor}/graph/{{level}}.json": lambda one: on(one).graph(one.path_params["level"]),
            f"{floor}/costs/{{preset}}.json": lambda one: on(one).costs(one.path_params["preset"]),
        }
        posts: dict[str, tuple[Any, ...]] = {
            f"{at}/plan": (lambda _, query: self._planned(query), ask.PlanQuery),
            f"{at}/optimum": (lambda _, query: self._planned(query, **_OPTIMUM), ask.PlanQuery),
            f"{at}/closed": (
                lambda _, change: self._site.closings.describe(change),
                ask.ClosingChange,
            ),
            f"{at}/alternatives": (
                lambda _, query: self._site.routes(query).alternatives(query),
                ask.AlternativesQuery,
            ),
            f"{at}/find": (lambda _, asked: self._finder.find(self._site.named, asked), ask.Find),
            f"{at}/favour": (
                lambda _, asked: self._finder.favour(self._site.named, asked),
                ask.Favour,
            ),
            f"{floor}/stand": (lambda request, asked: on(request).stand(asked), ask.Stand),
            f"{floor}/at": (lambda request, asked: on(request).room_at(asked), ask.At),
            f"{floor}/edit": (lambda request, asked: on(request).edit(asked), ask.Edit),
            f"{floor}/undo": (lambda request, asked: on(request).undo(asked.version), ask.Undo),
            f"{floor}/save": (lambda request, asked: on(request).save(asked), ask.Save),
            f"{at}/export/{{kind}}": (self._export,),
            f"{floor}/export/{{kind}}": (self._export_floor,),
        }
        tile = f"{floor}/tile/{{layer}}/{{zoom}}/{{row}}/{{col}}.png"
        return [
            Route(tile, _get(self._tile, "image/png")),
            *(Route(path, _get(answer)) for path, answer in gets.items()),
            *(Route(path, _post(*each), methods=["POST"]) for path, each in posts.items()),
            *tools.routes(at, floor),
        ]

    @property
    def _site(self) -> Site:
        return self._shown.site

    def _floor(self, request: Request) -> Any:
        return self._shown.floor(request.path_params["floor"])

    def _session(self, request: Request) -> Session:
        """Return the session of the floor in an address, once it is there."""
        return self._site.floor(request.path_params["floor"])

    def _planned(self, query: ask.PlanQuery, **update: Any) -> dict[str, Any]:
        return self._site.routes(query).plan(query.model_copy(update=update))

    def _export(self, request: Request, value: Any) -> tuple[str, bytes]:
        site, query = self._site, ask.checked(ask.PartQuery, value) if value else None
        return pages.exported(site, request.path_params["kind"], query, self._folder)

    def _export_floor(self, request: Request, _: Any) -> tuple[str, bytes]:
        return pages.exported_floor(
            self._session(request), request.path_params["kind"], self._folder
        )

    def _tile(self, request: Request) -> bytes:
        place = request.path_params
        numbers = [place[name] for name in ("zoom", "row", "col")]
        if not all(n.isascii() and n.isdigit() and len(n) < 8 for n in numbers):  # noqa: PLR2004
            raise InvalidValueError("a tile has three whole numbers")
        zoom, row, col = map(int, numbers)
        theme: Theme = "dark" if request.query_params.get("theme") == "dark" else "light"
        return self._floor(request).layer(place["layer"]).png(zoom, row, col, theme)


def _error(message: str, code: int) -> JSONResponse:
    return JSONResponse({"error": message}, status_code=code)


async def _done(work: Callable[[], Any]) -> Any:
    """Return what work returns, or the response that states why it does not."""
    try:
        return await run_in_threadpool(work)
    except ConflictError as error:
        return _error(str(error), _CONFLICT)
    except pages.PreparingError as error:
        return JSONResponse({"error": str(error)}, _NOT_YET, headers=pages.RETRY)
    except MapError as error:
        return _error(str(error), _FULL)
    except HybridNavError as error:
        return _error(str(error), _UNPROCESSABLE)
    except OSError as error:
        return _error(f"cannot write: {error.strerror}", _FULL)


def _asset_reader(name: str) -> Callable[[Any], str]:
    return lambda _: pages.asset(name)


def _get(read: Callable[[Request], Any], kind: str | None = None) -> Any:
    """Return what answers with content of a kind, None for JSON."""

    async def answer(request: Request) -> Response:
        return _response(await _done(lambda: read(request)), kind)

    return answer


def _post(act: Callable[[Request, Any], Any], kind: type[BaseModel] | None = None) -> Any:
    """Return what answers a value, of a kind of requests if one is given."""

    async def answer(request: Request) -> Response:
        value = await _body(request)
        if isinstance(value, Response):
            return value

        def act_on_checked() -> Any:
            return act(request, value if kind is None else ask.checked(kind, value))

        return _response(await _done(act_on_checked))

    return answer


def _response(content: Any, kind: str | None = None) -> Response:
    """Return the response with JSON, content of another kind, or a file by its name and content."""
    if isinstance(content, Response):
        return content
    if kind is not None:
        return Response(content, media_type=kind, headers={"cache-control": "no-cache"})
    headers = {"cache-control": "no-store"}
    if not isinstance(content, tuple):
        return JSONResponse(content, headers=headers)
    headers["content-disposition"] = f'attachment; filename="{content[0]}"'
    return Response(content[1], media_type="application/octet-stream", headers=headers)


async def _body(request: Request) -> Any:
    """Return the value of a request's body, or the response that refuses it."""
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        return _error("expected application/json", _WRONG_KIND)
    body = b""
    try:
        async for part in request.stream():
            body += part
            if len(body) > _MOST_BYTES:
                return _error(f"more than {_MOST_BYTES} bytes", _TOO_LARGE)
    except ClientDisconnect:
        return Response()  # nobody is there to read it
    try:
        return json.loads(body)
    except (ValueError, RecursionError):
        return _error("expected JSON", _UNPROCESSABLE)


# Connections: few at once, and none that waits for its request for long.

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
