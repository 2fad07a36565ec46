"""Caches of features by content: encoders that do not encode the same input twice."""
