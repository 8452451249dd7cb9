"""The last values are kept, no more."""

from hybridnav._base.threads import keep_last


def test_the_last_values_are_kept():
    kept = {"a": 1, "b": 2}
    assert keep_last(kept, "c", 3, 2) == 3
    assert list(kept.items()) == [("b", 2), ("c", 3)]
