"""Mirrors and towels."""
