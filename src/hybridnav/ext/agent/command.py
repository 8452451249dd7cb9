"""`hybridnav serve`: a map as tools for programs that talk."""

from __future__ import annotations

from pathlib import Path

from hybridnav.cli import options
from hybridnav.cli.reading import MapOptions, with_map
from hybridnav.ext.page.command import EditsOption, MapPage


@with_map()
def serve(
    map_file: options.MapArgument[Path],
    rooms_file: options.RoomsOption = None,
    allow_edits: EditsOption = False,
    *,
    reading: MapOptions,
) -> None:
    """Serve MAP as tools of the Model Context Protocol on standard input and output.

    Programs ask for rooms, routes and reasons, and get small answers with proofs. Nothing is
    changed unless --allow-edits is given. The page of `hybridnav view` gives the same calls as
    JSON over HTTP. Ends with its input.
    """
    from hybridnav.ext.agent.serving import check_protocol, serve_stdio  # noqa: PLC0415

    check_protocol()
    page = MapPage.read(map_file, rooms_file, options.parsed_costs(None), reading)
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.ext.agent.answers import MapAnswers  # noqa: PLC0415

    site = page.make(lambda _: None)
    serve_stdio(MapAnswers(site.sessions[0], allow_edits=allow_edits))
