from .bound import cost_bound as cost_bound, slopes_of as slopes_of
from .lattice import Lattice as Lattice, build_lattice as build_lattice
from .lattice import LatticeLine as LatticeLine, LatticeSearch as LatticeSearch

__all__: list[str]
