"""Sounds made by rule, for the kinds of which no freely licensed recording is at hand."""

from training.sounds.synthesis import animals, home, outdoors, people
from training.sounds.synthesis.blocks import MAKERS

__all__ = ["MAKERS", "animals", "home", "outdoors", "people"]
