"""A map that grows while a robot drives: python examples/11_map_while_you_drive.py REC new.avlmap."""

import sys

import avlmaps

recording = avlmaps.open_recording(sys.argv[1])
with avlmaps.LiveMap(sys.argv[2], avlmaps.Encoders.named("colours"), overwrite=True) as live:
    for number, frame in enumerate(recording):
        live.add_frame(
            frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s, wait=True
        )  # a robot would not wait: the frame that is late is dropped
        if live.generation and number % 50 == 0:
            print("meanwhile:", live.ask("something red").text)
    print(*live.doubts, sep="\n")
print(live.map.ask("something red").text)
print(live.status())
