"""The map on disk: array files, manifest, checkpoints, writer and reader."""
