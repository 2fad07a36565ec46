"""Locate a photo: python examples/09_where_was_this_photo_taken.py home.avlmap photo.png."""

import sys

import avlmaps

m = avlmaps.open_map(sys.argv[1])
located = m.locate(sys.argv[2])
print(located)
if located.world_from_camera is not None:
    print("x, y, z:", located.world_from_camera[:3, 3])
for note in located.notes:
    print("note:", note)
