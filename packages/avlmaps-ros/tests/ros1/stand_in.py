#!/usr/bin/python3
"""A robot with ROS 1 for the tests: a body, or a move_base that drives it. Run by the interpreter that has ROS.

The body integrates ``cmd_vel``, stands when none comes for half a second, reports its place on /tf, and writes what it
really did into a log. The move_base is a real actionlib server that drives straight to its goal.
"""

# pyright: reportMissingImports=false
import argparse
import json
import math
import random
import threading
import time
from pathlib import Path

import actionlib
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
from std_msgs.msg import String

TICK_S, COMMAND_S, SLOWER_M_S2 = 0.02, 0.5, 1.0


class Log:
    def __init__(self, path):
        self.file = Path(path).open("a", buffering=1)  # noqa: SIM115 - as long as the process

    def say(self, kind, **more):
        self.file.write(json.dumps({"t": round(time.time(), 3), "kind": kind, **more}) + "\n")


def transform(parent, child, x, y, yaw):
    told = TransformStamped()
    told.header.stamp = rospy.Time.now()
    told.header.frame_id, told.child_frame_id = parent, child
    told.transform.translation.x, told.transform.translation.y = x, y
    told.transform.rotation.z, told.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return told


class Body:
    def __init__(self, log, map_hz):
        self.log, self.map_hz = log, map_hz
        self.x = self.y = self.yaw = self.speed = self.turn = 0.0
        self.command, self.commanded_s = (0.0, 0.0), 0.0
        self.telling, self.shuffled, self.held = True, False, []
        rospy.Subscriber("cmd_vel", Twist, self.take, queue_size=1)
        rospy.Subscriber("body/mode", String, self.mode)

    def take(self, command):
        self.command, self.commanded_s = (command.linear.x, command.angular.z), time.monotonic()

    def mode(self, word):
        self.telling, self.shuffled = word.data != "silent", word.data == "shuffled"
        self.log.say("mode", mode=word.data)

    def run(self):
        tell = tf2_ros.TransformBroadcaster()
        before_s, ticks = time.monotonic(), 0
        while not rospy.is_shutdown():
            time.sleep(TICK_S)
            now_s = time.monotonic()
            dt, before_s, ticks = now_s - before_s, now_s, ticks + 1
            wanted = self.command if now_s - self.commanded_s < COMMAND_S else (0.0, 0.0)
            most = SLOWER_M_S2 * dt
            self.speed += max(-most, min(most, wanted[0] - self.speed))
            self.turn = wanted[1]
            self.x += self.speed * math.cos(self.yaw) * dt
            self.y += self.speed * math.sin(self.yaw) * dt
            self.yaw += self.turn * dt
            if self.telling:
                self.held.append(transform("odom", "base_link", self.x, self.y, self.yaw))
                if len(self.held) >= (20 if self.shuffled else 1):
                    if self.shuffled:
                        random.shuffle(self.held)
                    for told in self.held:
                        tell.sendTransform(told)
                    self.held.clear()
                if ticks % max(1, round(1.0 / self.map_hz / TICK_S)) == 0:
                    tell.sendTransform(transform("map", "odom", 0.0, 0.0, 0.0))
            if ticks % 3 == 0:
                self.log.say("body", x=round(self.x, 3), y=round(self.y, 3), v=round(self.speed, 3), w=self.turn)


class MoveBase:
    def __init__(self, log, speed):
        self.log, self.speed, self.deaf = log, speed, False
        self.places = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.places)
        self.out = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("move_base/mode", String, self.mode)
        rospy.Subscriber("avlmaps/heartbeat", String, lambda beat: log.say("beat", id=beat.data))
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self.drive, auto_start=False)
        self.server.start()

    def mode(self, word):
        self.deaf = word.data == "deaf"
        self.log.say("mode", mode=word.data)

    def drive(self, goal):
        name = self.server.current_goal.get_goal_id().id
        x, y = goal.target_pose.pose.position.x, goal.target_pose.pose.position.y
        self.log.say("goal", id=name, x=x, y=y)
        rate = rospy.Rate(20)
        while not rospy.is_shutdown():
            if self.server.is_preempt_requested() and not self.deaf:
                self.out.publish(Twist())
                self.server.set_preempted()
                self.log.say("preempted", id=name)
                return
            try:
                at = self.places.lookup_transform("map", "base_link", rospy.Time(0)).transform
            except (tf2_ros.LookupException, tf2_ros.ConnectivityException, tf2_ros.ExtrapolationException):
                rate.sleep()
                continue
            away = math.hypot(x - at.translation.x, y - at.translation.y)
            yaw = 2.0 * math.atan2(at.rotation.z, at.rotation.w)
            error = math.atan2(y - at.translation.y, x - at.translation.x) - yaw
            error = math.atan2(math.sin(error), math.cos(error))
            if away < 0.1:
                self.out.publish(Twist())
                self.server.set_succeeded(MoveBaseResult(), "Goal reached.")
                self.log.say("succeeded", id=name)
                return
            command = Twist()
            command.angular.z = max(-1.0, min(1.0, 2.0 * error))
            command.linear.x = self.speed if abs(error) < 0.5 else 0.0
            self.out.publish(command)
            self.server.publish_feedback(MoveBaseFeedback())
            rate.sleep()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("role", choices=["body", "move_base"])
    parser.add_argument("--log", required=True)
    parser.add_argument("--map-hz", type=float, default=10.0)
    parser.add_argument("--speed", type=float, default=0.5)
    given = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node(given.role if given.role == "move_base" else "body")
    log = Log(given.log)
    if given.role == "body":
        body = Body(log, given.map_hz)
        threading.Thread(target=body.run, daemon=True).start()
    else:
        MoveBase(log, given.speed)
    log.say("up", role=given.role)
    rospy.spin()


if __name__ == "__main__":
    main()
