"""The command line: verbs in the order of the data; each is a few lines around a function that a notebook can call."""

from avlmaps.cli.main import main

__all__ = ["main"]
