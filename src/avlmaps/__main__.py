"""`python -m avlmaps` is the same as `avlmaps`."""

from avlmaps.cli import main

main()
