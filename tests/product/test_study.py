"""What is published of the study is that of its figures: the page, the quotes, the paper."""

import json
import re
from collections import Counter
from pathlib import Path

import pytest
import yaml

from benchmarks.subjects._study_maps import maps_of
from benchmarks.subjects._study_page import page
from benchmarks.subjects._study_quotes import QUOTES, Quote, found_in, quoted, update
from benchmarks.subjects.study import FIGURES, figures_text
from hybridnav.errors import InvalidValueError

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAPER = ROOT / "paper" / "paper.md"
SECTIONS = [
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "What was reproduced",
    "Measurements",
    "Research impact",
    "Limitations",
    "Use of generative AI",
    "References",
]


@pytest.fixture(scope="module")
def published():
    return json.loads((DOCS / FIGURES).read_text(encoding="utf-8"))


def test_the_page_of_the_study_is_written_from_its_figures(published):
    assert (DOCS / "study.md").read_text(encoding="utf-8") == page(published)
    assert (DOCS / FIGURES).read_text(encoding="utf-8") == figures_text(published)


@pytest.mark.parametrize("quote", QUOTES, ids=lambda quote: f"{quote.file}: {quote.template[:30]}")
def test_quoted_figures_are_those_of_the_study(quote, published):
    text = (ROOT / quote.file).read_text(encoding="utf-8")
    figures = quoted(published)
    assert {name: figures[name] for name in quote.pattern.groupindex} == found_in(
        text, quote
    ).groupdict()


def test_the_figures_of_rooms_beside_the_peers_are_those_of_their_page():
    lines = (DOCS / "explanation/how-rooms-are-found.md").read_text("utf-8").splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if "|" in line]
    (head,) = [row for row in rows if row[:2] == ["building", "method"]]
    (means,) = [row for row in rows if row[:2] == ["mean of all", "judged, unseen"]]
    of = dict(zip(head, means, strict=True))
    said = f"mean MCC {of['MCC']}, {float(of['doors found']):.0%} of doors".replace("%", " %")
    assert said in (DOCS / "peers.md").read_text(encoding="utf-8")


def test_quotes_are_written_in_place(tmp_path):
    (tmp_path / "page.md").write_text("It loses 0.5 %, or\n1,234 m; it loses nothing.\n")
    quote = Quote("page.md", "It loses {share} %, or {metres} m")
    update(tmp_path, (quote,), {"share": "< 0.0001", "metres": "7"})
    text = (tmp_path / "page.md").read_text()
    assert text == "It loses < 0.0001 %, or\n7 m; it loses nothing.\n"
    assert found_in(text, quote).groupdict() == {"share": "< 0.0001", "metres": "7"}
    for words in ("It costs {share} %", "{share}"):
        with pytest.raises(InvalidValueError, match="once"):
            update(tmp_path, (Quote("page.md", words),), {"share": "1"})


def test_the_paper_has_the_sections_and_the_length_of_its_journal():
    text = PAPER.read_text(encoding="utf-8")
    _, head, body = text.split("---\n", 2)
    about = yaml.safe_load(head)
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= about.keys()
    assert about["bibliography"] == "paper.bib"
    assert [author["name"] for author in about["authors"]] == ["The hybridnav developers"]
    assert re.findall(r"^# (.+)$", body, re.MULTILINE) == SECTIONS
    assert 750 <= len(body.split()) <= 1750


def test_the_paper_cites_what_its_bibliography_has_and_nothing_else():
    cited = set(re.findall(r"@([a-z]\w+)", PAPER.read_text(encoding="utf-8").split("---\n", 2)[2]))
    entries = (PAPER.parent / "paper.bib").read_text(encoding="utf-8")
    keys = Counter(re.findall(r"^@\w+\{(\w+),$", entries, re.MULTILINE))
    assert set(keys.values()) == {1}
    assert cited == set(keys)


def test_every_figure_of_the_papers_measurements_is_the_studys():
    text = PAPER.read_text(encoding="utf-8").partition("# Measurements")[2].partition("# Lim")[0]
    known = [found_in(PAPER.read_text("utf-8"), q) for q in QUOTES if q.file == "paper/paper.md"]
    values = (value for match in known for value in match.groupdict().values())
    figures = Counter(re.sub(r"\s+times.*", "", value) for value in values)
    assert Counter(re.findall(r"(?<!\w)(?:< )?-?\d+(?:,\d{3})*(?:\.\d+)?", text)) == figures


def test_a_ratio_of_times_says_which_is_slower():
    rows = [
        {"method": "octile", "speed-up": 0.676216, "speed-up of means": 1.7647},
        {"method": "shortest", "speed-up": 0.013},
    ]
    part = {"methods": rows, "others": [], "pairs": 1, "checks": 1, "contradictions": 0}
    said = quoted({"parts": {"lengths": part}, "maps": [], "plan": {"pairs": 1}})
    assert (said["octile_speed"], said["octile_means"]) == (
        "1.48 times slower",
        "1.76 times faster",
    )
    assert said["shortest_speed"] == "76.9 times slower"


def test_the_citation_names_the_paper():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    title = yaml.safe_load(PAPER.read_text(encoding="utf-8").split("---\n")[1])["title"]
    assert title == citation["preferred-citation"]["title"]


def test_no_page_of_an_older_study_is_left():
    assert sorted(path.name for path in DOCS.glob("study*.md")) == ["study.md"]
    used = re.findall(r"images/(study.+?\.svg)", (DOCS / "study.md").read_text(encoding="utf-8"))
    assert sorted(path.name for path in (DOCS / "images").glob("study*")) == sorted(used)


def test_the_study_has_twelve_maps_of_ros_four_raw_ones_and_twelve_of_movingai(data):
    kinds = Counter(one.kind for one in maps_of(data))
    assert kinds == {"ROS": 12, "SLAM": 4, "MovingAI": 12}
    assert len({one.path for one in maps_of(data)}) == 28
    assert all(Path(one.scenarios).is_file() for one in maps_of(data) if one.scenarios)
    assert [one.kind for one in maps_of(data, ["movingai/mazes/*"])] == ["MovingAI"]
    with pytest.raises(InvalidValueError, match="no map of the study fits nowhere"):
        maps_of(data, ["nowhere"])
