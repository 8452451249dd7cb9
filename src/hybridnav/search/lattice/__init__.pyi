from .bound import cost_bound as cost_bound
from .build import (
    Lattice as Lattice,
    build_lattice as build_lattice,
)
from .search import (
    LatticeLine as LatticeLine,
    LatticeSearch as LatticeSearch,
)

__all__: list[str]
