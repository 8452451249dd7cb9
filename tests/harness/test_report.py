"""The HTML report: well-formed, self-contained, escaped, repeatable, small."""

import base64
import dataclasses
import io
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from urllib.parse import unquote

import numpy as np
import pytest
from PIL import Image

from hybridnav.errors import InvalidValueError
from hybridnav.harness.report import (
    CounterExample,
    MapSection,
    ReportData,
    WorstCase,
    paths_uri,
    render_report,
)
from hybridnav.harness.tables import Table
from hybridnav.maps import CellClass, Frame, OccupancyGrid

VOID = {"meta", "link", "br", "img", "hr", "input"}
NAMES = ["grid A*", "weighted A*", "HPA*", "Thrun's map", "exact overlay", "corridor", "portal"]
NAMES += ["simple graph", "HPA* smoothed", "grid Dijkstra"]
OVER = "the octile optimum"


class Page(HTMLParser):
    """Checks that tags close in order; collects elements, ids, links and texts."""

    def __init__(self, html):
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str]]] = []
        self.texts: list[tuple[str, str]] = []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        """No attribute is given twice."""
        self.seen.append((tag, dict(attrs)))
        assert len(dict(attrs)) == len(attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append((self.open[-1] if self.open else "", data))

    def all(self, tag):
        return [attributes for name, attributes in self.seen if name == tag]


def lengthy(rng, mean, count=500):
    losses = rng.gamma(0.6, mean / 0.6, count)
    losses[rng.random(count) < 0.4] = 0
    return losses


def cluttered(rng, rows=100, cols=120):
    """A map of rooms with doors, some clutter, and unexplored patches."""
    cells = np.zeros((rows, cols), np.float32)
    cells[:: rows // 8] = cells[:, :: cols // 6] = 1.0
    for row, col in rng.integers(0, min(rows, cols) - 9, (80, 2)).tolist():
        cells[row : row + 8, col : col + 8] = 0.0
    for row, col in rng.integers(0, min(rows, cols) - 30, (4, 2)).tolist():
        cells[row : row + 25, col : col + 30] = 0.5
    cells[rng.random(cells.shape) < 0.001] = 1.0
    return OccupancyGrid(cells, Frame(0.05))


def worst_case(rng, title="pair 1: 12 %"):
    grid = cluttered(rng)
    n = min(grid.shape) - 20
    drift = rng.integers(-1, 2, n).cumsum()
    path = np.column_stack((np.arange(n) + 10, np.clip(10 + np.arange(n) + drift, 0, n + 9)))
    straight = np.column_stack((np.arange(n) + 10, np.arange(n) + 10))
    return WorstCase(title, paths_uri(grid, *map(grid.frame.points_of, (path, straight))))


def a_report(n_maps=1, names=NAMES, map_name="office"):
    rng = np.random.default_rng(5)
    maps = []
    for index in range(n_maps):
        table = Table(
            ["method", "mean loss"], [[name, "0.1 %"] for name in names], "Loss", frozenset({1})
        )
        maps.append(
            MapSection(
                f"{map_name} {index}",
                facts=[("cells", "19,200")],
                tables=[table],
                losses={OVER: {name: lengthy(rng, 0.01) for name in names}},
                times_ms={name: float(rng.gamma(2)) for name in names},
                worst=[worst_case(rng)],
            )
        )
    criteria = Table(["method", "consistent"], [[name, "yes"] for name in names], "Criteria")
    return ReportData(
        title="Study",
        facts=[("seed", "7")],
        faults=[],
        checks=1234,
        overall=[criteria],
        maps=maps,
        overall_losses={OVER: {name: lengthy(rng, 0.01) for name in names}},
        overall_times_ms={name: float(rng.gamma(2)) for name in names},
    )


def bare_report(**changes):
    report = ReportData(title="t", facts=[], faults=[], checks=0, maps=[])
    return dataclasses.replace(report, **changes)


def wrong_report(*faults, checks):
    examples = [CounterExample(fault) for fault in faults]
    return bare_report(faults=examples, n_faults=len(faults), checks=checks)


def drawings(page):
    kind = "data:image/svg+xml,"
    uris = [image["src"] for image in page.all("img")]
    texts = [unquote(uri.removeprefix(kind)) for uri in uris if uri.startswith(kind)]
    return [ET.fromstring(text) for text in texts]  # noqa: S314 - our own


@pytest.fixture(scope="module")
def text():
    return render_report(a_report(2))


def test_the_page_is_whole_and_needs_no_network(text):
    page = Page(text)
    ids = [attributes["id"] for _, attributes in page.seen if "id" in attributes]
    assert sorted(ids) == ["all", "case-1-1", "case-2-1", "map-1", "map-2"]
    assert {a["href"] for a in page.all("a")} == {"#all", "#map-1", "#map-2"}
    assert not page.all("script") + page.all("link")
    assert not re.search(r"url\((?!#)|@import", unquote(text))
    for _, attributes in page.seen:
        for key in ("src", "href"):
            assert attributes.get(key, "#").startswith(("#", "data:image/"))
    for chart in drawings(page):
        references = [v for e in chart.iter() for k, v in e.items() if k.endswith("href")]
        assert all(reference.startswith("#") for reference in references)


def test_every_map_has_its_facts_tables_charts_and_worst_cases(text):
    page = Page(text)
    titles = [f"Speed against loss over {OVER}, all maps"]
    for name in ("office 0", "office 1"):
        titles += [f"Loss over {OVER}, {name}", f"Speed against loss over {OVER}, {name}"]
        titles.append("pair 1: 12 %")
    assert [image["alt"] for image in page.all("img")] == titles
    assert [data for name, data in page.texts if name == "strong"] == [f"{t}." for t in titles]
    assert [data for name, data in page.texts if name == "caption"] == ["Criteria", "Loss", "Loss"]
    assert {th["scope"] for th in page.all("th")} == {"col", "row"}
    shown = [data for _, data in page.texts]
    assert shown.count("19,200") == 2
    for name in NAMES:
        assert shown.count(name) == 3


def test_charts_name_their_methods_and_units(text):
    loss, speed = drawings(Page(text))[1:3]
    texts = [{element.text for element in chart.iter() if element.text} for chart in (loss, speed)]
    assert {"loss in per cent", "pairs that lose more, in per cent"} <= texts[0]
    assert {"median time of a query in ms", "mean loss in per cent"} <= texts[1]
    for name in NAMES:
        assert all(any(text.startswith(f"{name}: ") for text in found) for found in texts)


def test_equal_data_give_equal_text(text):
    assert render_report(a_report(2)) == text


def test_names_cannot_break_out_of_the_page():
    nasty = '</title></script><script>alert("1")&\'$x_ {{ 1 }}\x00\udcff'
    report = a_report(names=[nasty, "_b"], map_name=nasty)
    report.maps[0].worst.append(dataclasses.replace(report.maps[0].worst[0], title=nasty))
    again = dataclasses.replace(
        report,
        title=nasty,
        facts=[(nasty, nasty)],
        faults=[CounterExample(nasty)],
        overall=[Table([nasty], [[nasty]], nasty)],
    )
    html = render_report(again)
    page = Page(html)
    assert not page.all("script")
    assert html.encode("utf-8").decode("utf-8") == html
    shown = "".join(data for _, data in page.texts)
    clean = '</title></script><script>alert("1")&\'$x_ {{ 1 }}\ufffd\ufffd'
    assert shown.count(clean) == 14
    for chart in drawings(page):
        assert {element.tag.rpartition("}")[2] for element in chart.iter()}.isdisjoint({"script"})
        texts = [element.text or "" for element in chart.iter()]
        assert any(text.startswith("</title></script><script>alert") for text in texts)
        assert any(text.startswith("_b: ") for text in texts)


def test_names_in_other_scripts_are_drawn_as_text():
    (_, chart) = drawings(
        Page(
            render_report(
                bare_report(
                    maps=[
                        MapSection(
                            "m", times_ms={"規劃": 1}, losses={OVER: {"規劃": np.array([0.1])}}
                        )
                    ]
                )
            )
        )
    )
    assert any((element.text or "").startswith("規劃: ") for element in chart.iter())


def test_counter_examples_come_first_and_in_red():
    html = render_report(wrong_report("corridor: no path", "portal: wall", checks=9000))
    assert '<div class="box bad">' in html
    assert "2 counter-examples in 9,000 checks" in html
    assert html.index("corridor: no path") < html.index("Contents") < html.index("<main>")
    assert "No counter-example" not in html
    assert "1 counter-example in 3 checks" in render_report(wrong_report("a", checks=3))


def test_a_clean_run_says_how_much_was_checked():
    assert "No counter-example in 12 checks" in render_report(bare_report(checks=12))
    assert "Nothing was checked" in render_report(bare_report(checks=0))


def test_a_table_aligns_numbers_and_refuses_ragged_rows():
    table = Table(["method", "loss"], [["a", "1"]], "Loss", frozenset({1}))
    html = render_report(bare_report(overall=[table]))
    assert '<th scope="col" class="n">loss</th>' in html
    assert '<th scope="row">a</th><td class="n">1</td>' in html
    with pytest.raises(InvalidValueError, match="'Loss': a row has 1 cells, expected 2"):
        Table(["method", "loss"], [["a"]], "Loss")


@pytest.mark.parametrize(
    "section",
    [
        MapSection("nothing"),
        MapSection("one method", losses={OVER: {"a": np.array([0.0, 0.02])}}, times_ms={"a": 1.0}),
        MapSection("unsolved", losses={OVER: {"a": np.empty(0)}}, times_ms={"a": np.nan}),
        MapSection(
            "unknown", losses={OVER: {"a": np.array([np.nan, np.inf])}}, times_ms={"a": 0.0}
        ),
        MapSection("no loss", losses={OVER: {"a": np.zeros(4)}}, times_ms={"a": 1e-5}),
        MapSection("huge", losses={OVER: {"a": np.array([50.0])}}, times_ms={"a": 1e7}),
        MapSection("shorter", losses={OVER: {"a": np.array([-0.2, -0.1])}}, times_ms={"a": 3.0}),
        MapSection("no time", losses={OVER: {"a": np.array([0.1])}}),
        MapSection("time alone", times_ms={"a": 0.1}),
    ],
    ids=lambda section: section.name,
)
def test_sparse_data_still_make_a_page(section):
    html = render_report(
        bare_report(
            maps=[section], overall_losses=section.losses, overall_times_ms=section.times_ms
        )
    )
    page = Page(html)
    assert html.count("<figcaption>") == 2 * bool(section.losses)
    for chart in drawings(page):
        assert not re.search(r"\b(nan|inf)\b", ET.tostring(chart, "unicode"))


def test_methods_without_values_are_named_below_their_chart():
    losses = {"a": np.array([0.1]), "dead & gone": np.array([np.nan])}
    times_ms = {"a": 1.0, "dead & gone": 2.0}
    section = MapSection("m", losses={OVER: losses}, times_ms=times_ms)
    html = render_report(
        bare_report(maps=[section, MapSection("none", losses={OVER: {"a": losses["a"]}})])
    )
    assert html.count("Not drawn, for want of values: dead &amp; gone.") == 2
    assert "No method has both a time and a loss." in html


def test_a_study_of_24_maps_stays_small(text):
    (case, *_) = (image["src"] for image in Page(text).all("img") if "png" in image["src"][:20])
    assert 24 * (len(text) / 2 + 30 * len(case)) < 24e6


def test_a_picture_of_paths_is_the_right_way_up_and_leaves_the_map_alone():
    cells = np.zeros((30, 30), np.float32)
    cells[0] = 1.0
    grid = OccupancyGrid(cells, Frame(0.1))
    assert (grid.classes[0] == CellClass.OCCUPIED).all()
    path = grid.frame.points_of([(row, 3) for row in range(2, 27)])
    path.flags.writeable = False
    uri = paths_uri(grid, path, path[::-1])
    with Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))) as image:
        assert image.format == "PNG"
        assert image.getcolors(32) is not None
        dark = np.asarray(image.convert("L")) < 60
    widths = dark.sum(axis=1)
    assert widths.argmax() > len(widths) / 2
    assert widths.max() > 100


def test_measuring_loads_no_matplotlib():
    code = "import sys, hybridnav.harness; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
