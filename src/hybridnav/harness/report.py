"""The report of a run as one HTML text that opens without network: tables, charts, worst cases."""

import io
import math
import re
import shlex
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any
from urllib.parse import quote

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, StrictUndefined, Template
from matplotlib.axes import Axes
from PIL import Image

from hybridnav._base.typing import FloatArray
from hybridnav.errors import MapError
from hybridnav.harness.analysis import Study
from hybridnav.harness.judges import chords_of
from hybridnav.harness.names import REFERENCE
from hybridnav.harness.outcome import Outcome
from hybridnav.harness.records import Record, decode_path, query_key
from hybridnav.harness.scenes import MapSpec, map_digest, read_map
from hybridnav.harness.tables import Table
from hybridnav.maps import MAX_CELLS, Frame, OccupancyGrid
from hybridnav.viz import method_styles, plot_losses, plot_paths, plot_speed
from hybridnav.viz.canvas import picture_bytes, png_uri

_CASE_WIDTH_IN = 4.0
_CASE_DPI = 144.0
_CASE_COLOURS = 32
"""Cells have four; lines and their smooth rims have the others."""

_OF_LOSSES = (
    "Each line is the share of pairs whose loss is above the value below it; at 0, the share with "
    "any loss. The share is logarithmic, so that the few worst pairs show; a line ends at the "
    "largest loss of its method, and one on the axis stands for no pair. A line further down and "
    "left is better."
)
_OF_SPEED = "Down and to the left is better; the loss axis is logarithmic above 0.01\u00a0%."


Losses = dict[str, dict[str, "FloatArray"]]
"""By the name of what they are over, and the method: the loss of each solved pair; 0.01 is 1 %."""


@dataclass(frozen=True, slots=True)
class Chart:
    """A chart with its caption."""

    title: str
    uri: str
    """A data URI; empty where there is nothing to draw."""
    caption: str
    missing: list[str]
    """Methods without values."""


class Charts:
    """The charts of a report, in which each method looks the same.

    `names`: methods of the report, in its order; they may repeat.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self._styles = method_styles(names)

    def overall(self, losses: Losses, times_ms: Mapping[str, float]) -> list[Chart]:
        """Return the charts of all maps together, one for each optimum."""
        return [
            self._speed(known, times_ms, f"Speed against loss over {optimum}, all maps")
            for optimum, known in losses.items()
        ]

    def of_map(self, name: str, losses: Losses, times_ms: Mapping[str, float]) -> list[Chart]:
        """Return the charts of one map, two for each optimum."""
        charts = []
        for optimum, known in losses.items():
            charts.append(self._losses(known, f"Loss over {optimum}, {name}"))
            title = f"Speed against loss over {optimum}, {name}"
            charts.append(self._speed(known, times_ms, title))
        return charts

    def _losses(self, losses: Mapping[str, FloatArray], title: str) -> Chart:
        drawn = {name: known for name, known in losses.items() if np.isfinite(known).any()}
        missing = [name for name in losses if name not in drawn]
        if not drawn:
            return Chart(title, "", "No pair has a known loss.", missing)
        return Chart(title, _svg_uri(plot_losses(drawn, styles=self._styles)), _OF_LOSSES, missing)

    def _speed(
        self, losses: Mapping[str, FloatArray], times_ms: Mapping[str, float], title: str
    ) -> Chart:
        drawn = {
            name: known
            for name, known in losses.items()
            if np.isfinite(known).any() and 0 < times_ms.get(name, math.nan) < math.inf
        }
        missing = [name for name in losses if name not in drawn]
        if not drawn:
            return Chart(title, "", "No method has both a time and a loss.", missing)
        chart = plot_speed(drawn, times_ms, styles=self._styles)
        return Chart(title, _svg_uri(chart), _OF_SPEED, missing)


def paths_uri(grid: OccupancyGrid, path: FloatArray, shortest: FloatArray | None) -> str:
    """Return the picture of a path and a shortest one as a PNG, half as large as an SVG.

    `path`, `shortest`: float64 (n, 2), points `(x, y)` in metres.
    """
    ax = plot_paths(grid, path, shortest, title="", width_in=_CASE_WIDTH_IN)
    drawn, small = io.BytesIO(picture_bytes(ax, ".png", dpi=_CASE_DPI)), io.BytesIO()
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(_CASE_COLOURS).save(small, format="PNG", optimize=True)
    return png_uri(small.getvalue())


def _svg_uri(chart: Axes) -> str:
    """Return a chart whose texts are texts: the reader's fonts have more letters than ours."""
    with mpl.rc_context({"svg.fonttype": "none"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        drawn = picture_bytes(chart, ".svg", dpi=_CASE_DPI)
    return f"data:image/svg+xml,{quote(drawn, safe=' /:=,;()!*+-._~')}"


# The report of a run as one HTML text that opens without network: tables, charts, worst cases.

_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


@dataclass(frozen=True)
class WorstCase:
    """A pair with a large loss."""

    title: str
    picture: str
    """A data URI: drawn at once, so that a report does not hold the cells of all its maps."""
    command: str = ""
    """A command that plans the same pair, in metres, by the preset or by the reference."""


@dataclass(frozen=True)
class CounterExample:
    """A contradiction that was found."""

    text: str
    command: str = ""
    """A command that plans the same pair, in metres, by the preset or by the reference."""
    anchor: str = ""
    """Id of the element with its picture, empty if it is not drawn."""


@dataclass(frozen=True, eq=False)
class MapSection:
    """The report's section on one map."""

    name: str
    facts: list[tuple[str, str]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    losses: Losses = field(default_factory=dict)
    times_ms: dict[str, float] = field(default_factory=dict)
    """Per method, the median time of a query in milliseconds."""
    worst: list[WorstCase] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class ReportData:
    """Contents of a report."""

    title: str
    facts: list[tuple[str, str]]
    faults: list[CounterExample]
    """Counter-examples to consistency and paths that failed a check, as many as are shown."""
    checks: int
    """Checks made, passed or not."""
    maps: list[MapSection]
    n_faults: int = 0
    """Counter-examples found."""
    methods: Table | None = None
    """The table of methods: versions and settings."""
    overall: list[Table] = field(default_factory=list)
    """Tables of all maps together, none for one map."""
    failures: list[tuple[str, str]] = field(default_factory=list)
    """Methods with queries without an answer: the reason in words, and a traceback or nothing."""
    warnings: list[str] = field(default_factory=list)
    """What speaks against the times."""
    definition: str = ""
    meanings: list[tuple[str, str]] = field(default_factory=list)
    """What each column of the tables holds."""
    overall_losses: Losses = field(default_factory=dict)
    overall_times_ms: dict[str, float] = field(default_factory=dict)


def render_report(report: ReportData) -> str:
    """Return the report as one HTML text without scripts and without references to other files.

    Equal data give equal text. Losses and times that are not finite are left out of the charts, and
    so are methods that have none left; each chart names those.

    `report`: what to show. Texts may hold any characters. Returns an HTML document, to be written
    as UTF-8.
    """
    every = [report.overall_losses, *(section.losses for section in report.maps)]
    charts = Charts(name for losses in every for known in losses.values() for name in known)
    return _template().render(report=report, charts=charts)


@cache
def _template() -> Template:
    source = resources.files("hybridnav.harness").joinpath("report.html.j2")
    return page_template(source.read_text(encoding="utf-8"))


def page_template(source: str) -> Template:
    """Return the template of a page, in which texts may hold any characters."""
    environment = Environment(
        autoescape=True,
        finalize=_printable,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.from_string(source)


def _printable(value: Any) -> Any:
    """Replace what no page may hold: file names can carry control codes and lone surrogates."""
    return _UNPRINTABLE.sub("\ufffd", value) if type(value) is str else value


# Counter-examples and worst cases: where they are, in metres, and their pictures.


MAX_FAULTS_SHOWN = 50
WORST_CASES = 2

CaseKey = tuple[str, str, str]
"""Method, id of the record and text of a case, which its picture and its line share."""


def counter_examples(study: Study, drawn: dict[CaseKey, str]) -> list[CounterExample]:
    """Return the contradictions of a study, up to `MAX_FAULTS_SHOWN` of them.

    `drawn`: anchors of the pictures of those that are drawn. Returns the first of each method, then
    the second of each, and so on; a line about the number of others last.
    """
    ranked = [
        (rank, outcome, record, text)
        for outcome in study.outcomes
        for rank, (record, text) in enumerate(outcome.faults)
    ]
    ranked.sort(key=lambda fault: fault[0])
    cases = [(outcome, record, text) for _, outcome, record, text in ranked]
    lines = [
        CounterExample(
            f"{outcome.map_name}, {outcome.label}, {_pair_text(record)}: {text}",
            command=command_of(outcome, record),
            anchor=drawn.get((outcome.label, record["id"], text), ""),
        )
        for outcome, record, text in cases[:MAX_FAULTS_SHOWN]
    ]
    if len(cases) > MAX_FAULTS_SHOWN:
        others = f"and {len(cases) - MAX_FAULTS_SHOWN} more, see records.jsonl"
        lines.append(CounterExample(others))
    return lines


def command_of(outcome: Outcome, record: Record) -> str:
    """Return the command that plans the pair of a record, in metres.

    It plans by the preset, or by the reference for other methods. Other records, and those of older
    versions without a frame, have an empty one.
    """
    about = outcome.preparation
    if record["type"] != "pair" or "origin" not in about:
        return ""
    x, y, yaw = about["origin"]
    frame = Frame(about["resolution_m"], (x, y), yaw)
    (start, goal) = frame.points_of([record["start"], record["goal"]]).tolist()
    ends = [
        f"--{name}={point[0]:.6g},{point[1]:.6g}"
        for name, point in (("start", start), ("goal", goal))
    ]
    words = ["hybridnav", "plan", about["file"], *ends]
    words.append(f"--robot-radius={about['robot_radius_m']:g}")
    words.append(f"--preset={(about.get('preset') or {}).get('name', REFERENCE)}")
    return shlex.join(words)


def _pair_text(record: Record) -> str:
    if record["type"] != "pair":
        return "all pairs"
    return f"cells {tuple(record['start'])} to {tuple(record['goal'])}"


def cases_of(outcome: Outcome) -> list[tuple[CaseKey, WorstCase]]:
    """Return counter-examples, and the pairs with the largest losses, two of presets and one of
    others, with their pictures; none where the map is no longer there."""
    cases = [(record, fault) for record, fault in outcome.faults[:WORST_CASES]]
    if outcome.label != REFERENCE:
        shown = WORST_CASES if outcome.preparation.get("preset") is not None else 1
        own = {query_key(record): record for record in outcome.records}
        how = "dear" if outcome.yardstick == "weighted" else "long"
        order = np.argsort(-np.nan_to_num(outcome.losses, nan=0.0), kind="stable")[:shown]
        for at in order[outcome.losses[order] > 0]:
            record = own[query_key(outcome.references[at])]
            cases.append((record, f"{100 * outcome.losses[at]:.1f} % too {how}"))
    drawn = []
    for record, text in cases:
        case = _case(outcome, record, text)
        if case is not None:
            drawn.append(((outcome.label, record["id"], text), case))
    return drawn


def _case(outcome: Outcome, record: Record, text: str) -> WorstCase | None:
    about = outcome.preparation
    if "file" not in about:
        return None
    try:
        # As large as it may be: the run has read it.
        spec = MapSpec(about["file"], about["robot_radius_m"], about["corner_cutting"], MAX_CELLS)
        grid = read_map(spec)
    except MapError:  # it is no longer there
        return None
    if map_digest(grid) != about.get("grid_sha", about["map_sha"]):
        return None
    optimum = None
    if record["type"] == "pair":
        path = _path(record, grid)
        reference = outcome.optimum.get(query_key(record))
        if reference is not None and reference.get("path"):
            optimum = _path(reference, grid)
    else:  # a fault of the regions: the two cells that show it
        path = grid.frame.points_of(record["fault_cells"][record["faults"].index(text)])
    title = f"{outcome.label}, {_pair_text(record)}: {text}"
    return WorstCase(title, paths_uri(grid, path, optimum), command=command_of(outcome, record))


def _path(record: Record, grid: OccupancyGrid) -> FloatArray:
    """Return the points to draw for an answer: its path, or its endpoints if it has none."""
    start, goal = record["start"], record["goal"]
    if record.get("points"):
        points = np.array(record["points"], dtype=np.float64)
        if record.get("headings_rad") and np.isfinite(points).all():
            points = chords_of(grid, points, record["headings_rad"]).points
        return points[np.isfinite(points).all(axis=1)]
    if record.get("path"):
        return grid.frame.points_of(decode_path((start[0], start[1]), record["path"]))
    return grid.frame.points_of([start, goal])
