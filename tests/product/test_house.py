"""The house stays small: a limit for each figure, lowered whenever the figure falls."""

from __future__ import annotations

from tests.product.house import figures

LIMITS = {
    "code": 57_200,
    "lines": 94_000,
    "files": 557,
    "code outside ext": 57_200,
    "lines of a file, median": 300,
    "lines of a file, most": 450,
    "packages": 28,
    "arrows between packages": 152,
    "arrows, with single modules": 286,
    "files visited by paper": 60,
    "lines visited by paper": 10_510,
    "modules of a plan and a picture": 212,
    "imports, % of the code": 11.3,
    "lines of tests": 56_800,
}


def test_no_figure_of_the_house_is_above_its_limit(tmp_path):
    found = figures(tmp_path / "plan.png")
    assert found.keys() == LIMITS.keys()
    over = {name: (found[name], most) for name, most in LIMITS.items() if found[name] > most}
    assert not over, f"(is, limit) of {over}: make it smaller, or say in the pull request why not"
