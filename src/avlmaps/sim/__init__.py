"""A world to record in: it reaches a map only through a recording."""
