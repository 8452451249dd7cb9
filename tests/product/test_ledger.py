"""The ledger: what has become of every public name, option and key of presets.

`names.txt` holds what there was before the house was halved; it never changes. `ledger.tsv` has a
line for each of these that is no longer what it was: the old name, its fate, the name now, and why.
What has no line must still be there.
"""

import importlib
from pathlib import Path

import pytest
import typer

import hybridnav as hn
from hybridnav.cli.app import app

HERE = Path(__file__).parent
NAMES = (HERE / "names.txt").read_text().splitlines()
LEDGER = [line.split("\t") for line in (HERE / "ledger.tsv").read_text().splitlines()]
FATES = {"moved", "merged", "removed"}


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
