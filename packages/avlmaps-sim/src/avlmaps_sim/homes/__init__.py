"""Homes and offices by rule: `make_home(seed)` is a furnished home, another one for every seed."""

from avlmaps_sim.homes.dwelling import make_home, make_office
from avlmaps_sim.homes.lived_in import lived_in

__all__ = ["lived_in", "make_home", "make_office"]
