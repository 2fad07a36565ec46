"""The command line: verbs in the order of the data; each is a few lines around a function that a notebook can call."""

import sys

try:
    from avlmaps.cli.main import main
except KeyboardInterrupt:  # Ctrl-C while it was loading
    sys.stderr.write("avlmaps: stopped\n")
    sys.exit(130)

__all__ = ["main"]
