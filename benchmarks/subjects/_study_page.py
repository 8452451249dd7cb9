"""The page of the study, written from its figures and nothing else."""

from benchmarks.subjects._study_data import Data
from benchmarks.subjects._study_maps import KINDS
from benchmarks.subjects._study_quotes import quoted
from benchmarks.subjects._study_tables import TITLES, StudyTable, tables_of
from hybridnav.harness.tables import markdown_of, text_of

PUBLISHED = """* Thrun 1998, as commonly quoted: an office floor of 27,280 cells, 67 regions, 1.82 %
  mean loss over 23.9 million pairs, 83.4 % without loss, 4,900 times fewer backups.
* The source paper: an office, U_d = 4 m; no loss stated.
* Botea and others 2004, HPA\\*: 120 maps of a game, clusters of 10 x 10 cells, about 1 % after
  smoothing, up to 10 times faster than A\\*.
"""

CHARTS: dict[str, tuple[tuple[str, str], ...]] = {
    "lengths": (
        (
            "study-loss.svg",
            "Share of pairs whose loss over the octile optimum is above x, paths of cells",
        ),
        ("study-speed.svg", "Mean loss over the any-angle optimum and median time of a query"),
    ),
    "costs": (
        (
            "study-costs.svg",
            "Mean loss over the least cost of paths of cells and median time of a query",
        ),
    ),
    "ompl": (
        ("study-ompl-loss.svg", "Share of pairs whose loss over the any-angle optimum is above x"),
    ),
}
"""Files and descriptions of the charts of each part."""


_ON_PAGE = ("short", "others", "not asked")
"""Tables that the page has: the figures of the others are in its data."""


def page(data: Data) -> str:
    """Return the page `docs/study.md`."""
    tables = [table for table in tables_of(data) if table.name in _ON_PAGE]
    text = f"""# The study: consistency, loss, efficiency

Thrun's three questions, asked of every method on {_maps_in_words(data)}.
`make study` asks them anew and writes this page and its charts. This is {_how_much(data)}.
Every number comes from its data (`docs/data/study.json`), which a script fills from the records.
They have more: consistency by kinds of checks, work, each map. [The
harness](harness.md#how-answers-are-judged) has the checks. A plan that is read off a path is
consistent with it by construction, and loses nothing. Times are medians over the pairs in common.
A speed-up is the reference's time over the method's, below 1 where it is slower: the median of the
ratios, and the ratio of the means.

## The answers

{in_short(data)}
{_charts(data)}## Circumstances

{_listed(circumstances(data))}
{rules(data)}

"""
    for name in data["parts"]:
        text += f"## {TITLES[name]}\n\n{about(data, name)}\n\n"
        text += "".join(_section(table) for table in tables if table.part == name)
    text += "".join(_section(table, "##") for table in tables if not table.part)
    return f"{text}## Beside published figures\n\n{PUBLISHED}"


_LEADS = {
    "lengths": "Losses, and the time that they save:",
    "costs": "The same where a path costs more near obstacles:",
    "ompl": "What sampling-based planners lose in a corridor:",
}
"""What leads to the charts of each part."""

_DESCENT = """What the pyramid gains: `paper` comes down to fields of so many cells in the mean,
from the places to single cells. A curve is a map:

![Loss against work, as the last level goes from the places to the base](images/study-descent.svg)

* Consistency: the path is one of cells, whatever level chose it; the checks below hold.
* Loss: at the places {places_loss} % in the mean of the maps, at fields of the preset's size
  {fields_loss} %, at the base {base_loss} %. Each finer level mends what the one above chose wrong.
* Efficiency: {places_work}, {fields_work} and {base_work} % of what A\\* expands. A level is
  searched only among the sons of what was kept; at the base these are many.

`HYBRIDNAV_DATA=D .venv/bin/python -m benchmarks study --descent` draws it; no axis is a time.

"""


def _charts(data: Data) -> str:
    """Return the charts of the answers."""
    charts = (
        f"{lead}\n\n" + "".join(f"![{what}](images/{file})\n\n" for file, what in CHARTS[name])
        for name, lead in _LEADS.items()
        if name in data["parts"]
    )
    descent = _DESCENT.format_map(quoted(data)) if "descent" in data else ""
    return "".join(charts) + descent


def _section(table: StudyTable, level: str = "###") -> str:
    heading = table.title
    if table.part:
        heading = f"{TITLES[table.part]}: {table.title[0].lower()}{table.title[1:]}"
    note = f"{table.note}\n\n" if table.note else ""
    body = markdown_of(table.columns, [[text_of(cell) for cell in row] for row in table.rows])
    return f"{level} {heading}\n\n{note}{body}\n"


def _listed(facts: list[tuple[str, str]]) -> str:
    return "".join(f"* {name}: {value}\n" for name, value in facts)


def _maps_in_words(data: Data) -> str:
    """Return how many maps of each kind there are."""
    kinds = [row["kind"] for row in data["maps"]]
    parts = [
        f"{kinds.count(kind)} {what.partition(' ')[2]}s" if kinds.count(kind) != 1 else what
        for kind, what in KINDS.items()
        if kind in kinds
    ]
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts)


def _how_much(data: Data) -> str:
    """Return in words how much of the study was asked."""
    plan = data["plan"]
    of = {"quarter": "a quarter of it", "whole": "the whole of it"}.get(
        plan["name"], "a part of it"
    )
    return f"{of}, {plan['pairs']} pairs a map"


def about(data: Data, name: str) -> str:
    """Return the introduction of a part."""
    part = data["parts"][name]
    counted = (
        f"{part['pairs']:,} pairs of joined cells; {part['checks']:,} answers checked, "
        f"{part['contradictions']:,} contradictions. All methods of the table solved "
        f"{part['pairs in common']:,} pairs."
    )
    return f"{_ABOUT[name]} {counted}" + "".join(f" {found}." for found in _contradictions(part))


def _contradictions(part: Data) -> list[str]:
    found = part["first contradictions"]
    return [f"The first: {found[0].rstrip('.')}"] if found else []


_ABOUT = {
    "lengths": "Shortest paths, by length.",
    "costs": "Cheapest paths: each cell costs more the nearer it is to an obstacle, as Nav2's "
    "inflation has it (0.70 m, 3.0). `shortest` and `octile` know nothing of costs.",
    "ompl": "Presets with OMPL, 1 s a query, on fewer pairs of the same maps, in its process. "
    "The coarse route is refined by grid A* in `paper`, by RRTConnect in `paper+ompl`. "
    "`ompl-whole` knows no places, and the reference is A* on the whole map.",
}


def rules(data: Data) -> str:
    """Return the rules by which methods are compared, in words."""
    plan = data["plan"]
    return (
        "A method that solved less than 99 % of all pairs is compared over pairs of its own. One "
        f"that takes more than {plan['limit_s']:g} s on a map, preparation included, is not asked "
        "further."
    )


def circumstances(data: Data) -> list[tuple[str, str]]:
    """Return the circumstances of the study: what was asked, where, and when."""
    plan, machine = data["plan"], data["machine"]
    pairs = (
        f"{plan['pairs']} a map ({plan['ompl_pairs']} for OMPL). On ROS and SLAM maps they are "
        "sampled in five classes of distance; robot radius 0.25 m, merge distance 4 m. On MovingAI "
        "maps they are spread over the scenario files; a point robot, merge distance 40 m"
    )
    lengths = next(iter(data["parts"].values()))
    facts = [
        ("pairs", pairs),
        ("times", _times(data)),
        ("machine", f"{machine.get('processor', 'unknown')}; {machine.get('machine', 'unknown')}"),
    ]
    if plan["without"]:
        names = ", ".join(plan["without"])
        facts.append(("left out", f"{names}: the whole study (make study STUDY=whole) has them"))
    if lengths["dates"]:
        dates = [f"{date[:16].replace('T', ' ')} UTC" for date in lengths["dates"]]
        facts.append(("measured", " to ".join(dict.fromkeys(dates))))
    if lengths["loads"]:
        start, end, most = lengths["loads"]
        # The first reading remembers the answers before the pass, if they took more processes.
        what = " (left by earlier work)" if start > most else ""
        text = f"{start:.2f} at the start{what}, {end:.2f} at the end, {most:.2f} at most"
        facts.append(("load in the timing pass", f"{text}; the study itself makes 1"))
    checked = [
        f"{TITLES[name]} {part['checked any-angle']}"
        for name, part in data["parts"].items()
        if part.get("checked any-angle")  # figures of older runs do not state it
    ]
    if checked:
        text = f"{', '.join(checked)} optima, by a search of the visibility graph"
        facts.append(("checked any-angle", text))
    facts += [
        ("warning", f"{TITLES[name]}: {one.rstrip('.')}")
        for name, part in data["parts"].items()
        for one in part["warnings"]
    ]
    versions = [f"{key} {machine[key]}" for key in _VERSIONS if key in machine]
    facts.append(("versions", ", ".join(versions)))
    if "planners of others" in machine:
        facts.append(("planners of others", machine["planners of others"]))
    minutes = sum(data["seconds"].values()) / 60
    facts.append(("time of the study", f"{minutes:.0f} minutes"))
    return facts


_VERSIONS = ("hybridnav", "python", "numpy", "scipy", "numba", "ompl")


def _times(data: Data) -> str:
    repeat = data["plan"]["repeat"]
    return (
        f"medians of {repeat} queries of each pair, all methods in one process in an order "
        "shuffled for each pair, kernels warm"
    )


def in_short(data: Data) -> str:
    """Return the findings, as a list in Markdown; figures that are not there leave their line
    out."""
    figures = quoted(data)
    lines = [f"* Contradictions: {figures['contradictions']} in {figures['checks']} answers.\n"]
    for template in _FINDINGS:
        try:
            lines.append(template.format_map(figures))
        except KeyError:
            continue
    return "".join(lines)


_FINDINGS = tuple(
    f"* {line}\n"
    for line in (
        (
            "`paper` is {paper_octile} % longer than the octile "
            "optimum in the mean and {paper_any} % longer than the any-angle optimum. The octile "
            "optimum itself is {grid_any} % longer."
        ),
        (
            "`paper` comes down the levels of the pyramid: it expands {paper_work} % of what A\\* "
            "expands, fields and cells together. It is {paper_speed} than A\\* by the median of "
            "the ratios of times, {paper_means} by mean times."
        ),
        (
            "Against A\\*, by the median of the ratios of times: `octile` is {octile_speed}, "
            "`shortest` {shortest_speed}, HPA\\* {hpa_speed}. By mean times `octile` is "
            "{octile_means}, `shortest` {shortest_means}, HPA\\* {hpa_means}."
        ),
        (
            "By cost, over the least cost of paths of cells: `robot`, which is not bound to cells, "
            "is at {robot_cost} % in the mean, `shortest`, which knows no costs, at "
            "{shortest_cost} %."
        ),
        (
            "OMPL in the corridor solved {ompl_solved} of {ompl_asked} queries itself, "
            "{ompl_least} to {ompl_most} % longer than the any-angle optimum in the mean."
        ),
    )
)
"""Sentences whose figures are those of `quoted`."""
