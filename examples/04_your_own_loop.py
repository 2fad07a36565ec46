"""A map in memory out of your own loop over frames: python examples/04_your_own_loop.py REC live.avlmap."""

import sys

import avlmaps

live = avlmaps.VoxelMap(voxel_size_m=0.1, encoders=avlmaps.Encoders.named("colours"))
for number, frame in enumerate(avlmaps.open_recording(sys.argv[1])):
    live.add(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s)
    if number == 3:
        print("so far:", live.ask("something red").text)
print(live.ask("something red").text)
print(live.save(sys.argv[2], overwrite=True))
