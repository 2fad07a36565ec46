"""The benchmark of change: homes over several days, what a map says changed, and what truly did."""
