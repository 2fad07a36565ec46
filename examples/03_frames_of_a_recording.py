"""Go through the frames of a recording: python examples/03_frames_of_a_recording.py REC."""

import sys

import numpy as np

import avlmaps

recording = avlmaps.open_recording(sys.argv[1])
print(recording)
for frame in recording:
    x, y, z = frame.world_from_camera[:3, 3]
    depth_m = np.median(frame.depth_m[frame.valid])
    print(f"{frame.stamp_s:6.2f} s at ({x:.2f}, {y:.2f}, {z:.2f}) m, {frame.rgb.shape}, median depth {depth_m:.2f} m")
