"""`hybridnav serve`: a map as tools for programs that talk."""

from __future__ import annotations

import asyncio
import base64
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hybridnav._version import __version__
from hybridnav.cli import options
from hybridnav.cli.map_options import FloorOptions
from hybridnav.cli.options import OneMap
from hybridnav.errors import InvalidValueError
from hybridnav.ext.page.command import BuildingPage, EditsOption, MapPage

if TYPE_CHECKING:
    from hybridnav.ext.agent.answers import MapAnswers
    from hybridnav.ext.agent.building import BuildingAnswers


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ServeOptions(FloorOptions):
    """The options of `hybridnav serve`."""

    rooms_file: OneMap[options.RoomsOption] = None
    allow_edits: EditsOption = False


def serve(args: ServeOptions) -> None:
    """Serve MAP as tools of the Model Context Protocol.

    They are called on standard input and output. Programs ask for rooms, routes and reasons, and
    get small answers with proofs. Nothing is changed unless --allow-edits is given. MAP may be a
    building, whose floors answer together. The page of `hybridnav view` gives the same calls as
    JSON over HTTP. Ends with its input.

    Example: hybridnav serve maps/office/office.yaml
    """
    check_protocol()
    # They load numba, which help and wrong usage can do without.
    from hybridnav.ext.agent.answers import MapAnswers  # noqa: PLC0415
    from hybridnav.ext.agent.building import BuildingAnswers  # noqa: PLC0415

    page = (
        BuildingPage(args)
        if args.is_building
        else MapPage.read(args, args.rooms_file, options.parsed_costs(None))
    )
    site = page.make(lambda _: None)
    edits = args.allow_edits
    answers = (
        BuildingAnswers(site, allow_edits=edits)
        if args.is_building
        else MapAnswers(site.sessions[0], allow_edits=edits)
    )
    serve_stdio(answers)


# The Model Context Protocol, by standard input and output.


def serve_stdio(answers: MapAnswers | BuildingAnswers) -> None:
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


async def _serve(answers: MapAnswers | BuildingAnswers) -> None:
    from mcp import types  # noqa: PLC0415 - an extra
    from mcp.server.lowlevel import Server  # noqa: PLC0415
    from mcp.server.stdio import stdio_server  # noqa: PLC0415

    from hybridnav.ext.agent.questions import answered, schema_of  # noqa: PLC0415

    listed = [
        types.Tool(
            name=tool.name,
            description=" ".join((tool.asks.__doc__ or "").split()),
            inputSchema=schema_of(tool.asks),
            outputSchema=tool.gives.model_json_schema(),
            annotations=types.ToolAnnotations(readOnlyHint=not tool.edits),
        )
        for tool in answers.tools
    ]

    async def list_tools(_: Any, __: Any) -> types.ListToolsResult:
        return types.ListToolsResult(tools=listed)

    async def call_tool(_: Any, params: types.CallToolRequestParams) -> types.CallToolResult:
        reply = await answered(answers.call, params.name, params.arguments or {})
        png = reply.pop("png", None)
        content: list[Any] = [
            types.TextContent(
                type="text", text=json.dumps(reply, allow_nan=False, ensure_ascii=False)
            )
        ]
        if png is not None:
            data = base64.b64encode(png).decode()
            content.append(types.ImageContent(type="image", data=data, mimeType="image/png"))
        return types.CallToolResult(
            content=content, structuredContent=reply, isError=not reply["ok"]
        )

    server: Server[Any] = Server(
        "hybridnav",
        version=__version__,
        instructions=answers.instructions,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())
