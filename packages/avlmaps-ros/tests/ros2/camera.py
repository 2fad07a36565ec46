"""A camera of 640x480 that looks along a wall and drives beside it: raw pictures at 15 Hz, transforms at 45."""
# pyright: reportMissingImports=false

import argparse
import array
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from publisher import LATCHED, filled
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).parents[4] / "tests"))
from avlmaps.core.camera import Pinhole
from helpers import ros_messages as ros

HZ, STEP_M = 15.0, 0.01


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int)
    parser.add_argument("--best-effort", action="store_true", help="as sensors; else by ROS 2's default")
    asked = parser.parse_args()
    rclpy.init(args=[])
    node, camera = Node("camera_driver"), Pinhole(500.0, 500.0, 320.0, 240.0, 640, 480)
    qos = qos_profile_sensor_data if asked.best_effort else QoSProfile(depth=10)
    colours, depths = (node.create_publisher(Image, f"/camera/{of}/image_raw", qos) for of in ("color", "depth"))
    infos = [node.create_publisher(CameraInfo, f"/camera/{of}/camera_info", LATCHED) for of in ("color", "depth")]
    moving = node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
    mounts = node.create_publisher(TFMessage, "/tf_static", LATCHED)
    for info in infos:
        info.publish(filled(CameraInfo(), ros.camera_info(camera)))
    mounts.publish(filled(TFMessage(), ros.mount()))
    rgb = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    pictures = [(rgb, "rgb8", 3 * 640, colours), (np.full((480, 640), 2000, np.uint16), "16UC1", 2 * 640, depths)]
    contents = [array.array("B", pixels.tobytes()) for pixels, *_ in pictures]
    while not (colours.get_subscription_count() and depths.get_subscription_count()):
        rclpy.spin_once(node, timeout_sec=0.1)
    time.sleep(2.0)  # the rest is discovered
    begin_s, pose = time.time(), np.eye(4)
    for number in range(3 * asked.count):
        stamp_s = begin_s + number / (3.0 * HZ)
        time.sleep(max(0.0, stamp_s - time.time()))
        pose[0, 3] = number * STEP_M / 3.0
        moving.publish(filled(TFMessage(), ros.moved(pose, stamp_s)))
        if number % 3:
            continue
        for (_, encoding, step, publisher), content in zip(pictures, contents, strict=True):
            message = Image(height=480, width=640, encoding=encoding, step=step)
            filled(message.header, ros.header(stamp_s, "camera"))
            message.data = content
            publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0.0)
    time.sleep(3.0)


if __name__ == "__main__":
    main()
