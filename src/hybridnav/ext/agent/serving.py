"""The table of functions over the Model Context Protocol, by standard input and output."""

from __future__ import annotations

import asyncio
import base64
import json
from typing import TYPE_CHECKING, Any

from hybridnav._version import __version__
from hybridnav.errors import InvalidValueError
from hybridnav.ext.agent.questions import TOOLS

if TYPE_CHECKING:
    from hybridnav.ext.agent.answers import MapAnswers

LIMIT_S = 30.0
"""Seconds after which a call is answered with an error."""
INSTRUCTIONS = (
    "A map of a building for robots and people: rooms, doors, and shortest paths with a proof. "
    "Places are names of rooms or points [x, y] in metres. Begin with describe_map and list_rooms. "
    "An answer with ok=false says in `text` what to do, and in `choices` what a name may mean."
)


async def answered(answers: MapAnswers, name: str, arguments: dict[str, Any]) -> dict[str, Any]:
    """Answer a call in a thread, within its time."""
    call = asyncio.to_thread(answers.call, name, arguments)
    try:
        return await asyncio.wait_for(call, LIMIT_S)
    except asyncio.TimeoutError:
        return {"ok": False, "text": f"no answer within {LIMIT_S:g} s: ask again, and for less"}


def schema_of(asks: Any) -> dict[str, Any]:
    """Return the JSON schema of the arguments of a function."""
    schema: dict[str, Any] = asks.model_json_schema()
    schema.pop("description", None)
    return schema


def serve_stdio(answers: MapAnswers) -> None:
    """Answer a client of the Model Context Protocol on standard input and output, until it ends.

    Parameters
    ----------
    answers
        What answers.

    Raises
    ------
    InvalidValueError
        When the extra `agent` is not installed.

    Examples
    --------
    >>> from hybridnav.ext.agent import serve_stdio
    >>> serve_stdio.__name__  # it serves until its input ends
    'serve_stdio'
    """
    check_protocol()
    asyncio.run(_serve(answers))


def check_protocol() -> None:
    """Refuse to serve without the package of the protocol."""
    try:
        import mcp  # noqa: F401, PLC0415
    except ImportError:
        raise InvalidValueError(
            "the Model Context Protocol needs a package: pip install 'hybridnav[agent]'"
        ) from None


async def _serve(answers: MapAnswers) -> None:
    from mcp import types  # noqa: PLC0415 - an extra
    from mcp.server.lowlevel import Server  # noqa: PLC0415
    from mcp.server.stdio import stdio_server  # noqa: PLC0415

    listed = [
        types.Tool(
            name=tool.name,
            description=" ".join((tool.asks.__doc__ or "").split()),
            inputSchema=schema_of(tool.asks),
            outputSchema=tool.gives.model_json_schema(),
            annotations=types.ToolAnnotations(readOnlyHint=not tool.edits),
        )
        for tool in TOOLS
    ]

    async def list_tools(_: Any, __: Any) -> types.ListToolsResult:
        return types.ListToolsResult(tools=listed)

    async def call_tool(_: Any, asked: types.CallToolRequestParams) -> types.CallToolResult:
        found = await answered(answers, asked.name, asked.arguments or {})
        png = found.pop("png", None)
        content: list[Any] = [
            types.TextContent(
                type="text", text=json.dumps(found, allow_nan=False, ensure_ascii=False)
            )
        ]
        if png is not None:
            data = base64.b64encode(png).decode()
            content.append(types.ImageContent(type="image", data=data, mimeType="image/png"))
        return types.CallToolResult(
            content=content, structuredContent=found, isError=not found["ok"]
        )

    server: Server[Any] = Server(
        "hybridnav",
        version=__version__,
        instructions=INSTRUCTIONS,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())
