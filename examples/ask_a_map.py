"""Ask a map over the Model Context Protocol, as a language model would, without one.

Run `python examples/ask_a_map.py MAP`: it starts `hybridnav serve MAP` and prints what it is told.
Needs `pip install 'hybridnav[agent]'`.
"""

import asyncio
import os
import sys
from typing import Any

from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client


async def main(map_file: str) -> None:
    """Ask about the two largest rooms of a map or a building."""
    words = ["-m", "hybridnav", "serve", map_file, "--robot-radius", "0.25"]
    server = StdioServerParameters(command=sys.executable, args=words, env=dict(os.environ))
    async with stdio_client(server) as streams, ClientSession(*streams) as client:
        await client.initialize()

        async def ask(tool: str, **arguments: Any) -> Any:
            answer: Any = (await client.call_tool(tool, arguments)).structured_content
            print(f"{tool}: {answer['text']}")
            return answer

        await ask("describe_map")
        rooms = (await ask("list_rooms", count=100))["rooms"]
        rooms.sort(key=lambda room: -room["area_m2"])
        start, goal = (f"{one.get('floor', '')}:{one['name']}".lstrip(":") for one in rooms[:2])
        route = await ask("route", start=start, goal=goal)
        print(*route.get("words", ()), sep="\n")
        await ask("can_reach", start=start, goal=goal, width=1.2)
        await ask("explain", start=start, goal=goal, width=5)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
