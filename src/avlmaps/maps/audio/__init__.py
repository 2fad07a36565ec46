"""Sounds of a track: noise floor, segmentation, noise reduction, and sound events with features."""
