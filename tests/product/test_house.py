"""The house stays small: a limit for each figure, lowered whenever the figure falls."""

import re

from tests.product.house import ROOT, SRC, figures, visited_by_paper

LIMITS = {
    "code": 63_500,
    "lines": 101_000,
    "files": 405,
    "code outside ext": 46_500,
    "lines of a file, median": 290,
    "lines of a file, most": 600,
    "packages": 18,
    "arrows between packages": 124,
    "arrows, with single modules": 156,
    "files visited by paper": 56,
    "lines visited by paper": 14_000,
    "modules of a plan and a picture": 140,
    "imports, % of the code": 9.1,
    "long kernels without headings": 0,
    "names at the root": 56,
    "parameters of commands, shared ones once": 126,
    "lines of tests": 69_000,
}


def test_no_figure_of_the_house_is_above_its_limit(tmp_path):
    found = figures(tmp_path / "plan.png")
    assert found.keys() == LIMITS.keys()
    over = {name: (found[name], most) for name, most in LIMITS.items() if found[name] > most}
    assert not over, f"(is, limit) of {over}: make it smaller, or say in the pull request why not"


def test_the_page_on_a_plan_walks_files_that_paper_visits():
    page = (ROOT / "docs" / "explanation" / "how-a-plan-is-made.md").read_text()
    walked = re.findall(r"^\d+\. `([\w/]+\.py)`", page, re.MULTILINE)
    assert len(set(walked)) == len(walked) == 12
    visited = {path.relative_to(SRC).as_posix() for path in visited_by_paper()}
    assert set(walked) <= visited


def test_pages_name_files_that_exist():
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    named = {
        (page.name, name)
        for page in pages
        for name in re.findall(r"`((?:[a-z_]+/)+[a-z_]+\.py)`", page.read_text())
        if not name.startswith(("out/", "rmf_"))
    }
    assert named
    gone = {(page, name) for page, name in named if not (SRC / name).exists()}
    assert {(page, name) for page, name in gone if not (ROOT / name).exists()} == set()
