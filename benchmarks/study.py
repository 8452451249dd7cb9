"""The study: Thrun's three criteria for every method on 24 public maps.

    python -m benchmarks.study --data FOLDER -o DIR [--pairs 500] [--workers 2]
                               [--part methods|ompl] [--ompl-pairs 10] [--ompl-budget S]
                               [--map GLOB]

Twelve ROS maps (robot radius 0.25 m, merge distance 4 m, sampled pairs) and twelve MovingAI maps
(cells of 1 m, a point robot, merge distance 40 m, pairs of their scenario files, whose optima are
an oracle). DIR gets the records and the whole report; it draws the maps, so it belongs in no
repository. `docs/study.md` gets the tables and `docs/images/study-*.svg` the charts, which show no
map. A run that was stopped goes on where it was.

Part `ompl` asks the presets with OMPL on the same maps, with fewer pairs, for each query may take
its whole budget: about half an hour on one core. Its records go to DIR/ompl, its page is
`docs/study-ompl.md`. With `--map` only maps whose path fits are asked, and pages and charts stay in
DIR.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import hybridnav as hn
from benchmarks import _study_ompl
from hybridnav.harness.methods import BASELINES
from hybridnav.harness.outcome import nanquantile
from hybridnav.harness.output import markdown, write_outputs
from hybridnav.harness.rows import rows_of_map, rows_of_study
from hybridnav.harness.run import RunSettings, evaluate
from hybridnav.harness.tables import to_markdown
from hybridnav.viz import plot_losses, plot_speed, save_figure

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


def maps_of(data: Path, globs: list[str]) -> list[tuple[Path, str | None]]:
    """The files of all maps, or of those that fit, with their scenario files."""
    maps: list[tuple[Path, str | None]] = [(data / name, None) for name in ROS_MAPS]
    maps += [(path, f"{path}.scen") for path in movingai_maps(data)]
    if not globs:
        return maps
    names = [path.relative_to(data).as_posix() for path, _ in maps]
    fits = [any(fnmatch.fnmatch(name, glob) for glob in globs) for name in names]
    return [one for one, fit in zip(maps, fits, strict=True) if fit]


def run(maps: list[tuple[Path, str | None]], folder: Path, pairs: int, workers: int) -> None:
    """All queries of the study."""
    presets = tuple(
        name for name in hn.preset_names() if name != "grid-astar" and not name.startswith("ompl-")
    )
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
        sys.stderr.write(f"{number} of {len(maps)}: {path.name}, {made} records\n")


def page(study: Study, pairs: int) -> str:
    """The page of the study."""
    overall = rows_of_study(study)
    maps = [row for name in study.maps for row in rows_of_map(study, name)]
    short = (
        "map", "method", "solved %", "any-angle loss mean %", "octile loss mean %",
        "octile loss p95 %", "octile loss max %", "octile loss without loss %", "query ms, median",
        "speed-up", "preparation s", "memory MB",
    )  # fmt: skip
    return f"""# The study: consistency, loss, efficiency

Thrun's three questions, asked of every method on twelve ROS maps (robot radius 0.25 m, merge
distance 4 m, sampled pairs) and twelve MovingAI maps (a point robot, merge distance 40 cells, pairs
of their scenarios), up to {pairs} pairs a map. `python -m benchmarks.study --data FOLDER -o DIR`
makes it anew: records, a report with the worst cases drawn, and this page. The page
[harness.md](harness.md) describes the columns.

[study-first.md](study-first.md) has the tables of the first study, 500 pairs a map, before there
were routes over portals. Times are of single queries with cold caches; [portals.md](portals.md) has
them interleaved, pair by pair. [study-ompl.md](study-ompl.md) has the presets with OMPL, whose
paths are any-angle.

{markdown(overall, study)}
![Share of pairs that lose more than x, for each method](images/study-loss.svg)

![Median query time against mean loss, for each method](images/study-speed.svg)

## Beside published figures

{to_markdown(PUBLISHED)}
## Map by map

{to_markdown(maps, short)}"""


def main() -> None:
    """Run the study, or a part of it, and write its pages."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--part", choices=("methods", "ompl"), help="both unless given")
    parser.add_argument("--pairs", type=int, default=500)
    parser.add_argument("--ompl-pairs", type=int, default=10)
    parser.add_argument("--ompl-budget", type=float, help="seconds; else the presets'")
    parser.add_argument("--map", action="append", default=[], metavar="GLOB")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    if arguments.data is None:
        parser.error("the study needs --data or HYBRIDNAV_DATA")
    data = Path(arguments.data)
    maps = maps_of(data, arguments.map)
    if not maps:
        parser.error("no map of the study fits --map")
    docs = arguments.out / "docs" if arguments.map else DOCS
    (docs / "images").mkdir(parents=True, exist_ok=True)
    if arguments.part != "ompl":
        run(maps, arguments.out / "methods", arguments.pairs, arguments.workers)
        write_methods(arguments, docs)
    if arguments.part != "methods":
        folder, budget_s = arguments.out / "ompl", arguments.ompl_budget
        asked = {"pairs": arguments.ompl_pairs, "budget_s": budget_s}
        _study_ompl.run(maps, folder, workers=arguments.workers, **asked)
        found = write_outputs(folder, title="hybridnav: the study, OMPL", root=data)
        _write(docs / "study-ompl.md", _study_ompl.page(found, **asked))
        save_figure(_study_ompl.chart(found), docs / "images" / "study-ompl-loss.svg")


def write_methods(arguments: argparse.Namespace, docs: Path) -> None:
    """The report of the records, the page and its charts."""
    study = write_outputs(
        arguments.out / "methods", title="hybridnav: the study", root=Path(arguments.data)
    )
    _write(docs / "study.md", page(study, arguments.pairs))
    losses = {label: study.pooled(label, "losses") for label in study.labels}
    times = {
        label: 1e3 * nanquantile(study.pooled(label, "seconds"), 0.5) for label in study.labels
    }
    save_figure(plot_losses(losses), docs / "images" / "study-loss.svg")
    save_figure(plot_speed(losses, times), docs / "images" / "study-speed.svg")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
