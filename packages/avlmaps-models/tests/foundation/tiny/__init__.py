"""Tiny random checkpoints in the published layouts, one module for each backend."""
