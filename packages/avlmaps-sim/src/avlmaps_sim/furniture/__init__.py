"""Furniture and fittings by recipe: `make(category, rng)`; every category has several families of shapes."""

from avlmaps_sim.furniture.catalogue import Families, Piece, Support, categories, families, family, make

__all__ = ["Families", "Piece", "Support", "categories", "families", "family", "make"]
