"""Backends of the ``paper`` profile: the published system's models on torch, written here where no library has them."""
