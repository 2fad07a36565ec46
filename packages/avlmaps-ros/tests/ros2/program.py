"""A program that drives a robot far away and says in lines of JSON how it ends."""

import json
import sys
import time

import numpy as np

from avlmaps.navigate.interrupts import Interrupted, raised_signals
from avlmaps_ros import open_ros_driver


def say(kind: str, **values: object) -> None:
    sys.stdout.write(json.dumps({"t": time.time(), "kind": kind, **values}) + "\n")
    sys.stdout.flush()


def main(url: str, guarded: bool) -> None:
    with raised_signals(), open_ros_driver("nav2", url, guarded=guarded) as driver:
        say("open", guard=None if driver.guard is None else driver.guard._process.pid)
        try:
            arrival = driver.go_to(np.array([60.0, 0.0, 0.0]))
            say("arrival", reached=arrival.reached, note=arrival.note)
            halt = driver.halt()
        except Interrupted:
            halt = driver.halt()
        say("halt", stopped=halt.stopped, note=halt.note)


if __name__ == "__main__":
    addresses = [word for word in sys.argv if word.startswith("ws://")]
    main([*addresses, "native"][0], "--unguarded" not in sys.argv)
