"""Backends of the ``paper`` profile: the published system's models on torch, written anew where no library has them."""
