"""The study: Thrun's three criteria for every method on 28 public maps, by one command.

`make study` runs the quarter, `make study STUDY=whole` the whole. Twelve ROS maps and four raw maps
of SLAM (robot radius 0.25 m, merge distance 4 m, sampled pairs), and twelve MovingAI maps (cells of
1 m, a point robot, merge distance 40 m, pairs of their scenario files, whose optima are an oracle).
A run that was stopped goes on where it was. DIR, else out/study or out/study-whole, gets a folder
of records for each part: lengths, costs, OMPL.

The checkout gets `docs/data/study.json` with the figures of all tables, and from these
`docs/study.md`, the charts in `docs/images`, and every quoted figure in the README, the
documentation and the paper. With --map, --part, --pairs or --repeat, or where
maps are missing, the pages stay in DIR/docs, and no quote changes: it is not the study. Missing
maps are listed, and the others run; `python -m benchmarks fetch FOLDER` gets them.
"""

import json
import os
import sys
import time
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from benchmarks.common import ROOT
from benchmarks.options import DATA, MAPS, Refused, option
from benchmarks.subjects._study_beside import CHART as BESIDE_CHART
from benchmarks.subjects._study_beside import MAP as BESIDE_MAP
from benchmarks.subjects._study_beside import plot_beside
from benchmarks.subjects._study_charts import charts_of, write_charts
from benchmarks.subjects._study_data import LEVELS_FILE, Data, collect
from benchmarks.subjects._study_descent import CHART, levels_of, plot_levels_of
from benchmarks.subjects._study_maps import lost_of, maps_of
from benchmarks.subjects._study_page import page
from benchmarks.subjects._study_quotes import QUOTES, quoted, update
from benchmarks.subjects._study_run import PLANS, parts_of, run
from hybridnav._base.files import replace_file
from hybridnav.errors import HybridNavError
from hybridnav.viz import save_figure

PART = "part"
"""Name of a plan that asks less than the study does."""
FIGURES = Path("data", "study.json")
"""Where the folder of pages keeps the figures of all tables."""


def write_all(folder: Path, root: Path, kinds: Mapping[str, str], docs: Path) -> Data:
    """Write all outputs of the records in a folder, and return the figures.

    `folder`: the study's folder; `root`: maps are named by their paths from here; `kinds`: the kind
    of each map by that name; `docs`: folder of the page, its charts and its figures.
    """
    data = collect(folder, root, kinds)
    for made in (docs / FIGURES, docs / "images"):
        (made.parent if made.suffix else made).mkdir(parents=True, exist_ok=True)
    replace_file(docs / FIGURES, figures_text(data).encode())
    write_pages(docs)
    write_charts(charts_of(folder, root), docs / "images")
    return data


def figures_text(data: Data) -> str:
    """Return the figures as the text of their file."""
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_pages(docs: Path) -> None:
    """Write the page from the file of figures beside it."""
    data = json.loads((docs / FIGURES).read_text(encoding="utf-8"))
    replace_file(docs / "study.md", page(data).encode())
    (docs / "images").mkdir(exist_ok=True)
    if any(each["map"] == BESIDE_MAP for each in data["maps"]):  # a part of a study may have others
        save_figure(plot_beside(data), docs / "images" / BESIDE_CHART)


OPTIONS = [
    option("--study", choices=tuple(PLANS), default="quarter"),
    DATA,
    option("-o", "--out", type=Path, help="else out/study, or out/study-whole"),
    option("--workers", type=int, default=os.cpu_count() or 1),
    option("--scheduler", metavar="ADDRESS", help="of a dask.distributed cluster"),
    option("--pairs", type=int, help="of each map; else the study's"),
    option("--repeat", type=int, help="queries of each pair; else the study's"),
    MAPS,
    option("--part", choices=("lengths", "costs", "ompl")),
    option("--pages-only", action="store_true", help="from docs/data/study.json"),
    option("--descent", action="store_true", help="the chart of the levels alone, anew"),
]


def main(given: Namespace) -> int:
    """Run the study, and write its outputs."""
    given.out = given.out or Path("out", "study" if given.study == "quarter" else "study-whole")
    if given.pages_only:
        write_pages(ROOT / "docs")
        _quote()
        return 0
    if given.data is None:
        raise Refused("the study needs the folder of maps: --data FOLDER or HYBRIDNAV_DATA")
    began = time.monotonic()
    if given.descent:
        _levels_anew(given.data.resolve())
        return 0
    own = {"pairs": given.pairs, "ompl_pairs": given.pairs, "repeat": given.repeat}
    plan = replace(PLANS[given.study], **{key: n for key, n in own.items() if n is not None})
    data = given.data.resolve()
    lost = lost_of(data)
    is_whole = plan == PLANS[given.study] and not given.map and not given.part and not lost
    plan = plan if is_whole else replace(plan, name=PART)
    try:
        maps = maps_of(data, given.map)
        sys.stderr.writelines(f"not in {data}, left out: {name}\n" for name in lost)
        parts = [part for part in parts_of(plan) if given.part in {None, part.name}]
        run(maps, given.out, plan, parts, workers=given.workers, scheduler=given.scheduler)
        if not (given.out / LEVELS_FILE).exists() and not given.part:
            text = json.dumps(levels_of(maps, data), indent=1) + "\n"
            replace_file(given.out / LEVELS_FILE, text.encode())
        kinds = {one.path.relative_to(data).with_suffix("").as_posix(): one.kind for one in maps}
        docs = ROOT / "docs" if is_whole else given.out / "docs"
        write_all(given.out, data, kinds, docs)
        if is_whole:
            _quote()
    except HybridNavError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    minutes = (time.monotonic() - began) / 60
    sys.stderr.write(f"{minutes:.1f} minutes: {given.out} and {docs / 'study.md'}\n")
    return 0


def _levels_anew(data: Path) -> None:
    """Measure descents that end at each level, into the figures, the page and its chart."""
    if lost := lost_of(data):
        raise Refused(f"not in {data}: {', '.join(lost)}; python -m benchmarks fetch gets them")
    file = ROOT / "docs" / FIGURES
    figures = json.loads(file.read_text(encoding="utf-8"))
    figures["descent"] = levels_of(maps_of(data), data)
    replace_file(file, figures_text(figures).encode())
    save_figure(plot_levels_of(figures["descent"]), ROOT / "docs" / "images" / CHART)
    write_pages(ROOT / "docs")


def _quote() -> None:
    """Write the figures into all files that quote them."""
    data = json.loads((ROOT / "docs" / FIGURES).read_text(encoding="utf-8"))
    update(ROOT, QUOTES, quoted(data))
