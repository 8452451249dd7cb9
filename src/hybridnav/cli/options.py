"""Arguments and options that several commands take."""

from pathlib import Path
from typing import Annotated

import typer

MapArgument = Annotated[
    Path,
    typer.Argument(metavar="MAP", help="ROS map (.yaml), MovingAI map (.map) or model (.hnm)."),
]
MapOrBuildingArgument = Annotated[
    Path,
    typer.Argument(
        metavar="MAP",
        help="ROS map (.yaml), MovingAI map (.map) or model (.hnm), or a building of several "
        "floors (.yaml or .hnm).",
    ),
]
PresetOption = Annotated[
    str | None,
    typer.Option(
        "--preset",
        metavar="NAME|FILE",
        help="A preset's name or its YAML file; else the model's.",
        show_default="shortest",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override one key, e.g. planner.corridor=route."
    ),
]
RadiusOption = Annotated[
    float | None,
    typer.Option(
        "--robot-radius", metavar="R", help="Robot radius in metres; else the model's or preset's."
    ),
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed", metavar="N", help="Seed of the pyramid; else the model's or the preset's."
    ),
]
PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Draw a picture: .png, .pdf or .svg.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
SmoothOption = Annotated[
    str | None,
    typer.Option(
        "--smooth",
        metavar="HOW",
        help="Shorten the path: none, line-of-sight, or by costs arcs; else the preset's.",
    ),
]
FreeOption = Annotated[
    float | None,
    typer.Option(
        "--free-threshold",
        metavar="P",
        help="Occupancy up to which a cell is free; else the map's.",
    ),
]
OccupiedOption = Annotated[
    float | None,
    typer.Option(
        "--occupied-threshold",
        metavar="P",
        help="Occupancy from which on a cell is occupied; else the map's.",
    ),
]
GraphFloorOption = Annotated[
    str | None,
    typer.Option("--floor", metavar="NAME", help="The floor to read of a graph with several."),
]
LeastIslandOption = Annotated[
    float,
    typer.Option(
        "--least-island",
        metavar="A",
        min=0,
        help="Leave out islands of free or unexplored cells below A square metres.",
    ),
]
MaxCellsOption = Annotated[
    int,
    typer.Option(
        "--max-cells", metavar="N", min=1, help="The most cells that a map may have to be read."
    ),
]
RoomsOption = Annotated[
    Path | None,
    typer.Option(
        "--rooms",
        metavar="FILE",
        help="Rooms as YAML; without it they are found, or are those of a model.",
    ),
]
BesideRoomsOption = Annotated[
    Path | None,
    typer.Option(
        "--rooms", metavar="FILE", help="Rooms as YAML; else rooms.yaml beside the map, if there."
    ),
]
