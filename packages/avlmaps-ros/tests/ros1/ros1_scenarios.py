"""What may befall a drive, each as it befalls a real robot: what the body did is read from its own log.

scenarios.py [NAME ...]     prints one line of JSON for each; AVLMAPS_SRC names other sources to drive by
"""

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

from ros1_field import Client, Field, now

Outcome = dict[str, Any]
START_S = 240.0  # of the command line, on a machine whose load is ten times what it can bear


def stands_while_it_drives(folder: Path) -> Outcome:
    """move_base ignores every cancel, the map's transform comes twice a second: a stop must not say that it stands."""
    with Field(folder, map_hz=2.0) as field:
        field.mode("move_base", "deaf")
        field.operate(60.0, 0.0)
        field.until_moving()
        client = field.client("wait")
        assert client.said("open", 40.0)
        said = []
        for count in (1, 2):
            client.tell("stop")
            stop = client.said("stop", 40.0, count)
            said.append(stop is not None and stop["reached"])
        return {"moves": field.moves(), "said to stand": said}


def bridge_restarts(folder: Path) -> Outcome:
    """The bridge dies in the middle of a drive and comes back 6 s later."""
    with Field(folder) as field:
        client = field.client("drive")
        field.until_moving()
        sleep(1.0)
        field.kill("bridge")
        killed = now()
        sleep(6.0)
        field.start("bridge")
        back = now()
        stood = field.until_standing(17.0)
        arrival = client.said("arrival", 40.0)
        return {
            "stands": stood,
            "moved on s after it was back": field.stood_after(back),
            "s of the drive without a bridge": round(back - killed, 1),
            "note": arrival and arrival["note"],
            "status": (client.said("exit", 20.0) or {}).get("status"),
        }


def bridge_is_gone(folder: Path) -> Outcome:
    """The bridge dies and does not come back for long; the program is ended; only then the bridge is back."""
    with Field(folder, speed=0.3) as field:
        client = field.client("drive", {"goal_timeout_s": 120.0})
        field.until_moving()
        sleep(1.0)
        field.kill("bridge")
        sleep(3.0)
        client.process.terminate()
        exited = client.said("exit", 40.0)
        field.start("bridge")
        back = now()
        stood = field.until_standing(17.0)
        return {
            "stands": stood,
            "moved on s after it was back": field.stood_after(back),
            "status": (exited or {}).get("status"),
        }


def stop_after_a_restart(folder: Path) -> Outcome:
    """A client is connected, the bridge restarts, an operator drives: the client's stop must stop the robot."""
    with Field(folder) as field:
        client = field.client("wait")
        assert client.said("open", 40.0)
        field.kill("bridge")
        field.start("bridge")
        field.operate(60.0, 0.0)
        field.until_moving()
        sleep(2.0)
        told = now()
        client.tell("stop")
        stop = client.said("stop", 40.0)
        return {
            "said": stop and stop["reached"],
            "note": stop and stop["note"],
            "stands": field.until_standing(2.0),
            "moved on s": field.stood_after(told),
        }


def slow_bridge(folder: Path) -> Outcome:
    """The network before the bridge becomes so slow that transforms queue up."""
    with Field(folder) as field:
        client = field.client("wait")
        assert client.said("open", 40.0)
        client.tell("go 60 0")
        other = field.client("wait")
        assert other.said("open", 40.0)
        field.until_moving()
        sleep(2.0)
        field.way("rate 9000")
        slowed, worst = now(), 0.0
        for count in range(1, 13):
            other.tell("pose")
            pose = other.said("pose", 10.0, count)
            truth = [row for row in field.rows() if row["kind"] == "body"][-1]
            if pose is not None and pose["known"]:
                worst = max(worst, abs(truth["x"] - pose["x"]))
            sleep(1.0)
        arrival = client.said("arrival", 5.0)
        return {
            "ended": arrival is not None,
            "note": arrival and arrival["note"],
            "stands": field.until_standing(1.0),
            "moved on s": field.stood_after(slowed),
            "worst m between the believed and the true place": round(worst, 2),
        }


def server_dies(folder: Path, restarts: bool = False) -> Outcome:
    """move_base dies; the body stops by itself, and its transforms go on."""
    with Field(folder) as field:
        client = field.client("drive")
        field.until_moving()
        sleep(1.0)
        field.kill("move_base")
        if restarts:
            field.start("move_base")
        killed = now()
        arrival = client.said("arrival", 30.0)
        return {"noticed after s": arrival and round(arrival["t"] - killed, 1), "note": arrival and arrival["note"]}


def server_restarts(folder: Path) -> Outcome:
    """move_base dies and another takes its place, which knows nothing of the goal."""
    return server_dies(folder, restarts=True)


def operator_takes_over(folder: Path) -> Outcome:
    """An operator sends a goal from RViz in the middle of a drive; the program ends; the operator's goal goes on."""
    with Field(folder) as field:
        client = field.client("drive")
        field.until_moving()
        sleep(1.0)
        field.operate(0.0, 20.0)
        arrival = client.said("arrival", 20.0)
        exited = client.said("exit", 20.0)
        sleep(3.0)
        return {
            "operator's goal": _operators_goal(field),
            "note": arrival and arrival["note"],
            "status": (exited or {}).get("status"),
        }


def operator_takes_over_and_ours_dies(folder: Path) -> Outcome:
    """As before, and the program is killed at once: its guard must leave the operator's goal alone."""
    with Field(folder) as field:
        client = field.client("drive")
        field.until_moving()
        sleep(1.0)
        client.process.kill()
        field.operate(0.0, 20.0)
        sleep(6.0)
        return {"operator's goal": _operators_goal(field)}


def _operators_goal(field: Field) -> str:
    rows = field.rows(field.server_log)
    ended = [row for row in rows if row["kind"] in ("preempted", "succeeded") and row["id"] == "rviz"]
    return "goes on" if not ended and field.moves() else "was ended"


def operator_takes_over_a_command(folder: Path) -> Outcome:
    """An operator takes over from `avlmaps go`, whose program fails by that; the operator's goal goes on."""
    with Field(folder) as field:
        command = field.command("move forward 50 metres, then turn left")
        field.until_moving(START_S)
        sleep(1.0)
        field.operate(0.0, 20.0)
        return _ended_command(field, command)


def operator_takes_over_a_command_and_a_signal_comes(folder: Path) -> Outcome:
    """As before, and SIGTERM comes as soon as the operator's goal has begun."""
    with Field(folder) as field:
        command = field.command("move forward 50 metres, then turn left")
        field.until_moving(START_S)
        sleep(1.0)
        operating = Thread(target=field.operate, args=(0.0, 20.0))
        operating.start()
        field.until(
            lambda: any(row.get("id") == "rviz" for row in field.rows(field.server_log)), "goal of the operator"
        )
        command.process.terminate()
        operating.join()
        return _ended_command(field, command)


def _ended_command(field: Field, command: Client) -> Outcome:
    status = command.process.wait(START_S)
    sleep(4.0)  # what was still to be cancelled would be by now
    return {
        "operator's goal": _operators_goal(field),
        "status": status,
        "answer": command.out.read_text(),
        "errors": command.out.with_suffix(".err").read_text()[-400:],
    }


def program_killed(folder: Path) -> Outcome:
    """``kill -9`` of the program; the guard cancels."""
    with Field(folder) as field:
        client = field.client("drive")
        field.until_moving()
        sleep(1.0)
        client.process.kill()
        killed = now()
        return {"stands": field.until_standing(10.0), "moved on s": field.stood_after(killed)}


SCENARIOS: dict[str, Callable[[Path], Outcome]] = {
    scenario.__name__: scenario
    for scenario in (
        stands_while_it_drives, bridge_restarts, bridge_is_gone, stop_after_a_restart, slow_bridge, server_dies,
        server_restarts, operator_takes_over, operator_takes_over_and_ours_dies, operator_takes_over_a_command,
        operator_takes_over_a_command_and_a_signal_comes, program_killed,
    )
}  # fmt: skip

if __name__ == "__main__":
    for name in sys.argv[1:] or SCENARIOS:
        with tempfile.TemporaryDirectory(prefix=f"{name}-") as folder:
            try:
                outcome = SCENARIOS[name](Path(folder))
            except (AssertionError, TimeoutError) as fault:
                outcome = {"fault": str(fault)[:200], "client": (Path(folder) / "client0.err").read_text()[-400:]}
        sys.stdout.write(json.dumps({"scenario": name, **outcome}) + "\n")
        sys.stdout.flush()
