"""The house stays small: a limit for each figure, lowered whenever the figure falls."""

from tests.product.house import figures

LIMITS = {
    "code": 56_100,
    "lines": 92_800,
    "files": 392,
    "code outside ext": 39_100,
    "lines of a file, median": 300,
    "lines of a file, most": 450,
    "packages": 12,
    "arrows between packages": 62,
    "arrows, with single modules": 78,
    "files visited by paper": 51,
    "lines visited by paper": 12_550,
    "modules of a plan and a picture": 131,
    "imports, % of the code": 9.3,
    "names at the root": 44,
    "parameters of commands, shared ones once": 139,
    "lines of tests": 56_400,
}


def test_no_figure_of_the_house_is_above_its_limit(tmp_path):
    found = figures(tmp_path / "plan.png")
    assert found.keys() == LIMITS.keys()
    over = {name: (found[name], most) for name, most in LIMITS.items() if found[name] > most}
    assert not over, f"(is, limit) of {over}: make it smaller, or say in the pull request why not"
