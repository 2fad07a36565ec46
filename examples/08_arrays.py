"""The map as arrays, read-only and not copied from the disk: python examples/08_arrays.py home.avlmap."""

import sys

import avlmaps

m = avlmaps.open_map(sys.argv[1])
for name in ("points", "colors", "features", "voxel_index"):
    array = getattr(m, name)
    print(f"m.{name:12} {array.dtype} {array.shape}")
low, high = m.points.min(axis=0), m.points.max(axis=0)
print("from", low, "to", high, "metres")
