"""Mixing recorded sounds into the track of a recording, with the truth of what sounds where."""
