"""`hybridnav serve`: a map as tools for programs that talk."""

from __future__ import annotations

import asyncio
import base64
import json
from typing import TYPE_CHECKING, Any

from hybridnav._version import __version__
from hybridnav.cli import options
from hybridnav.cli.reading import MapOptions, with_map
from hybridnav.errors import InvalidValueError
from hybridnav.ext.page.command import BuildingPage, EditsOption, MapPage

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.ext.agent.answers import MapAnswers
    from hybridnav.ext.agent.building import BuildingAnswers


@with_map(over_floors=lambda: _serve_over_floors)
def serve(
    map_file: options.MapOrBuildingArgument,
    rooms_file: options.RoomsOption = None,
    allow_edits: EditsOption = False,
    *,
    reading: MapOptions,
) -> None:
    """Serve MAP as tools of the Model Context Protocol on standard input and output.

    Programs ask for rooms, routes and reasons, and get small answers with proofs. Nothing is
    changed unless --allow-edits is given. MAP may be a building, whose floors answer together. The
    page of `hybridnav view` gives the same calls as JSON over HTTP. Ends with its input.
    """
    check_protocol()
    page = MapPage.read(map_file, rooms_file, options.parsed_costs(None), reading)
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.ext.agent.answers import MapAnswers  # noqa: PLC0415

    site = page.make(lambda _: None)
    serve_stdio(MapAnswers(site.sessions[0], allow_edits=allow_edits))


def _serve_over_floors(*, map_file: Path, allow_edits: bool, reading: MapOptions) -> None:
    """Serve a building; see `serve`."""
    check_protocol()
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.ext.agent.building import BuildingAnswers  # noqa: PLC0415

    site = BuildingPage(map_file, reading).make(lambda _: None)
    serve_stdio(BuildingAnswers(site, allow_edits=allow_edits))


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

    async def call_tool(_: Any, asked: types.CallToolRequestParams) -> types.CallToolResult:
        found = await answered(answers.call, asked.name, asked.arguments or {})
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
        instructions=answers.instructions,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())
