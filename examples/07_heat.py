"""Heat as an array, weighed and read anywhere: python examples/07_heat.py home.avlmap."""

import sys

import numpy as np

import avlmaps

m = avlmaps.open_map(sys.argv[1])
heat = 0.7 * m.object("sofa") + 0.3 * m.sound("alarm clock")
print(heat, "highest", round(heat.max(), 2), "at", m.points[heat.argmax()])
print("warm voxels:", np.count_nonzero(heat > 0.5), "of", np.asarray(heat).shape)
print("one metre beside the hottest:", heat.at(m.points[heat.argmax()] + (1.0, 0.0, 0.0)))
