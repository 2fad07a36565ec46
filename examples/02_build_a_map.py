"""Build a map of a recording and list what is in it: python examples/02_build_a_map.py REC home.avlmap."""

import sys

import avlmaps

m = avlmaps.build_map(sys.argv[1], sys.argv[2], "colours", progress=False)
print(m)
for thing in m.things()[:10]:
    print(f"{thing.name:12} {thing.confidence:.2f} at {thing.position}")
