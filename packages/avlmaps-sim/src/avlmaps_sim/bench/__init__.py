"""Measuring quality: the tables behind `avlmaps bench`."""
