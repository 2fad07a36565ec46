"""Pictures for surfaces, made by rule: a module per family of stuff, each maker a function of a random generator."""

from avlmaps_sim.textures.texture import Texture

__all__ = ["Texture"]
