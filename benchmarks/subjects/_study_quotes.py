"""Figures of the study that other pages quote: each is found by the words around it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.subjects._study_data import Data
from benchmarks.subjects._study_descent import DEFAULT, PLACES, means_of
from hybridnav.errors import InvalidValueError
from hybridnav.harness.tables import text_of

_FIGURE = r"(?P<{}>(?:< )?-?\d+(?:,\d{{3}})*(?:\.\d+)?(?:\s+times\s+(?:faster|slower))?)"
_HOLE = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class Quote:
    """A sentence, or a part of one, with figures of the study."""

    file: str
    """Path from the root of the checkout."""
    template: str
    """The words, with the names of figures in braces. Blanks stand for line breaks too."""

    @property
    def pattern(self) -> re.Pattern[str]:
        """What finds it."""
        parts = _HOLE.split(self.template)
        texts = [
            _FIGURE.format(part) if at % 2 else r"\s+".join(map(re.escape, part.split(" ")))
            for at, part in enumerate(parts)
        ]
        return re.compile("".join(texts))


def quoted(data: Data) -> dict[str, str]:
    """Return the figures that may be quoted, as texts; those that are not there are left out."""
    parts = data["parts"]
    found: dict[str, str] = {
        "maps": f"{len(data['maps'])}",
        "pairs": f"{data['plan']['pairs']}",
        "checks": f"{sum(part['checks'] for part in parts.values()):,}",
        "contradictions": f"{sum(part['contradictions'] for part in parts.values()):,}",
    }
    for part in parts:
        found[f"{part}_pairs"] = f"{parts[part]['pairs']:,}"
    for name, (part, method, column) in _FIGURES.items():
        row = _row(parts.get(part), method)
        value = row.get(column)
        if isinstance(value, int | float):
            found[name] = _pace(value) if column.startswith("speed-up") else text_of(value)
    paper, whole = (_row(parts.get("lengths"), name) for name in ("paper", "grid-astar"))
    if paper.get("expansions") and whole.get("expansions"):
        found["paper_work"] = text_of(100 * paper["expansions"] / whole["expansions"])
    return found | _of_descent(data.get("descent")) | _of_ompl(parts.get("ompl"))


_FIGURES = {
    "paper_octile": ("lengths", "paper", "octile loss mean %"),
    "paper_any": ("lengths", "paper", "any-angle loss mean %"),
    "grid_any": ("lengths", "grid-astar", "any-angle loss mean %"),
    "hpa_octile": ("lengths", "hpa-star", "octile loss mean %"),
    "hpa_any": ("lengths", "hpa-star", "any-angle loss mean %"),
    "thrun_octile": ("lengths", "thrun", "octile loss mean %"),
    "thrun_any": ("lengths", "thrun", "any-angle loss mean %"),
    "octile_speed": ("lengths", "octile", "speed-up"),
    "shortest_speed": ("lengths", "shortest", "speed-up"),
    "paper_speed": ("lengths", "paper", "speed-up"),
    "hpa_speed": ("lengths", "hpa-star", "speed-up"),
    "octile_means": ("lengths", "octile", "speed-up of means"),
    "shortest_means": ("lengths", "shortest", "speed-up of means"),
    "paper_means": ("lengths", "paper", "speed-up of means"),
    "hpa_means": ("lengths", "hpa-star", "speed-up of means"),
    "hpa_preparation": ("lengths", "hpa-star", "preparation s"),
    "octile_preparation": ("lengths", "octile", "preparation s"),
    "shortest_preparation": ("lengths", "shortest", "preparation s"),
    "robot_cost": ("costs", "robot", "weighted loss mean %"),
    "shortest_cost": ("costs", "shortest", "weighted loss mean %"),
}
"""Part, method and column of each figure."""


def _pace(ratio: float) -> str:
    """Return in words a ratio of A*'s time to that of a method."""
    return f"{text_of(ratio)} times faster" if ratio >= 1 else f"{text_of(1 / ratio)} times slower"


def _row(part: Data | None, method: str) -> Data:
    rows = [] if part is None else [*part["methods"], *part["others"]]
    return next((row for row in rows if row["method"] == method), {})


def _of_descent(levels: Data | None) -> dict[str, str]:
    """Return work and loss of descents that end at places, at fields of the preset, at cells."""
    if levels is None:
        return {}
    at = {"places": PLACES, "fields": DEFAULT, "base": "1"}
    means = {name: means_of(levels, size) for name, size in at.items()}
    texts = {f"{name}_work": text_of(work) for name, (work, _) in means.items()}
    return texts | {f"{name}_loss": text_of(loss) for name, (_, loss) in means.items()}


def _of_ompl(part: Data | None) -> dict[str, str]:
    rows = [] if part is None else [*part["methods"], *part["others"]]
    presets = [row for row in rows if row["method"].startswith("ompl-") and "pairs" in row]
    presets = [row for row in presets if "whole" not in row["method"]]
    losses = [row["any-angle loss mean %"] for row in presets if row["any-angle loss mean %"]]
    if not losses:
        return {}
    return {
        "ompl_solved": f"{sum(row['solved'] for row in presets):,}",
        "ompl_asked": f"{sum(row['pairs'] for row in presets):,}",
        "ompl_least": f"{min(losses):.2f}",
        "ompl_most": f"{max(losses):.2f}",
    }


def found_in(text: str, quote: Quote) -> re.Match[str]:
    """Return the place of a quote in a text.

    Raises
    ------
    InvalidValueError
        When it is not there once.
    """
    places = list(quote.pattern.finditer(text))
    if len(places) != 1:
        raise InvalidValueError(
            f"{quote.file}: expected the words {quote.template!r} once, found {len(places)}"
        )
    return places[0]


def update(root: Path, quotes: tuple[Quote, ...], figures: Mapping[str, str]) -> None:
    """Write the figures into all files that quote them."""
    for quote in quotes:
        path = root / quote.file
        text = path.read_text(encoding="utf-8")
        place = found_in(text, quote)
        for name in reversed(list(quote.pattern.groupindex)):
            start, end = place.span(name)
            text = text[:start] + figures[name] + text[end:]
        path.write_text(text, encoding="utf-8")


_ANSWERS = "by scipy or by another method, "


QUOTES = (
    Quote("README.md", "[{maps} public maps](docs/study.md) {contradictions} of {checks} answers"),
    Quote("README.md", "`paper` is {paper_any} % above the any-angle optimum"),
    Quote("docs/peers.md", "implementation loses {hpa_octile} % in the mean"),
    Quote(
        "docs/peers.md",
        "it prepares in {hpa_preparation} s in the mean, `octile` in {octile_preparation} s",
    ),
    Quote("docs/peers.md", "smoothed ones are {hpa_any} % above them in the mean"),
    Quote(
        "docs/peers.md",
        "his regions lose {thrun_octile} % in the mean against the octile optimum, `paper` "
        "{paper_octile} %, `octile` nothing ({thrun_any}, {paper_any} and {grid_any} %",
    ),
    Quote(
        "docs/peers.md",
        _ANSWERS + "in the study on {maps} public maps | {contradictions} of {checks} |",
    ),
    Quote(
        "docs/peers.md",
        "in the study, {maps} maps, {ompl_asked} queries of 1 s | {ompl_solved} solved by OMPL "
        "itself, {ompl_least} to {ompl_most} % mean loss",
    ),
    Quote(
        "docs/howto/choose-preset.md",
        "{paper_octile} % longer than the octile optimum in the mean, {paper_any} % longer",
    ),
    Quote("paper/paper.md", "compares methods on {maps} public maps"),
    Quote("paper/paper.md", "benchmark grids, with {pairs} pairs each"),
    Quote(
        "paper/paper.md", "In {checks} judged answers there were {contradictions} contradictions"
    ),
    Quote(
        "paper/paper.md",
        "{paper_octile} % longer than the octile optimum in the mean and {paper_any} % longer than "
        "the any-angle optimum; the octile optimum itself is {grid_any} % longer",
    ),
    Quote(
        "paper/paper.md",
        "loses {hpa_octile} % against the octile optimum, regions after Thrun {thrun_octile} %",
    ),
    Quote(
        "paper/paper.md",
        "`octile` is {octile_speed}, `shortest` {shortest_speed} and `paper` {paper_speed}; by "
        "mean times they are {octile_means}, {shortest_means} and {paper_means}",
    ),
    Quote(
        "paper/paper.md",
        "at the places it loses {places_loss} % for {places_work} % of the cells that A\\* "
        "expands, at fields of the preset's size {fields_loss} % for {fields_work} %, at single "
        "cells {base_loss} % for {base_work} %",
    ),
    Quote(
        "paper/paper.md",
        "paths of `robot`, which are not bound to cells, are at {robot_cost} % in the mean, those "
        "of `shortest`, which knows no costs, at {shortest_cost} %",
    ),
)
"""All quotes of figures of the study."""
