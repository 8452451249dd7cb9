"""The study: Thrun's three criteria for every method on 24 public maps.

    python -m benchmarks.study --data FOLDER -o DIR [--pairs 500] [--workers 2]

Twelve ROS maps (robot radius 0.25 m, merge distance 4 m, sampled pairs) and twelve MovingAI maps
(cells of 1 m, a point robot, merge distance 40 m, pairs of their scenario files, whose optima are
an oracle). DIR gets the records and the whole report; it draws the maps, so it belongs in no
repository. `docs/study.md` gets the tables and `docs/images/study-*.svg` the charts, which show no
map. A run that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import hybridnav as hn
from hybridnav.harness.analysis import nanquantile
from hybridnav.harness.charts import chart_file, loss_chart, speed_chart
from hybridnav.harness.contradictions import ANSWERED
from hybridnav.harness.methods import BASELINES
from hybridnav.harness.output import write_outputs
from hybridnav.harness.run import RunSettings, evaluate
from hybridnav.harness.svg import looks
from hybridnav.harness.tables import (
    EFFICIENCY_COLUMNS,
    LOSS_COLUMNS,
    rows_of_map,
    rows_of_study,
    to_markdown,
)

if TYPE_CHECKING:
    from hybridnav.harness.analysis import Study

ROS_MAPS = (
    "aws_small_warehouse/002/map.yaml",
    "bwi_gdc/2/2.yaml",
    "bwi_gdc/3/3.yaml",
    "fetch_maps/3_1_16_localization.yaml",
    "giraff_homes/UMA_236.yaml",
    "nav2/maps/depot.yaml",
    "nav2/maps/tb3_sandbox.yaml",
    "radish_grids/belgioioso.yaml",
    "radish_grids/intel.yaml",
    "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
)
MOVINGAI_FOLDERS = ("bg512", "cities", "da2", "dao", "mazes", "random", "rooms", "sc1")
N_MOVINGAI = 12
DOCS = Path(__file__).parents[1] / "docs"

PUBLISHED: list[dict[str, str | float]] = [
    {
        "source": "Thrun 1998, as commonly quoted",
        "map": "27,280 cells, an office floor",
        "topological layer": "67 regions",
        "loss": "1.82 % mean over 23.9 million pairs",
        "plans without loss": "83.4 %",
        "planning": "4,900 times fewer backups",
    },
    {
        "source": "the source paper",
        "map": "an office, U_d = 4 m",
        "topological layer": "places spaced at equal intervals of 4 m",
        "loss": "none stated",
        "plans without loss": "none stated",
        "planning": "none stated",
    },
    {
        "source": "Botea and others 2004, HPA*",
        "map": "120 maps of a game",
        "topological layer": "clusters of 10 x 10 cells",
        "loss": "about 1 % after smoothing",
        "plans without loss": "none stated",
        "planning": "up to 10 times faster than A*",
    },
]


def movingai_maps(data: Path) -> list[Path]:
    """Twelve maps, the folders in turn, each folder's in alphabetical order."""
    by_folder = [sorted((data / "movingai" / name).rglob("*.map")) for name in MOVINGAI_FOLDERS]
    with_scenarios = [[m for m in maps if Path(f"{m}.scen").exists()] for maps in by_folder]
    turns = max(map(len, with_scenarios))
    order = [maps[turn] for turn in range(turns) for maps in with_scenarios if turn < len(maps)]
    return order[:N_MOVINGAI]


def run(data: Path, folder: Path, pairs: int, workers: int) -> None:
    """All queries of the study."""
    # OMPL's paths are no cell paths, by which the harness judges: `benchmarks.ompl` measures them.
    presets = tuple(
        name for name in hn.preset_names() if name != "grid-astar" and not name.startswith("ompl-")
    )
    total = len(ROS_MAPS) + N_MOVINGAI
    maps: list[tuple[Path, str | None]] = [(data / name, None) for name in ROS_MAPS]
    maps += [(path, f"{path}.scen") for path in movingai_maps(data)]
    for number, (path, scenarios) in enumerate(maps, start=1):
        settings = RunSettings(
            maps=(str(path),),
            presets=presets,
            baselines=tuple(BASELINES),
            pairs=pairs,
            scenarios=scenarios,
            workers=workers,
        )
        made = evaluate(settings, folder)
        sys.stderr.write(f"{number} of {total}: {path.name}, {made} records\n")


def page(study: Study, pairs: int) -> str:
    """The page of the study."""
    overall = rows_of_study(study)
    maps = [row for name in study.maps for row in rows_of_map(study, name)]
    short = ("map", "method", "solved", "loss mean %", "loss p95 %", "loss max %", "without loss %",
             "query ms, median", "speed-up", "preparation s", "memory MB")  # fmt: skip
    return f"""# The study: consistency, loss, efficiency

Thrun's three questions, asked of every method on twelve ROS maps (robot radius 0.25 m, merge
distance 4 m, sampled pairs) and twelve MovingAI maps (a point robot, merge distance 40 cells, pairs
of their scenarios), up to {pairs} pairs a map. `python -m benchmarks.study --data FOLDER -o DIR`
makes it anew: records, a report with the worst cases drawn, and this page. What the columns mean is
said in [harness.md](harness.md).

[study-first.md](study-first.md) has the tables of the first study, 500 pairs a map, before there
were routes over portals. Times are of single queries with cold caches; [portals.md](portals.md) has
them interleaved, pair by pair.

## Consistency

{study.checks:,} answers checked: {len(study.faults)} counter-examples, {study.failures} queries
without an answer.

{_failures(study)}
## Loss

{to_markdown(overall, ("method", "maps", *LOSS_COLUMNS))}
![Share of pairs that lose more than x, for each method](images/study-loss.svg)

## Efficiency

{to_markdown(overall, ("method", *EFFICIENCY_COLUMNS))}
![Median query time against mean loss, for each method](images/study-speed.svg)

## Beside published figures

{to_markdown(PUBLISHED)}
## Map by map

{to_markdown(maps, short)}"""


def _failures(study: Study) -> str:
    """Why some queries have no answer, one line for each map and method."""
    lines = []
    for outcome in study.outcomes:
        failed = [r for r in outcome.records if r["status"] not in ANSWERED]
        if failed:
            reason = failed[0].get("error", failed[0]["status"])
            lines.append(
                f"* {outcome.map_name}, {outcome.label}: {len(failed)} queries, {reason}\n"
            )
    return "".join(lines)


def main() -> None:
    """Run the study and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--pairs", type=int, default=500)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    if arguments.data is None:
        parser.error("the study needs --data or HYBRIDNAV_DATA")
    run(Path(arguments.data), arguments.out, arguments.pairs, arguments.workers)
    study = write_outputs(arguments.out, title="hybridnav: the study", root=Path(arguments.data))
    (DOCS / "study.md").write_text(page(study, arguments.pairs), encoding="utf-8")
    losses = {label: study.pooled(label, "losses") for label in study.labels}
    times = {
        label: 1e3 * nanquantile(study.pooled(label, "seconds"), 0.5) for label in study.labels
    }
    seen = looks(study.labels)
    charts = {
        "study-loss.svg": loss_chart(losses, seen, "Loss of each method, all maps"),
        "study-speed.svg": speed_chart(losses, times, seen, "Speed against loss, all maps"),
    }
    for name, figure in charts.items():
        (DOCS / "images" / name).write_text(chart_file(figure), encoding="utf-8")


if __name__ == "__main__":
    main()
