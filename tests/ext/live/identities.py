"""What versions of a changing map state about themselves, and machines that change the map."""

import numpy as np
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test


def check_identities(update, numbers, cells, shift):
    """What an update states about places or regions is what the cells show.

    `numbers` are the sets of all before and after, `cells` the number of each cell before and
    after; the map has grown by `shift` rows and columns at its lower left.
    """
    (had, has), (before, after) = numbers, cells
    rows, cols = before.shape
    seen = after[shift[0] : shift[0] + rows, shift[1] : shift[1] + cols]
    assert set(update.died) == had - has
    assert set(update.born) == has - had
    same = {one for one in had & has if np.array_equal(before == one, seen == one)}
    same -= {one for one in same if (after == one).sum() != (seen == one).sum()}
    assert (had & has) - same <= set(update.changed) <= had & has
    for one in had:
        inside = before == one
        found, counts = np.unique(seen[inside], return_counts=True)
        heirs = found[2 * counts > inside.sum()].tolist()
        if one in has:
            assert heirs == [one]
        elif one in update.merged:
            assert heirs == [update.merged[one]]
        else:
            assert heirs in ([], [-1])
        assert update.split.get(one, ()) == parts_of(found, counts, after)


def parts_of(found, counts, after):
    """Return the numbers of more than one part that lies for the most part in what there was."""
    parts = [
        part
        for part, count in zip(found.tolist(), counts.tolist(), strict=True)
        if part >= 0 and 2 * count > (after == part).sum()
    ]
    return tuple(parts) if len(parts) > 1 else ()


def run_machine(machine, count, steps, **more):
    """Run so many examples of so many steps."""
    asked = settings(max_examples=count, stateful_step_count=steps, deadline=None, **more)
    run_state_machine_as_test(machine, settings=asked)
