"""The page on a graph that was checked: figures, findings, a picture, in one HTML text."""

from __future__ import annotations

import base64
from importlib import resources
from typing import TYPE_CHECKING

from hybridnav.harness.report import page_template

if TYPE_CHECKING:
    from hybridnav.graphs import GraphCheck

_SHOWN = 100
"""Cases of a kind on the page; JSON has up to 1,000."""
_WIDTH_IN, _DPI = 10.0, 160.0


def check_facts(check: GraphCheck) -> list[tuple[str, str]]:
    """Return the figures of a check, each with its name."""
    grid, graph = check.grid, check.graph
    clear, free = int(check.is_clear.sum()), int(check.is_free.sum())
    known = f", frame {graph.frame}" if graph.frame else ""
    facts = [
        ("graph", f"{graph.name}, {graph.format}{known}"),
        ("map", f"{grid.name}, robot radius {grid.robot_radius_m:g} m"),
        ("nodes", f"{graph.n_nodes:,}, the robot fits at {free:,}"),
        ("edges", f"{graph.n_edges:,}, the robot can follow {clear:,}"),
        ("in sight", f"{check.in_sight:.1%} of free points see a node"),
    ]
    if check.rooms[1]:
        facts.append(("doors", "{} of {} are passed".format(*check.doors)))
        facts.append(("rooms", "{} of {} have a node".format(*check.rooms)))
    return facts


def render_check(check: GraphCheck) -> str:
    """Return the page on a check as one HTML text without references to other files.

    Parameters
    ----------
    check
        What to show.

    Returns
    -------
    str
        An HTML document, to be written as UTF-8.
    """
    from hybridnav.viz import plot_graph_check  # noqa: PLC0415 - loads matplotlib
    from hybridnav.viz.save import picture_bytes  # noqa: PLC0415

    drawn = picture_bytes(plot_graph_check(check, width_in=_WIDTH_IN), ".png", dpi=_DPI)
    source = resources.files("hybridnav.harness").joinpath("check.html.j2")
    return page_template(source.read_text(encoding="utf-8")).render(
        check=check,
        facts=check_facts(check),
        most=_SHOWN,
        picture=f"data:image/png;base64,{base64.b64encode(drawn).decode('ascii')}",
    )
