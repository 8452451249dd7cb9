"""The HTML report: well-formed, self-contained, escaped, repeatable, small, right way up."""

import base64
import dataclasses
import io
import itertools
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.harness.charts import loss_chart, speed_chart
from hybridnav.harness.map_picture import crop_box, downsampled, draw_case, png_uri
from hybridnav.harness.report_html import (
    MapSection,
    ReportData,
    Table,
    WorstCase,
    render_report,
)
from hybridnav.harness.svg import (
    Rect,
    Scale,
    escape,
    looks,
    number,
    percent,
    placed_labels,
    rounded_share,
    text_width,
)

VOID = {"meta", "link", "br", "img", "hr", "input"}
NAMES = ["grid A*", "weighted A*", "HPA*", "Thrun's map", "exact overlay", "corridor", "portal"]
NAMES += ["simple graph", "HPA* smoothed", "grid Dijkstra"]
RED, BLUE = "path", "optimum"


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

    def handle_startendtag(self, tag, attrs):
        """An element of SVG without content."""
        self.seen.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        """Tags close in order."""
        assert self.open.pop() == tag

    def handle_data(self, data):
        """A text and the element it is in."""
        self.texts.append((self.open[-1] if self.open else "", data))

    def all(self, tag):
        """Attributes of each element of a name."""
        return [attributes for name, attributes in self.seen if name == tag]

    def texts_in(self, tag):
        """Texts directly in elements of a name."""
        return [data for name, data in self.texts if name == tag]


def lengthy(rng, mean, count=500):
    losses = rng.gamma(0.6, mean / 0.6, count)
    losses[rng.random(count) < 0.4] = 0
    return losses


def staircase(start, moves):
    return np.cumsum(np.array([start, *moves], dtype=np.float64), axis=0)


def rooms(rows, cols, rng):
    """A map of rooms with doors, some clutter, and unexplored patches."""
    classes = np.full((rows, cols), CellClass.FREE, np.uint8)
    classes[:: rows // 8] = CellClass.OCCUPIED
    classes[:, :: cols // 6] = CellClass.OCCUPIED
    for row, col in rng.integers(0, min(rows, cols) - 9, (80, 2)).tolist():
        classes[row : row + 8, col : col + 8] = CellClass.FREE
    for row, col in rng.integers(0, min(rows, cols) - 30, (12, 2)).tolist():
        classes[row : row + 25, col : col + 30] = CellClass.UNEXPLORED
    classes[rng.random(classes.shape) < 0.001] = CellClass.OCCUPIED
    return classes


def worst_case(classes, rng, title="pair 1: 12 %"):
    n = min(classes.shape) - 20
    drift = rng.integers(-1, 2, n).cumsum()
    path = np.column_stack((np.arange(n) + 10, np.clip(10 + np.arange(n) + drift, 0, n + 9)))
    straight = np.column_stack((np.arange(n) + 10, np.arange(n) + 10))
    return WorstCase(title, classes, 0.05, path.astype(float), straight.astype(float))


def a_report(n_maps=2, n_worst=2, size=(120, 160), names=NAMES, map_name="office"):
    rng = np.random.default_rng(5)
    maps = []
    for index in range(n_maps):
        classes = rooms(size[0], size[1], rng)
        table = Table(
            ["method", "mean loss"], [[name, "0.1 %"] for name in names], "Loss", frozenset({1})
        )
        maps.append(
            MapSection(
                f"{map_name} {index}",
                facts=[("cells", "19,200")],
                tables=[table],
                losses={name: lengthy(rng, 0.01) for name in names},
                times_ms={name: float(rng.gamma(2)) for name in names},
                worst=[worst_case(classes, rng) for _ in range(n_worst)],
            )
        )
    criteria = Table(["method", "consistent"], [[name, "yes"] for name in names], "Criteria")
    return ReportData(
        title="Study",
        facts=[("seed", "7")],
        faults=[],
        checks=1234,
        criteria=criteria,
        maps=maps,
        overall_losses={name: lengthy(rng, 0.01) for name in names},
        overall_times_ms={name: float(rng.gamma(2)) for name in names},
    )


def bare_report(**changes):
    table = Table(["method"], [], "Criteria")
    report = ReportData(title="t", facts=[], faults=[], checks=0, criteria=table, maps=[])
    return dataclasses.replace(report, **changes)


def picture(svg):
    """Pixels of a drawing's map as grey values, its top row first."""
    (uri,) = re.findall(r'href="data:image/png;base64,([^"]+)"', svg)
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(uri))).convert("L"))


def line(svg, style):
    (points,) = re.findall(rf'class="{style}" points="([^"]+)"', svg)
    return np.array([[float(v) for v in point.split(",")] for point in points.split()])


def tick_labels(svg, box):
    """Texts below the axis with their places, and those left of it."""
    found = re.findall(r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="(\w+)">([^<]+)<', svg)
    below = [(float(x), t) for x, y, a, t in found if a == "middle" and float(y) > box.bottom]
    beside = [(float(y), t) for x, y, a, t in found if a == "end" and float(x) < box.left]
    return below, beside


# The page


def test_the_page_is_well_formed_and_every_link_has_its_target():
    page = Page(render_report(a_report()))
    ids = [attributes["id"] for _, attributes in page.seen if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {a["href"] for a in page.all("a")} == {"#all", "#map-1", "#map-2"}
    assert {"all", "map-1", "map-2"} <= set(ids)


def test_the_page_needs_no_network():
    page_text = render_report(a_report())
    page = Page(page_text)
    assert not re.search(r"https?://|url\(|@import", page_text)
    assert not page.all("script")
    assert not page.all("link")
    for _, attributes in page.seen:
        for key in ("src", "href"):
            assert attributes.get(key, "#").startswith(("#", "data:image/png"))


def test_figures_have_titles_and_tables_have_captions_and_headers():
    page = Page(render_report(a_report()))
    assert page.all("svg")
    assert all(svg["role"] == "img" for svg in page.all("svg"))
    assert len(page.all("figure")) == len(page.all("svg")) == len(page.all("figcaption"))
    assert len(page.all("table")) == len(page.all("caption")) == len(page.all("thead"))
    assert {th["scope"] for th in page.all("th")} == {"col", "row"}
    tags = [tag for tag, _ in page.seen]
    assert all(tags[i + 1] == "title" for i, tag in enumerate(tags) if tag == "svg")


def test_the_page_follows_dark_mode_and_prints_light():
    page = render_report(bare_report())
    assert "@media screen and (prefers-color-scheme:dark)" in page
    assert "@media print" in page


def test_equal_data_give_equal_text():
    assert render_report(a_report()) == render_report(a_report())


def test_names_cannot_break_out_of_the_page():
    nasty = '</title></script><script>alert("1")&\'\x00\udcff'
    report = a_report(1, 1, names=[nasty, "b"], map_name=nasty)
    case = WorstCase(nasty, report.maps[0].worst[0].classes, 0.05, np.zeros((0, 2)))
    report.maps[0].worst.append(case)
    again = bare_report(
        title=nasty,
        facts=[(nasty, nasty)],
        faults=[nasty],
        maps=report.maps,
        overall_losses=report.overall_losses,
        overall_times_ms=report.overall_times_ms,
        criteria=Table([nasty], [[nasty]], nasty),
    )
    html = render_report(again)
    page = Page(html)
    assert not page.all("script")
    assert html.encode("utf-8").decode("utf-8") == html
    shown = "".join(data for _, data in page.texts)
    assert '</title></script><script>alert("1")&\'\ufffd\ufffd' in shown


@given(st.text())
def test_escaped_text_comes_back_from_a_parser(content):
    page = Page(f'<p title="{escape(content)}">{escape(content)}</p>')
    assert page.all("p")[0]["title"].replace("\ufffd", "") == "".join(
        c for c in content if c in "\t\n\r" or escape(c) != "\ufffd"
    ).replace("\ufffd", "")


def test_counter_examples_come_first_and_in_red():
    html = render_report(bare_report(faults=["corridor: no path", "portal: wall"], checks=9000))
    assert '<div class="box bad">' in html
    assert "2 counter-examples in 9,000 checks" in html
    assert html.index("corridor: no path") < html.index("Contents") < html.index("<main>")
    assert "No counter-example" not in html


def test_a_clean_run_says_how_much_was_checked():
    assert "No counter-example in 12 checks" in render_report(bare_report(checks=12))
    assert "Nothing was checked" in render_report(bare_report(checks=0))


def test_a_table_aligns_numbers_and_refuses_ragged_rows():
    table = Table(["method", "loss"], [["a", "1"]], "Loss", frozenset({1}))
    html = render_report(bare_report(criteria=table))
    assert '<th scope="col" class="n">loss</th>' in html
    assert '<th scope="row">a</th><td class="n">1</td>' in html
    with pytest.raises(InvalidValueError, match="'Loss': a row has 1 cells, expected 2"):
        Table(["method", "loss"], [["a"]], "Loss")


@pytest.mark.parametrize(
    "section",
    [
        MapSection("nothing"),
        MapSection("one method", losses={"a": np.array([0.0, 0.02])}, times_ms={"a": 1.0}),
        MapSection("unsolved", losses={"a": np.empty(0)}, times_ms={"a": np.nan}),
        MapSection("unknown", losses={"a": np.array([np.nan, np.inf])}, times_ms={"a": 0.0}),
        MapSection("no loss", losses={"a": np.zeros(4)}, times_ms={"a": 1e-5}),
        MapSection("huge", losses={"a": np.array([50.0])}, times_ms={"a": 1e7}),
        MapSection("shorter", losses={"a": np.array([-0.2, -0.1])}, times_ms={"a": 3.0}),
        MapSection("no time", losses={"a": np.array([0.1])}),
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
    Page(html)
    assert not re.search(r'"[^"<>]*\b(nan|inf)\b[^"<>]*"', html)


def test_methods_without_values_are_named_below_their_chart():
    losses = {"a": np.array([0.1]), "dead & gone": np.array([np.nan])}
    chart = loss_chart(losses, looks(losses), "Loss")
    assert "Not drawn, for want of values: dead &amp; gone." in chart
    assert "Not drawn" not in loss_chart({"a": losses["a"]}, looks(losses), "Loss")


def test_a_study_of_24_maps_stays_small():
    one_map = a_report(1, 30, size=(500, 600))
    size = len(render_report(one_map).encode())
    without = len(render_report(bare_report()).encode())
    assert without + 24 * (size - without) < 6e6


# Charts


def test_the_loss_chart_tells_the_share_without_loss():
    losses = {"exact": np.zeros(3), "good": np.array([0, 1e-10, 0.01, np.nan]), "bad": np.ones(7)}
    page = Page(loss_chart(losses, looks(losses), "Loss"))
    texts = page.texts_in("text")
    assert {"exact: 100\u00a0%", "good: 66.7\u00a0%", "bad: 0\u00a0%"} <= set(texts)


def test_the_loss_line_falls_at_each_loss():
    chart = loss_chart({"a": np.array([0, 0.001, 0.01, 0.01])}, looks(["a"]), "Loss")
    (d,) = re.findall(r'class="line c0" d="(M[^"h]+)"', chart)
    assert [float(v) for v in re.findall(r"V([\d.]+)", d)] == sorted(
        float(v) for v in re.findall(r"V([\d.]+)", d)
    )
    assert len(re.findall("V", d)) == 2
    assert d.split("V")[-1].split("H")[0] == "260"


@pytest.mark.parametrize("pairs", [200, 3000])
def test_the_loss_chart_shows_how_many_pairs_lose_much(pairs):
    losses = {"few": np.zeros(pairs), "more": np.zeros(pairs), "common": np.full(pairs, 0.001)}
    losses["few"][:1], losses["more"][:3] = 0.2, 0.2
    chart = loss_chart(losses, looks(losses), "Loss")
    heights = re.findall(r'class="line c(\d)" d="M[\d.]+ ([\d.]+)', chart)
    few, more, common = (float(y) for _, y in sorted(heights[:3]))  # the others are of the legend
    assert few - more >= 15  # pixels, y down; the axis is at 260
    assert more - common >= 15
    assert 260 - few >= 15


def test_methods_are_told_apart_without_colour():
    several = looks(f"method {i}" for i in range(35))
    assert len({(look.colour, look.dash) for look in several.values()}) == 35
    assert len({(look.colour, look.marker) for look in several.values()}) == 35
    first = list(several.values())[:5]
    assert len({look.dash for look in first}) == len({look.marker for look in first}) == 5


@given(st.lists(st.tuples(st.floats(1e-4, 1e6), st.floats(-0.5, 60)), min_size=1, max_size=12))
def test_tick_labels_never_collide(points):
    losses = {str(i): np.array([mean]) for i, (_, mean) in enumerate(points)}
    times = {str(i): time for i, (time, _) in enumerate(points)}
    for chart, box in (
        (loss_chart(losses, looks(losses), "Loss"), Rect(58, 30, 440, 230)),
        (speed_chart(losses, times, looks(losses), "Speed"), Rect(58, 30, 620, 290)),
    ):
        below, beside = tick_labels(chart, box)
        below = [(x, label) for x, label in below if label[0] in "0123456789\u2212"]
        assert len(below) >= 2
        assert len(beside) >= 2
        for (x, label), (after, next_label) in itertools.pairwise(sorted(below)):
            assert after - x > (text_width(label) + text_width(next_label)) / 2 - 8
        assert all(b[0] - a[0] >= 13 for a, b in itertools.pairwise(sorted(beside)))


@given(
    st.lists(st.tuples(st.floats(70, 660), st.floats(40, 310)), min_size=1, max_size=10),
)
def test_labels_of_ten_methods_never_overlap(points):
    names = NAMES[: len(points)]
    boxes = [box for box, _ in placed_labels(points, names, Rect(58, 30, 620, 290))]
    for a, b in itertools.combinations(boxes, 2):
        assert a.shared(b) == 0
    for box in boxes:
        assert box.left >= 58
        assert box.right <= 678


def test_ticks_are_round():
    assert Scale("linear", 0, 0.8, 0, 200).ticks(40) == [0, 0.2, 0.4, 0.6, 0.8]
    assert Scale("log", 1e-4, 0.1, 0, 200).ticks(46) == [1e-4, 1e-3, 1e-2, 1e-1]
    assert Scale("symlog", 0, 0.1, 0, 300).ticks(30) == [0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1]


def test_a_scale_stops_at_its_ends():
    scale = Scale("log", 1, 100, 10, 30)
    assert [scale(value) for value in (0.1, 1, 10, 100, 1e9)] == [10, 10, 20, 30, 30]


def test_numbers_are_short_and_shares_are_not_rounded_to_certainty():
    assert percent(1e-4) == "0.01\u00a0%"
    assert number(20000.0) == "20000"
    assert number(0.007) == "0.007"
    assert number(-3.0) == "\u22123"
    assert rounded_share(0.99999) == "> 99.9\u00a0%"
    assert rounded_share(1e-5) == "< 0.1\u00a0%"
    assert [rounded_share(s) for s in (0, 0.979, 1)] == ["0\u00a0%", "97.9\u00a0%", "100\u00a0%"]


# Worst cases


def test_row_0_of_a_map_is_at_the_bottom_of_its_picture():
    classes = np.full((30, 30), CellClass.FREE, np.uint8)
    classes[0] = CellClass.OCCUPIED
    classes[:, 0] = CellClass.UNEXPLORED
    path = staircase((2, 3), [(1, 0)] * 24)
    svg = draw_case(classes, path, None, resolution_m=0.1, title="t")
    shown = picture(svg)
    assert shown[-1, 5] < 80
    assert shown[0, 5] == 255
    assert 120 < shown[5, 0] < 220
    drawn = line(svg, RED)
    assert drawn[0, 1] > drawn[-1, 1]
    assert np.allclose(drawn[:, 0], drawn[0, 0])


def test_the_path_lies_on_its_cells():
    classes = np.full((40, 50), CellClass.OCCUPIED, np.uint8)
    path = staircase((5, 5), [(0, 1)] * 20 + [(1, 0)] * 15 + [(0, 1)] * 10)
    classes[tuple(path.astype(int).T)] = CellClass.FREE
    svg = draw_case(classes, path, path[:5], resolution_m=1.0, title="t")
    shown, drawn = picture(svg), line(svg, RED)
    (width,) = re.findall(r'<image [^>]*width="([\d.]+)"', svg)
    unit = float(width) / shown.shape[1]
    assert len(drawn) == 4
    corners = np.floor(drawn / unit).astype(int)
    assert (shown[corners[:, 1], corners[:, 0]] == 255).all()
    assert (shown == 255).sum() == len(path)


def test_walls_survive_downsampling_and_free_beats_unexplored():
    classes = np.full((1000, 1300), CellClass.FREE, np.uint8)
    classes[:, 700] = CellClass.OCCUPIED
    classes[3, 7] = CellClass.UNEXPLORED
    small = downsampled(classes, 3)
    assert small.shape == (334, 434)
    assert (small[:, 233] == 2).all()
    assert (np.delete(small, 233, axis=1) == 1).all()


def test_a_large_map_becomes_a_small_picture_of_the_part_round_the_paths():
    classes = np.full((3000, 4000), CellClass.FREE, np.uint8)
    long = np.column_stack((np.arange(2500), np.arange(2500))).astype(float)
    assert max(picture(draw_case(classes, long, None, resolution_m=0.05, title="t")).shape) <= 500
    short = staircase((100, 200), [(1, 1)] * 20)
    svg = draw_case(classes, short, None, resolution_m=0.05, title="t")
    assert picture(svg).shape == (29, 29)


def test_the_crop_holds_both_paths_and_stays_in_the_map():
    path = staircase((0, 0), [(0, 1)] * 99)
    optimum = staircase((0, 0), [(1, 0)] * 10)
    low, high, left, right = crop_box((50, 120), [path, optimum])
    assert (low, left) == (0, 0)
    assert 11 <= high <= 50
    assert 100 <= right <= 120
    assert crop_box((50, 120), []) == (0, 50, 0, 120)


@pytest.mark.parametrize(("resolution", "told"), [(0.05, "0.5\u00a0m"), (1.0, "10\u00a0m")])
def test_the_scale_bar_is_as_long_as_it_says(resolution, told):
    classes = np.full((21, 29), CellClass.FREE, np.uint8)
    path = staircase((10, 0), [(0, 1)] * 28)
    svg = draw_case(classes, path, None, resolution_m=resolution, title="t")
    page = Page(svg)
    assert page.texts_in("text") == [told]
    (length,) = re.findall(r'class="bar" d="[^"]*h([\d.]+)v', svg)
    metres = float(told.removesuffix("\u00a0m"))
    assert float(length) == pytest.approx(metres / resolution * 320 / 29, abs=0.1)


@pytest.mark.parametrize("n_cells", [0, 1, 2])
def test_short_paths_are_drawn(n_cells):
    classes = np.full((3, 4), CellClass.FREE, np.uint8)
    path = np.array([[1, 1], [1, 2]], dtype=np.float64)[:n_cells]
    page = Page(draw_case(classes, path, path, resolution_m=0.05, title="t"))
    assert len(page.all("image")) == 1
    assert len(page.all("circle")) == min(n_cells, 1)


def test_a_closed_path_is_drawn():
    classes = np.full((300, 300), CellClass.FREE, np.uint8)
    path = staircase((5, 5), [(0, 1)] * 9 + [(0, -1)] * 9)
    svg = draw_case(classes, path, None, resolution_m=0.05, title="t")
    assert np.ptp(line(svg, RED)[:, 0]) > 50


def test_pictures_are_png_with_few_colours():
    uri = png_uri(np.array([[0, 1], [2, 1]], np.uint8))
    image = Image.open(io.BytesIO(base64.b64decode(uri.split(",")[1])))
    assert image.format == "PNG"
    assert len(set(image.convert("RGB").get_flattened_data())) == 3


def test_drawing_leaves_the_map_alone():
    classes = np.full((9, 9), CellClass.FREE, np.uint8)
    classes.flags.writeable = False
    path = staircase((1, 1), [(1, 1)] * 4)
    path.flags.writeable = False
    optimum = path[::-1]
    svg = draw_case(classes, path, optimum, resolution_m=0.05, title="t")
    assert line(svg, BLUE).shape == (2, 2)
