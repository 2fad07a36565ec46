"""Random faults under a drive: each process of a robot with ROS 2 is killed, stopped, restarted or silenced.

    faults.py --cases 200 --seed 1 --workers 2 --out OUT.jsonl

Natively; where AVLMAPS_ROSBRIDGE names a checkout of rosbridge, half of the cases go over that. The robot takes up to
3 s to accept a goal, the goal's connection is late by up to 1 s, and the fault may come before the goal is accepted.
Case N of a seed is the same on every run, up to the timing of the machine. A watchdog runs on the robot. The law, by
the body's own log: within 5 s of the fault the body stands, or the drive goes on watched (its heartbeats reach the
robot), or an operator's goal goes on untouched; and no program says that the robot stands while it moves. After the
fault the program is ended by SIGTERM, and the body must stand 5 s later.
"""
# pyright: reportMissingImports=false

import argparse
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any

CHECKOUT = os.environ.get("AVLMAPS_ROSBRIDGE", "")
WITHIN_S, CLAIM_S = 5.0, 0.3
FAULTS = (
    "nav2 kill", "nav2 restart", "nav2 pause", "client kill", "client pause", "client term", "client int", "guard kill",
    "client and guard kill", "watchdog kill", "body silent", "body late", "none",
)  # fmt: skip
_SIGNALS = {"kill": signal.SIGKILL, "term": signal.SIGTERM, "int": signal.SIGINT, "pause": signal.SIGSTOP}
_ENDS_EVERY_GOAL = ("nav2 kill", "nav2 restart", "nav2 pause")


def chosen(seed: int, number: int) -> dict[str, Any]:
    """Return what a case is."""
    rng = random.Random(f"{seed} {number}")
    return {
        "case": number,
        "fault": FAULTS[number % len(FAULTS)] if number < len(FAULTS) else rng.choice(FAULTS),
        "for_s": round(rng.choice([0.5, 1.0, 2.0, 4.0, 8.0]) * rng.uniform(0.7, 1.3), 2),
        "after_s": round(rng.uniform(0.3, 3.0), 2),
        "operator": rng.random() < 0.3,
        "hz": rng.choice([10.0, 2.0]),
        "accept_s": round(rng.choice([0.0, rng.uniform(0.0, 3.0)]), 2),
        "late_s": round(rng.choice([0.0, rng.uniform(0.0, 1.0)]), 2),
        "early": rng.random() < 0.4,
        "bridged": bool(CHECKOUT) and rng.random() < 0.5,
    }


def run(seed: int, number: int) -> dict[str, Any]:
    """Run one case on a robot of its own, in a network of its own."""
    os.environ["ROS_DOMAIN_ID"] = str(1 + number % 100)  # another one than the cases beside it
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"
    from running import Bridge, LateLink, Robot

    case = chosen(seed, number)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        robot, url = stack.enter_context(Robot(folder, case["hz"])), "native"
        if case["bridged"]:
            bridge = stack.enter_context(Bridge(Path(CHECKOUT)))
            url = stack.enter_context(LateLink(bridge.port, case["late_s"])).url
        if case["accept_s"]:
            robot.mode(f"accept {case['accept_s']}")
        return {**case, **_tried(case, robot, folder, url), "load": round(os.getloadavg()[0], 1)}


def _tried(case: dict[str, Any], robot: Any, folder: Path, url: str) -> dict[str, Any]:
    from running import HERE, Operator, lines_of

    said = folder / "said.jsonl"
    watchdog = subprocess.Popen([sys.executable, "-m", "avlmaps_ros.watchdog"], stderr=subprocess.DEVNULL)
    with said.open("w") as out:
        client = subprocess.Popen(
            [sys.executable, str(HERE / "program.py"), url], stdout=out, stderr=subprocess.DEVNULL
        )
    try:
        early = case["early"] and not case["operator"]
        if not robot.soon(
            lambda: (bool(robot.rows("beat")) if early else robot.moves) and bool(said.read_text()), 90.0
        ):
            return {"verdict": "no start"}
        operators = ""
        if case["operator"]:
            operators = Operator(robot).send(50.0)
        time.sleep(case["after_s"] / (3.0 if early else 1.0))
        guard = lines_of(said.read_text())[0]["guard"]
        faulted_s = time.time()
        _break(case, robot, client, guard, watchdog)
        time.sleep(max(0.0, WITHIN_S + 0.5 - (time.time() - faulted_s)))
        verdict = _judged(robot, faulted_s, operators)
        ended_s = time.time()
        if client.poll() is None:
            client.send_signal(signal.SIGCONT)
            client.terminate()
            with suppress(subprocess.TimeoutExpired):
                client.wait(20.0)
            time.sleep(max(0.0, WITHIN_S - (time.time() - ended_s)))
        if verdict["verdict"] == "goes on watched" and robot.last_moved_s() - ended_s > WITHIN_S:
            verdict = {"verdict": "VIOLATION", "why": "moves on after its program was ended"}
        if operators and case["fault"] not in _ENDS_EVERY_GOAL:
            ends = [row for row in robot.rows("cancelled", "replaced", "aborted") if row["id"] == operators]
            if ends or not robot.moves:
                verdict = {"verdict": "VIOLATION", "why": f"the operator's goal was ended: {ends}"}
        claims = lines_of(said.read_text())
        for claim in claims:
            near = [row for row in robot.rows("body") if abs(row["t"] - claim["t"]) < CLAIM_S]
            if claim.get("stopped") and "stands at" in claim["note"] and near and all(_moves(row) for row in near):
                verdict = {"verdict": "VIOLATION", "why": f"claims to stand while it moves: {claim}"}
        return {**verdict, "said": claims[1:]}
    finally:
        for process in (client, watchdog):
            process.kill()
            process.wait()


def _break(case: dict[str, Any], robot: Any, client: Any, guard: int, watchdog: Any) -> None:
    what, _, how = case["fault"].rpartition(" ")
    if case["fault"] == "client and guard kill":
        os.kill(guard, signal.SIGKILL)
        client.kill()
    elif what == "guard":
        os.kill(guard, signal.SIGKILL)
    elif what == "watchdog":
        watchdog.kill()
    elif what == "client":
        client.send_signal(_SIGNALS[how])
        if how == "pause":
            time.sleep(case["for_s"])
            client.send_signal(signal.SIGCONT)
    elif what == "body":
        robot.mode({"silent": "no tf", "late": "late"}[how])
    elif what == "nav2" and how == "pause":
        robot.processes["nav2"].send_signal(signal.SIGSTOP)
        time.sleep(case["for_s"])
        robot.processes["nav2"].send_signal(signal.SIGCONT)
    elif what == "nav2":
        robot.end("nav2")
        if how == "restart":
            time.sleep(case["for_s"])
            robot.start("nav2")


def _moves(row: dict[str, Any]) -> bool:
    return abs(row["v"]) > 0.01 or abs(row["w"]) > 0.02


def _judged(robot: Any, faulted_s: float, operators: str) -> dict[str, Any]:
    last_s = robot.last_moved_s() - faulted_s
    if not robot.moves and last_s <= WITHIN_S:
        return {"verdict": "stands", "after": round(max(0.0, last_s), 2)}
    if operators:
        return {"verdict": "the operator's goal goes on"}
    beats = [row["t"] for row in robot.rows("beat")]
    if beats and time.time() - beats[-1] < 2.0:
        return {"verdict": "goes on watched"}
    return {"verdict": "VIOLATION", "why": f"moves on unwatched, last motion {last_s:.1f} s after the fault"}


def main() -> None:
    """Run the cases that the words ask for, and count the verdicts."""
    reader = argparse.ArgumentParser()
    reader.add_argument("--cases", type=int, default=200)
    reader.add_argument("--first", type=int, default=0)
    reader.add_argument("--seed", type=int, default=1)
    reader.add_argument("--workers", type=int, default=2)
    reader.add_argument("--out", type=Path, default=Path("ros2_faults.jsonl"))
    given = reader.parse_args()
    counts: dict[str, int] = {}
    context = multiprocessing.get_context("spawn")
    with context.Pool(given.workers, maxtasksperchild=1) as pool, given.out.open("a") as out:
        numbers = range(given.first, given.first + given.cases)
        for row in pool.imap_unordered(partial(run, given.seed), numbers):
            counts[row["verdict"]] = counts.get(row["verdict"], 0) + 1
            out.write(json.dumps(row) + "\n")
            out.flush()
    sys.stdout.write(f"{counts}\n")
    sys.exit(1 if counts.get("VIOLATION") else 0)


if __name__ == "__main__":
    main()
