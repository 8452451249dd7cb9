"""The report of a run as one HTML text that opens without network: tables, charts, worst cases."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, StrictUndefined

if TYPE_CHECKING:
    from jinja2 import Template

    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.tables import Table

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
    losses: dict[str, FloatArray] = field(default_factory=dict)
    """Per method, the loss of each solved pair; 0.01 is 1 %."""
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
    """What consistency is."""
    meanings: list[tuple[str, str]] = field(default_factory=list)
    """What each column of the tables holds."""
    overall_losses: dict[str, FloatArray] = field(default_factory=dict)
    overall_times_ms: dict[str, float] = field(default_factory=dict)
    metric_of: dict[str, str] = field(default_factory=dict)
    """Per method, the metric of its losses, octile if it is missing here: each metric has charts of
    its own."""


def render_report(report: ReportData) -> str:
    """Return the report as one HTML text without scripts and without references to other files.

    Equal data give equal text. Losses and times that are not finite are left out of the charts,
    and so are methods that have none left; each chart names those.

    Parameters
    ----------
    report
        What to show. Texts may hold any characters.

    Returns
    -------
    str
        An HTML document, to be written as UTF-8.
    """
    from hybridnav.harness.figures import Charts  # noqa: PLC0415 - loads matplotlib

    names = [*report.overall_losses, *report.overall_times_ms]
    for section in report.maps:
        names += [*section.losses, *section.times_ms]
    charts = Charts(names, report.metric_of)
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
