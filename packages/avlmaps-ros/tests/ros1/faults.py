"""Random faults under a drive: each process of a robot with ROS 1 is killed, stopped, restarted, cut off or delayed.

    faults.py --cases 200 --seed 1 --workers 2 --out OUT.jsonl

Case N of a seed is the same on every run, up to the timing of the machine. The robot is set up as docs/robots.md says,
with the watchdog on it. The law, by the body's own log: within 5 s of the fault the body stands, or the drive goes on
watched (its heartbeats reach the robot), or an operator's goal goes on untouched; and no program ever says that the
robot stands while it moves. After the fault the program is ended by SIGTERM, and the body must stand 5 s later.
"""

import argparse
import json
import os
import random
import signal
import tempfile
import traceback
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import Queue
from time import sleep
from typing import Any

from ros1_field import Client, Field, now

WITHIN_S = 5.0
CLAIM_S = 0.3  # a claim is made a little after what it speaks of
FAULTS = (
    "bridge kill", "bridge restart", "bridge pause", "move_base kill", "move_base restart", "move_base pause",
    "client kill", "client pause", "client term", "client int", "guard kill", "client and guard kill", "core kill",
    "watchdog kill", "way cut", "way hole", "way hole for good", "way mute", "way delay", "way rate", "body silent",
    "body shuffled", "bridge and client kill",
)  # fmt: skip


_SIGNALS = {"kill": signal.SIGKILL, "term": signal.SIGTERM, "int": signal.SIGINT, "pause": signal.SIGSTOP}
_ENDS_EVERY_GOAL = (
    "move_base kill",
    "move_base restart",
    "move_base pause",
    "core kill",
    "body silent",
    "body shuffled",
)


def chosen(seed: int, number: int) -> dict[str, Any]:
    """Return what a case is."""
    rng = random.Random(f"{seed} {number}")
    return {
        "case": number,
        "fault": FAULTS[number % len(FAULTS)] if number < len(FAULTS) else rng.choice(FAULTS),
        "for_s": round(rng.choice([0.5, 1.0, 2.0, 4.0, 8.0]) * rng.uniform(0.7, 1.3), 2),
        "after_s": round(rng.uniform(0.3, 3.0), 2),
        "drives": rng.choices(["ours", "operator", "taken over"], [0.7, 0.15, 0.15])[0],
        "delay_s": round(rng.choice([0.2, 1.0, 3.0, 6.0]), 2),
        "rate": rng.choice([3000, 9000, 30000]),
    }


class Bench:
    """One robot, used for one case after the other."""

    def __init__(self, folder: Path, number: int) -> None:
        self.folder, self.number = folder, number
        self.field = Field(folder, map_hz=[10.0, 2.0][number % 2], speed=[0.5, 0.3][number // 2 % 2], watchdog=True)
        self.field.__enter__()

    def close(self) -> None:
        self.field.__exit__()

    def mend(self, last: str) -> None:
        """Bring everything up again, and let the body stand."""
        field = self.field
        field.way("open")
        if last.startswith("way"):  # a rosbridge whose client was too slow keeps others waiting as well
            field.kill("bridge")
        for name in ("bridge", "move_base", "watchdog"):
            with suppress(ProcessLookupError):
                field.kill(name, signal.SIGCONT)
            if field.processes[name].poll() is not None:
                field.start(name)
        field.mode("body", "telling")
        field.until_standing(20.0)

    def run(self, case: dict[str, Any]) -> dict[str, Any]:
        field = self.field
        beats_before = len(field.rows(field.server_log))
        ours = case["drives"] != "operator"
        client = field.client("drive" if ours else "wait")
        if client.said("open", 60.0) is None:
            return {**case, "verdict": "no start", "why": client.out.with_suffix(".err").read_text()[-300:]}
        body = field.rows()[-1]
        if not ours:
            field.operate(body["x"] + 40.0, body["y"])
        try:
            field.until_moving(20.0)
        except TimeoutError:
            said = client.rows()
            client.process.kill()
            return {**case, "verdict": "no start", "why": said}
        if case["drives"] == "taken over":
            field.operate(body["x"] + 20.0, body["y"] + 20.0)
        sleep(case["after_s"])
        faulted = self.break_it(case, client)
        sleep(max(0.0, WITHIN_S + 1.0 - (now() - faulted)))
        operated = case["drives"] != "ours"
        verdict = self.judged(case, faulted, beats_before)
        ended = now()
        if client.process.poll() is None:
            client.process.send_signal(signal.SIGCONT)
            client.process.terminate()
            client.said("exit", 20.0)
            sleep(max(0.0, WITHIN_S - (now() - ended)))
        last = field.stood_after(ended)
        if verdict["verdict"] == "goes on watched" and (last is None or last > WITHIN_S):
            verdict = {"verdict": "VIOLATION", "why": f"moves {last} s after its program was ended"}
        if operated and not self.operators_goal_lives() and case["fault"] not in _ENDS_EVERY_GOAL:
            verdict = {"verdict": "VIOLATION", "why": "the operator's goal was ended"}
        lies = self.lies(client)
        if lies:
            verdict = {"verdict": "VIOLATION", "why": f"claims to stand while it moves: {lies}"}
        said = [row for row in client.rows() if row["kind"] in ("arrival", "halt", "exit")]
        self.clear(operated, case["fault"])
        return {**case, **verdict, "said": said, "load": round(_load(), 1)}

    def break_it(self, case: dict[str, Any], client: Client) -> float:
        """Do what the case says, and undo it after its time where it has one; return when it was done."""
        done, field = now(), self.field
        what, _, how = case["fault"].rpartition(" ")
        if what == "body":  # the tool that says so takes seconds to start
            field.mode("body", how)
            return next(row["t"] for row in reversed(field.rows()) if row["kind"] == "mode")
        if what.startswith("way"):
            self.block_way(case)
        elif "client" in what or "guard" in what:
            self.end_program(case, client)
        else:
            field.kill(what, signal.SIGSTOP if how == "pause" else signal.SIGKILL)
            if how != "kill":
                sleep(case["for_s"])
            if how == "pause":
                field.kill(what, signal.SIGCONT)
            elif how == "restart":
                field.start(what)
        return done

    def block_way(self, case: dict[str, Any]) -> None:
        """Cut, swallow, delay or slow down what goes between the program and the bridge."""
        how = case["fault"].split()[1]
        self.field.way(how + {"delay": f" {case['delay_s']}", "rate": f" {case['rate']}"}.get(how, ""))
        if case["fault"] in ("way hole", "way mute"):
            sleep(case["for_s"])
            self.field.way("open")

    def end_program(self, case: dict[str, Any], client: Client) -> None:
        """Kill, pause or end the program, its guard, or both."""
        what, _, how = case["fault"].rpartition(" ")
        guard = next((row["guard"] for row in client.rows() if row["kind"] == "open"), None)
        if "bridge" in what:
            self.field.kill("bridge")
        if "guard" in what:
            _signal(guard, _SIGNALS[how])
        if "client" in what:
            _signal(client.process.pid, _SIGNALS[how])
        if how == "pause":
            sleep(case["for_s"])
            _signal(client.process.pid, signal.SIGCONT)
        if "bridge" in what:
            sleep(min(case["for_s"], 2.0))
            self.field.start("bridge")

    def judged(self, case: dict[str, Any], faulted: float, beats_before: int) -> dict[str, Any]:
        field = self.field
        stood = field.stood_after(faulted)
        if stood is not None and stood <= WITHIN_S:
            return {"verdict": "stands", "after": round(stood, 2)}
        if case["drives"] != "ours":
            return {"verdict": "the operator's goal goes on"}
        beats = [row["t"] for row in field.rows(field.server_log)[beats_before:] if row["kind"] == "beat"]
        if beats and now() - beats[-1] < 2.0:
            return {"verdict": "goes on watched"}
        return {"verdict": "VIOLATION", "why": f"moves on unwatched, last motion {stood} s after the fault"}

    def operators_goal_lives(self) -> bool:
        """Return whether the operator's goal is the last that began, has not ended, and moves the body."""
        rows = self.field.rows(self.field.server_log)
        last = [row for row in rows if row["kind"] in ("goal", "preempted", "succeeded")][-1:]
        return [(row["kind"], row["id"]) for row in last] == [("goal", "rviz")] and self.field.moves()

    def lies(self, client: Client) -> list[dict[str, Any]]:
        """Return the claims of standing that the body's log denies."""
        rows = [row for row in self.field.rows() if row["kind"] == "body"]
        found = []
        for claim in client.rows():
            stands = claim.get("stopped") and "stands at" in claim.get("note", "")
            stands = stands or (claim["kind"] == "stop" and claim.get("reached"))
            near = [row for row in rows if abs(row["t"] - claim["t"]) < CLAIM_S]
            if stands and near and all(self.field.moves(row) for row in near):
                found.append(claim)
        return found

    def clear(self, operated: bool, fault: str) -> None:
        """End what is left of a case."""
        for process in self.field.clients:
            if process.poll() is None:
                process.kill()
        if self.field.processes["core"].poll() is not None:
            return  # nothing can be started without it; the next case gets a new bench
        self.mend(fault)
        if operated or self.field.moves():
            self.field.operate_stop()
            self.field.until_standing(10.0)


def _signal(number: int | None, what: signal.Signals) -> None:
    if number is not None:
        with suppress(ProcessLookupError):
            os.kill(number, what)


def _load() -> float:
    return os.getloadavg()[0]


def main() -> None:
    parser = argparse.ArgumentParser(description="Random faults under a drive.")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of the cases; all of them by default")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("ros1_faults.jsonl"))
    given = parser.parse_args()
    cases: Queue[int] = Queue()
    for number in given.only or range(given.cases):
        cases.put(number)

    def work(number: int) -> None:
        bench = None
        while not cases.empty():
            case = chosen(given.seed, cases.get())
            try:
                if bench is None:
                    bench = Bench(Path(tempfile.mkdtemp(prefix=f"ros1-{number}-")), number)
                row = bench.run(case)
            except Exception:  # noqa: BLE001 - a fault of the bench, which is reported as such
                row = {**case, "verdict": "bench", "why": traceback.format_exc()[-600:]}
            with given.out.open("a") as out:
                out.write(json.dumps(row) + "\n")
            if row["verdict"] in ("bench", "no start") or case["fault"] == "core kill":
                if bench is not None:
                    with suppress(Exception):
                        bench.close()
                bench = None
        if bench is not None:
            bench.close()

    with ThreadPoolExecutor(given.workers) as pool:
        list(pool.map(work, range(given.workers)))


if __name__ == "__main__":
    main()
