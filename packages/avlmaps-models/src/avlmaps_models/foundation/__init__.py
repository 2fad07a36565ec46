"""Backends of the ``foundation`` profile: today's open models, on torch. Nothing imports them but the registry."""
