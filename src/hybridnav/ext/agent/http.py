"""The table of functions as JSON over HTTP, on the server of the page, with its description."""

import base64
from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from hybridnav._version import __version__
from hybridnav.errors import HybridNavError
from hybridnav.ext.agent.answers import MapAnswers
from hybridnav.ext.agent.questions import INSTRUCTIONS, Answer, answered, schema_of, tools
from hybridnav.ext.page.page import RETRY, PreparingError
from hybridnav.ext.page.session import Session

_UNPROCESSABLE, _NOT_YET = 422, 503
_INSTRUCTIONS = INSTRUCTIONS.format(point="[x, y]")


class HttpTools:
    """The functions of the floors of a page.

    `session_of`: returns the session of the floor that a request names; `body_of`: returns the
    value of the body of a request, or the response that refuses it; `allow_edits`: whether what
    changes something is answered.
    """

    def __init__(
        self,
        session_of: Callable[[Request], Session],
        body_of: Callable[[Request], Any],
        *,
        allow_edits: bool = False,
    ) -> None:
        self._session_of, self._body_of, self._allow_edits = session_of, body_of, allow_edits
        self._answers: WeakKeyDictionary[Session, MapAnswers] = WeakKeyDictionary()

    def routes(self, at: str, floor: str) -> list[Route]:
        """Return the routes below the path of the page and that of a floor."""
        return [
            Route(f"{at}/openapi.json", self._described),
            Route(f"{floor}/api/{{name}}", self._called, methods=["POST"]),
        ]

    async def _described(self, _: Request) -> JSONResponse:
        return JSONResponse(description(allow_edits=self._allow_edits))

    async def _called(self, request: Request) -> Any:
        arguments = await self._body_of(request)
        if isinstance(arguments, Response):
            return arguments
        if not isinstance(arguments, dict):
            wrong = {"ok": False, "text": "expected a JSON object of arguments"}
            return JSONResponse(wrong, _UNPROCESSABLE)
        try:
            session = self._session_of(request)
        except HybridNavError as error:
            refused = {"ok": False, "text": str(error)}
            if isinstance(error, PreparingError):
                return JSONResponse(refused, _NOT_YET, headers=RETRY)
            return JSONResponse(refused, _UNPROCESSABLE)
        answers = self._answers.get(session)
        if answers is None:
            answers = MapAnswers(session, allow_edits=self._allow_edits)
            self._answers[session] = answers
        found = await answered(answers.call, request.path_params["name"], arguments)
        if "png" in found:
            found["png"] = base64.b64encode(found["png"]).decode()
        return JSONResponse(found, 200 if found["ok"] else _UNPROCESSABLE)


def description(*, allow_edits: bool = False) -> dict[str, Any]:
    """Return what there is to call, as OpenAPI describes it.

    `allow_edits`: whether that includes what changes something.

    Examples
    --------
    >>> from hybridnav.ext.agent.http import description
    >>> sorted(description()["paths"])[0]
    '/floor/{floor}/api/can_reach'
    """
    floor = {"name": "floor", "in": "path", "required": True, "schema": {"type": "integer"}}
    paths = {
        f"/floor/{{floor}}/api/{tool.name}": {
            "post": {
                "operationId": tool.name,
                "summary": " ".join((tool.asks.__doc__ or "").split()),
                "parameters": [floor],
                "requestBody": {"content": _content(tool.asks)},
                "responses": {
                    "200": {"description": "The answer.", "content": _content(tool.gives)},
                    "422": {"description": "What to do instead.", "content": _content(Answer)},
                    "503": {"description": "Not prepared yet.", "content": _content(Answer)},
                },
            }
        }
        for tool in tools(allow_edits=allow_edits)
    }
    info = {"title": "hybridnav", "version": __version__, "description": _INSTRUCTIONS}
    return {"openapi": "3.1.0", "info": info, "paths": paths}


def _content(model: type[BaseModel]) -> dict[str, Any]:
    """Return the OpenAPI content of a JSON body of this model, with its definitions inside."""
    return {"application/json": {"schema": schema_of(model)}}
