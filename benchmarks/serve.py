"""The server under load: clients that query at a fixed rate, each answer compared with the in-process one.

    python benchmarks/serve.py home.avlmap [--clients 8] [--rate 30] [--minutes 10] [--json]

The server is a process of its own; clients and the comparison run in this one.
"""

import json
import os
import subprocess
import sys
import threading
import time
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from timing import parser, show, use_one_thread

use_one_thread()

import numpy as np  # noqa: E402

from avlmaps.query.avlmap import AVLMap  # noqa: E402

THINGS = ("chair", "table", "sofa", "bed", "lamp", "door", "window", "plant", "sink", "toilet", "shelf", "television")
ROOMS = ("kitchen", "bedroom", "bathroom", "living room", "hallway", "office")
SOUNDS = ("dog", "running water", "doorbell")


def sentences() -> list[str]:
    """Return the queries: things alone, near things, in rooms, near sounds, counted."""
    some = [f"the {thing}" for thing in THINGS]
    some += [f"the {a} near the {b}" for a in THINGS for b in THINGS if a != b]
    some += [f"the {thing} in the {room}" for thing in THINGS for room in ROOMS]
    some += [f"the {thing} near the sound of {sound}" for thing in THINGS for sound in SOUNDS]
    return some + [f"how many {thing}s are there" for thing in ("chair", "table", "lamp", "door")]


class _Client(threading.Thread):
    """One client: it waits for the time of its next query, sends it, and compares the answer."""

    def __init__(self, url: str, plan: list[tuple[float, str]], expected: dict[str, Any]) -> None:
        super().__init__(daemon=True)
        self._address, self._plan, self._expected = urlsplit(url), plan, expected
        self.times_ms: list[float] = []
        self.wrong: list[str] = []

    def run(self) -> None:
        connection = HTTPConnection(self._address.hostname or "", self._address.port, timeout=60)
        for at, sentence in self._plan:
            time.sleep(max(0.0, at - time.perf_counter()))
            begin = time.perf_counter()
            try:
                connection.request("GET", f"/maps/home/ask?sentence={quote(sentence)}")
                response = connection.getresponse()
                body = response.read()
            except OSError as fault:
                self.wrong.append(f"{sentence}: {fault}")
                connection.close()
                continue
            self.times_ms.append(1e3 * (time.perf_counter() - begin))
            answer = json.loads(body)
            if response.status != 200 or essence(answer) != self._expected[sentence]:
                self.wrong.append(f"{sentence}: {response.status}")


def essence(answer: dict[str, Any]) -> Any:
    """Return what must be equal in two answers."""
    return answer.get("goals"), answer.get("found"), answer.get("count"), answer.get("parts")


def memory_bytes(process: int) -> int:
    """Return the memory that a process holds for itself (Linux)."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("RssAnon"))


def processor_s(process: int) -> float:
    """Return the processor time of a process (Linux)."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(url: str, seconds: float, rate: float, clients: int, expected: dict[str, Any], seed: int) -> dict[str, Any]:
    """Query for a while; return times, faults and the rate that was reached."""
    rng = np.random.default_rng(seed)
    known = list(expected)
    count = int(seconds * rate)
    begin = time.perf_counter() + 0.2
    plan = [(begin + k / rate, known[int(rng.integers(len(known)))]) for k in range(count)]
    threads = [_Client(url, plan[k::clients], expected) for k in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    taken = time.perf_counter() - begin
    times = np.concatenate([thread.times_ms for thread in threads])
    wrong = [fault for thread in threads for fault in thread.wrong]
    return {"times_ms": times, "wrong": wrong, "per_s": len(times) / taken}


def main() -> None:
    """Print the table, or one JSON object."""
    arguments = parser(str(__doc__).splitlines()[0])
    arguments.add_argument("map", type=Path)
    arguments.add_argument("--clients", type=int, default=8)
    arguments.add_argument("--rate", type=float, default=30.0)
    arguments.add_argument("--minutes", type=float, default=10.0)
    asked = arguments.parse_args()
    report(asked.map, asked)


def report(path: Path, asked: Any) -> None:
    """Run the server on a map and print what clients met."""
    opened = AVLMap.open(path)
    begin = time.thread_time()
    expected: dict[str, Any] = {}
    for sentence in sentences():
        expected[sentence] = essence(json.loads(json.dumps(opened.ask(sentence).to_dict())))
    alone_ms = 1e3 * (time.thread_time() - begin) / len(expected)
    command = [sys.executable, "-m", "avlmaps", "serve", f"home={path}", "--port", "0", "--json"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        url = json.loads(server.stdout.readline())["url"]
        first = run(url, len(expected) / 10.0, 10.0, asked.clients, expected, 1)
        before, used, load = memory_bytes(server.pid), processor_s(server.pid), os.getloadavg()[0]
        loaded = run(url, 60.0 * asked.minutes, asked.rate, asked.clients, expected, 2)
        after, used = memory_bytes(server.pid), processor_s(server.pid) - used
    finally:
        server.terminate()
        server.wait(60)
    rows = []
    for name, part in (("first queries, 10 a second", first), (f"load, {asked.rate:g} a second", loaded)):
        p50, p95, p99 = np.percentile(part["times_ms"], (50, 95, 99))
        rows.append(
            {
                "part": name,
                "queries": len(part["times_ms"]),
                "per s": part["per_s"],
                "p50 ms": float(p50),
                "p95 ms": float(p95),
                "p99 ms": float(p99),
                "wrong": len(part["wrong"]),
            }
        )
    facts = {
        "voxels": len(opened.space),
        "distinct sentences": len(expected),
        "server processor ms a query": 1e3 * used / max(len(loaded["times_ms"]), 1),
        "in process, thread ms a first query": alone_ms,
        "server memory before, MB": before / 1e6,
        "server memory after, MB": after / 1e6,
        "load average before": load,
        "cores": os.cpu_count() or 1,
        "wrong": "; ".join([*first["wrong"], *loaded["wrong"]][:5]) or "none",
    }
    show(f"avlmaps serve, {asked.clients} clients, {asked.minutes:g} minutes", rows, facts, asked.json)


if __name__ == "__main__":
    main()
