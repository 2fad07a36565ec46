"""Frames, cameras, errors, files and the registry of backends: what every other room stands on."""
