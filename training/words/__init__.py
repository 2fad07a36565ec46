"""How the embedded text encoder was made: see README.md, and ``python -m training.words --help``."""
