"""Homes and offices by rule: `make_home(seed)` is a furnished home, another one for every seed."""

from avlmaps.sim.homes.dwelling import make_home, make_office

__all__ = ["make_home", "make_office"]
