"""The ledger: what has become of every public name, option and key of presets.

`names.txt` holds what there was before the house was halved; it never changes. `ledger.tsv` has a
line for each of these that is no longer what it was: the old name, its fate, the name now, and why.
What has no line must still be there. `features.tsv` has a line for each feature that README, docs
and CHANGELOG promise: its fate, the page, the tests that hold it, the new name or the reason.
"""

import importlib
import re
from pathlib import Path

import pytest
import typer

import hybridnav as hn
from hybridnav.cli.app import app

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
NAMES = (HERE / "names.txt").read_text().splitlines()
LEDGER = [line.split("\t") for line in (HERE / "ledger.tsv").read_text().splitlines()]
FATES = {"moved", "merged", "removed"}
FEATURES = [line.split("\t") for line in (HERE / "features.tsv").read_text().splitlines()]
CODE = re.compile(r"`([^`]+)`")
NAME = re.compile(r"--[\w-]+|[A-Za-z_][\w-]{3,}")
GENERAL = {"hybridnav", "python", "benchmarks", "planner", "plan", "build", "rooms", "grid"}
UNHELD = {"make docs", "make site", "make test", "NO_PLACE"}  # promised, and no test asks for it
TOLD = {  # bullets that name no code of a feature, and the feature that each is about
    "Eight notebooks": "Run eight notebooks anywhere",
    "Equal answers": "Get equal answers",
}


def options_of(name, command):
    """Yield `COMMAND OPTION` for a command and those below it."""
    for one in command.params:
        yield f"{name} {max(one.opts, key=len)}"
    context = typer.Context(command)
    for child in getattr(command, "list_commands", lambda _: [])(context):
        yield from options_of(f"{name} {child}", command.get_command(context, child))


def keys_of(values, above=""):
    """Yield `KEY` and `KEY.KEY` of nested mappings."""
    for key, value in values.items():
        yield f"{above}{key}"
        if isinstance(value, dict):
            yield from keys_of(value, f"{above}{key}.")


OPTIONS = set(options_of("hybridnav", typer.main.get_command(app)))
KEYS = {
    f"preset {key}"
    for name in hn.preset_names()
    for key in keys_of(hn.load_preset(name).model_dump())
}
PRESETS = {f"preset-name {name}" for name in hn.preset_names()}


def is_there(name):
    """Tell whether a name of the lists exists: an option, a key, or something to import."""
    if " " in name:
        return name in OPTIONS | KEYS | PRESETS
    module = name
    parts: list[str] = []
    while module:
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError:
            module, _, last = module.rpartition(".")
            parts.insert(0, last)
            continue
        for part in parts:
            # The package answers to names of earlier versions too, with a warning.
            if not (part in dir(found) if found is hn else hasattr(found, part)):
                return False
            found = getattr(found, part)
        return True
    return False


def test_all_lines_have_four_fields_and_a_reason():
    for line in LEDGER:
        assert len(line) == 4, line
        _, fate, now, why = line
        assert fate in FATES
        assert why.strip(), line
        assert bool(now) == (fate != "removed"), line


def test_each_line_is_about_a_name_that_there_was_and_about_one_only_once():
    old = [line[0] for line in LEDGER]
    assert len(set(old)) == len(old)
    assert set(old) <= set(NAMES)


def test_whatever_has_no_line_is_still_there():
    gone = {line[0] for line in LEDGER}
    assert [name for name in NAMES if name not in gone and not is_there(name)] == []


@pytest.mark.parametrize("line", LEDGER, ids=lambda line: line[0])
def test_a_name_of_the_ledger_is_gone_and_what_took_its_place_is_there(line):
    old, _, now, _ = line
    assert not is_there(old)
    assert not now or is_there(now)


def words_of(text):
    """Return the options and names in the code of a text, but those that say nothing."""
    code = " ".join(CODE.findall(text))
    return set(NAME.findall(code)) - GENERAL


def test_each_feature_has_five_fields_a_page_and_a_test():
    assert len({line[0] for line in FEATURES}) == len(FEATURES)
    for line in FEATURES:
        assert len(line) == 5, line
        feature, fate, page, tests, why = line
        assert len(feature.split()) <= 12, line
        assert fate in FATES | {"kept"}
        assert bool(why.strip()) == (fate != "kept"), line
        assert fate != "removed" or (page, tests) == ("CHANGELOG.md", ""), line
        code = set(CODE.findall(feature))
        assert bool(tests) == (fate != "removed" and not code & UNHELD), line
        assert all((ROOT / path).is_file() for path in [page, *tests.split()]), line
        names = words_of(feature)
        assert not names or names & set(NAME.findall((ROOT / page).read_text())), line


def test_features_name_every_page_with_headings():
    pages = [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/howto/*.md")]
    named = {ROOT / line[2] for line in FEATURES}
    assert [page for page in pages if "\n## " in page.read_text() and page not in named] == []


def test_features_cover_what_the_changelog_adds():
    unreleased = (ROOT / "CHANGELOG.md").read_text().partition("\n### Added\n")[2]
    bullets = [" ".join(b.split()) for b in unreleased.partition("\n### ")[0].split("\n- ")[1:]]
    known = set().union(*(words_of(line[0]) for line in FEATURES))
    lost = [b for b in bullets if not words_of(b) & known and not b.startswith(tuple(TOLD))]
    assert not lost, "features.tsv has no line with a name in code of each of these"
    assert [told for told in TOLD if not any(b.startswith(told) for b in bullets)] == []
    lines = [line[0] for line in FEATURES]
    assert [f for f in TOLD.values() if not any(line.startswith(f) for line in lines)] == []
