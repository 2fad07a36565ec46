"""Recordings: frames with poses and an audio track, in our format and in others'."""
