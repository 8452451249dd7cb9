"""Buildings whose floors have directed lines: every preset against an oracle; see `directed`."""

import pytest

from tests.ext.fleet.directed import floor_faults
from tests.strategies import examples

# Random lines may lie between blocked cells alone.
pytestmark = pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")


@pytest.mark.parametrize("preset", ["shortest", "octile", "grid-astar", "paper"])
def test_routes_over_floors_with_directed_lines_are_as_good_as_the_oracle_s(preset):
    for seed in range(examples(20 if preset == "shortest" else 40)):
        assert list(floor_faults(seed, preset)) == []
