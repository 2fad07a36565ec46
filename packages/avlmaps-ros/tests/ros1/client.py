"""A program of a user's, in a process of its own: it drives far, or waits for orders; each claim is a line of JSON.

client.py URL drive      drives 60 m ahead, guarded; a signal stops it
client.py URL wait       waits for lines on standard input: stop, pose, go X Y
"""

import json
import signal
import sys
from contextlib import suppress
from pathlib import Path
from time import time
from typing import Any

import numpy as np

from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.interrupts import Interrupted, raised_signals
from avlmaps_ros import RosSettings, open_ros_driver


def say(kind: str, **more: Any) -> None:
    sys.stdout.write(json.dumps({"t": round(time(), 3), "kind": kind, **more}) + "\n")
    sys.stdout.flush()


def told(arrival: Arrival) -> dict[str, Any]:
    return {
        "reached": arrival.reached,
        "note": arrival.note,
        "x": round(arrival.pose.x_m, 3),
        "y": round(arrival.pose.y_m, 3),
    }


def main(url: str, what: str) -> int:
    settings = RosSettings.read(Path(sys.argv[3])) if len(sys.argv) > 3 else RosSettings()
    driver = open_ros_driver("move_base", url, settings=settings, guarded=True)
    say("open", guard=None if driver.guard is None else driver.guard._process.pid)
    try:
        with raised_signals():
            if what == "drive":
                ahead = driver.pose.ahead(40.0)
                say("arrival", **told(driver.go_to(np.array([ahead.x_m, ahead.y_m, 0.0]))))
                halt = driver.halt()
                say("halt", stopped=halt.stopped, note=halt.note)
                return 0 if halt.stopped else 3
            for line in sys.stdin:
                match line.split():
                    case ["stop"]:
                        say("stop", **told(driver.stop()))
                    case ["pose"]:
                        pose = driver.pose
                        seen = driver._contact.sighting()
                        known = seen is not None and seen.age_s <= settings.pose_max_age_s
                        say("pose", x=round(pose.x_m, 3), y=round(pose.y_m, 3), known=known)
                    case ["go", x, y]:
                        say("arrival", **told(driver.go_to(np.array([float(x), float(y), 0.0]))))
    except Interrupted as stop:
        halt = driver.halt()
        say("halt", stopped=halt.stopped, note=halt.note, signal=stop.name)
        return 0 if halt.stopped else 3
    finally:
        with suppress(Exception):
            driver.close()
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background has it ignored
    status = main(sys.argv[1], sys.argv[2])
    say("exit", status=status)
    sys.exit(status)
