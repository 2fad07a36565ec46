"""Kettles, toasters and coffee machines."""
