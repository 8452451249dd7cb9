"""The house stays small: a limit for each figure, lowered whenever the figure falls."""

from __future__ import annotations

from tests.product.house import figures

LIMITS = {
    "code": 61_100,
    "lines": 100_000,
    "files": 598,
    "code outside ext": 61_100,
    "lines of a file, median": 300,
    "lines of a file, most": 450,
    "packages": 29,
    "arrows between packages": 160,
    "arrows, with single modules": 299,
    "files visited by paper": 60,
    "lines visited by paper": 10_600,
    "modules of a plan and a picture": 215,
    "imports, % of the code": 11.3,
    "lines of tests": 58_300,
}


def test_no_figure_of_the_house_is_above_its_limit(tmp_path):
    found = figures(tmp_path / "plan.png")
    assert found.keys() == LIMITS.keys()
    over = {name: (found[name], most) for name, most in LIMITS.items() if found[name] > most}
    assert not over, f"(is, limit) of {over}: make it smaller, or say in the pull request why not"
