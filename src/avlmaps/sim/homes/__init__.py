"""Homes and offices by rule, from a seed."""
