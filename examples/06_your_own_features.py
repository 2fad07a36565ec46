"""Features that you computed elsewhere, one array a frame: python examples/06_your_own_features.py REC."""

import sys

import numpy as np

import avlmaps

live = avlmaps.VoxelMap(voxel_size_m=0.1, encoders=avlmaps.Encoders())
for frame in avlmaps.open_recording(sys.argv[1]):
    grid = frame.rgb[::8, ::8].astype(np.float32) + 1.0  # (rows, columns, d): here d is 3
    grid /= np.linalg.norm(grid, axis=2, keepdims=True)
    live.add(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s, features=grid)
wanted = np.array([1.0, 0.0, 0.0])
likeness = live.features.astype(np.float32) @ wanted
print(f"{len(live.points)} voxels; most like it: {live.points[likeness.argmax()]}")
