"""Replay a recording on topics, as the drivers of a robot publish.

It begins when somebody subscribes to its pictures. /odom to base_link moves, the camera is mounted by /tf_static.
"""
# pyright: reportMissingImports=false

import argparse
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import rclpy
from audio_common_msgs.msg import AudioDataStamped, AudioInfo
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Int32
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).parents[4] / "tests"))
from avlmaps.recordings.open import open_recording
from helpers import ros_messages as ros

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def filled(message: Any, plain: Any) -> Any:
    """Fill a message of rclpy with a plain object of the same fields."""
    for name, value in vars(plain).items():
        field = getattr(message, name)
        if isinstance(value, SimpleNamespace):
            filled(field, value)
        elif name == "transforms":
            from geometry_msgs.msg import TransformStamped

            message.transforms = [filled(TransformStamped(), one) for one in value]
        elif isinstance(value, np.ndarray):
            setattr(message, name, value.tobytes() if value.dtype == np.uint8 else value)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, (int, float)) else value)
    return message


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("recording", type=Path)
    parser.add_argument("--packed", action="store_true", help="compressed pictures and depth")
    parser.add_argument("--lost", action="store_true", help="no transforms")
    parser.add_argument("--encoding", default="rgb8")
    parser.add_argument("--coded-at", type=int, default=-1, help="frame before which the sound's coding is published")
    parser.add_argument("--array", action="store_true", help="sound of two channels")
    parser.add_argument("--stall", default="-1,0", help="frame, seconds")
    asked = parser.parse_args()
    stall_at, stall_s = (float(word) for word in asked.stall.split(","))
    recording = open_recording(asked.recording)
    rclpy.init(args=[])
    node = Node("camera_driver")
    kind = CompressedImage if asked.packed else Image
    ends = ("/compressed", "/compressedDepth") if asked.packed else ("", "")
    rgb = node.create_publisher(kind, f"/camera/color/image_raw{ends[0]}", qos_profile_sensor_data)
    depth = node.create_publisher(kind, f"/camera/depth/image_raw{ends[1]}", qos_profile_sensor_data)
    infos = [node.create_publisher(CameraInfo, f"/camera/{of}/camera_info", LATCHED) for of in ("color", "depth")]
    moving = node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
    mounts = node.create_publisher(TFMessage, "/tf_static", LATCHED)
    sound = node.create_publisher(AudioDataStamped, "/audio", 10)
    for info, camera in zip(infos, (recording.rig.rgb, recording.rig.depth), strict=True):
        info.publish(filled(CameraInfo(), ros.camera_info(camera)))
    if not asked.lost:
        mounts.publish(filled(TFMessage(), ros.mount()))
    track = recording.audio
    assert track is not None
    channels = 2 if asked.array else 1
    said = node.create_publisher(Int32, "/sound_direction", 10)
    coding = AudioInfo(channels=channels, sample_rate=track.rate_hz, sample_format="S16LE", coding_format="wave")
    if asked.coded_at < 0:
        node.create_publisher(AudioInfo, "/audio_info", LATCHED).publish(coding)
    while not (rgb.get_subscription_count() and depth.get_subscription_count()):
        rclpy.spin_once(node, timeout_sec=0.1)
    time.sleep(1.5)  # the rest is discovered
    begin_s, heard_s = time.time(), 0.0
    for number, frame in enumerate(recording):
        if number == asked.coded_at:
            node.create_publisher(AudioInfo, "/audio_info", LATCHED).publish(coding)
        if number == stall_at:
            time.sleep(stall_s)
            begin_s += stall_s
        stamp_s = begin_s + frame.stamp_s
        time.sleep(max(0.0, stamp_s - time.time()))
        if not asked.lost:
            moving.publish(filled(TFMessage(), ros.moved(frame.world_from_camera, stamp_s)))
        made = ros.compressed_colour(frame, stamp_s) if asked.packed else ros.colour(frame, stamp_s, asked.encoding)
        rgb.publish(filled(kind(), made))
        made = ros.compressed_depth(frame, stamp_s) if asked.packed else ros.depth(frame, stamp_s)
        depth.publish(filled(kind(), made))
        if frame.stamp_s > heard_s and stall_s == 0.0:
            heard = track.read(heard_s, frame.stamp_s).samples
            each = [np.roll(heard, 3 * channel) for channel in range(channels)]  # it comes from the left
            samples = (32767.0 * np.column_stack(each)).astype("<i2")
            said.publish(Int32(data=60))
            plain = SimpleNamespace(
                header=ros.header(begin_s + heard_s, "microphone"),
                audio=SimpleNamespace(data=np.frombuffer(samples.tobytes(), np.uint8)),
            )
            sound.publish(filled(AudioDataStamped(), plain))
            heard_s = frame.stamp_s
        rclpy.spin_once(node, timeout_sec=0.0)
    time.sleep(1.0)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
