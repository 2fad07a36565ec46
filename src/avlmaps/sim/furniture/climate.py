"""Radiators, air conditioners, fireplaces and water heaters."""
