"""Verbs of the command line that this distribution brings."""
