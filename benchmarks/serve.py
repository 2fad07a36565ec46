"""The server under load: clients that query at a fixed rate, each answer compared with the in-process one.

python benchmarks/serve.py [--voxels 300000] [--clients 8] [--rate 30] [--minutes 10] [--map MAP] [--json]

Without --map, the map is made up: the surfaces of a storey, boxes with the features of the embedded encoder's names,
600 views of rooms and ten sounds. The server is a process of its own; clients and the comparison run in this one.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from functools import cached_property
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from timing import parser, show, use_one_thread

use_one_thread()

import msgspec  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.maps.build import build_map  # noqa: E402
from avlmaps.maps.settings import BuildSettings  # noqa: E402
from avlmaps.maps.store.manifest import MapBounds  # noqa: E402
from avlmaps.maps.store.writer import MapContent, write_map  # noqa: E402
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels  # noqa: E402
from avlmaps.perception.embedded.codes import features_of  # noqa: E402
from avlmaps.perception.encoders import Encoders  # noqa: E402
from avlmaps.query.avlmap import AVLMap  # noqa: E402
from avlmaps.recordings.audio import Sound, write_flac  # noqa: E402
from avlmaps.recordings.types import Frame, Recording  # noqa: E402
from queries import VOXEL_SIZE_M, building  # noqa: E402

THINGS = ("chair", "table", "sofa", "bed", "lamp", "door", "window", "plant", "sink", "toilet", "shelf", "television")
ROOMS = ("kitchen", "bedroom", "bathroom", "living room", "hallway", "office")
SOUNDS = ("dog", "running water", "doorbell")


class _Corner(Recording):
    """A wall in random colours, seen a few times: what a map is made of before its voxels are exchanged."""

    def __init__(self) -> None:
        camera = Pinhole(100.0, 100.0, 80.0, 60.0, 160, 120)
        self.path, self.format, self.rig = Path("made-up"), "made up", Rig(camera, camera)
        self.stamps_s = np.arange(8) * 0.5
        self.world_from_camera = np.tile(np.eye(4), (8, 1, 1))
        self.world_from_camera[:, :3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        self.world_from_camera[:, 0, 3] = 0.3 * np.arange(8)
        self.up_in_world, self.audio, self.notices = np.array([0.0, 0.0, 1.0]), None, ()

    @cached_property
    def fingerprint(self) -> str:
        return "made up"

    def frame(self, index: int) -> Frame:
        rng = np.random.default_rng(index)
        rgb = np.kron(rng.integers(0, 256, (12, 16, 3)), np.ones((10, 10, 1))).astype(np.uint8)
        depth = np.full((120, 160), 2.0, np.float32)
        return Frame(
            index, self.name(index), float(self.stamps_s[index]), rgb, depth, self.world_from_camera[index], self.rig
        )


def made_up_map(path: Path, voxels: int, rng: np.random.Generator) -> Path:
    """Write a map of that many voxels."""
    stored = build_map(_Corner(), path, "embedded", BuildSettings(voxel_size_m=VOXEL_SIZE_M), progress=False)
    index = building(voxels, rng)
    encoder: Any = Encoders.named("embedded").pixels
    names = list(encoder.names)
    # Blocks of 1.2 m hold one thing each, the lowest layer is floor.
    block = (index[:, 0] // 24 * 7919 + index[:, 1] // 24 * 104729) % len(THINGS)
    kinds = np.array([names.index(name) if name in names else 0 for name in THINGS])
    label = np.where(index[:, 2] == 0, names.index("floor"), kinds[block])
    feature = np.empty((len(index), encoder.codes.shape[1]), np.float16)
    for a in range(0, len(index), 20_000):
        some = rng.gamma(0.05, 1.0, (len(label[a : a + 20_000]), len(names))).astype(np.float32)
        some[np.arange(len(some)), label[a : a + 20_000]] += rng.uniform(1.0, 6.0, len(some))
        feature[a : a + 20_000] = features_of(some / some.sum(axis=1, keepdims=True), encoder.codes)
    n, side_m = len(index), float(index[:, 0].max()) * VOXEL_SIZE_M
    rgb = rng.integers(0, 256, (n, 3)).astype(np.uint8)
    some_voxels = Voxels(
        index, feature, np.ones(n, np.float32), rgb, rng.uniform(0, 300, n), np.full(n, 9, np.int64)
    )  # fmt: skip
    keyframes = _views(600, side_m, stored.keyframes, rng)
    sounds = _sounds(10, side_m, rng)
    counts = msgspec.structs.replace(stored.info.counts, voxels=n, keyframes=len(keyframes), sounds=len(sounds))
    lived = msgspec.structs.replace(stored.info.recording, duration_s=300.0)
    box = MapBounds.of(index, VOXEL_SIZE_M)
    info = msgspec.structs.replace(stored.info, counts=counts, recording=lived, bounding_box_m=box)
    clips = path.parent / "clips"
    clips.mkdir()
    for name in sounds.clips:
        write_flac(clips / name, Sound(np.zeros(800, np.float32), 16000))
    write_map(path, MapContent(some_voxels, keyframes, dict(stored.place_state), sounds, clips), info)
    return path


def _views(count: int, side_m: float, like: Keyframes, rng: np.random.Generator) -> Keyframes:
    """Return views along a walk; each part of the storey is a room."""
    encoder: Any = Encoders.named("embedded").views
    rooms = np.asarray(encoder.encode_words(list(ROOMS)), np.float32)
    walk = np.abs((np.cumsum(rng.normal(0, 0.4, (count, 2)), axis=0) + side_m / 2) % (2 * side_m) - side_m)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    poses[:, :2, 3], poses[:, 2, 3] = walk, 1.3
    view = rooms[(walk // 4.0).astype(int).sum(axis=1) % len(ROOMS)]
    noisy = view + rng.normal(0, 0.02, view.shape).astype(np.float32)
    place = np.asarray(like.place)[rng.integers(0, len(like), count)]
    return Keyframes(
        np.arange(count) * 0.5, poses, poses[:, :3, 3].astype(np.float32) + np.float32(0.5),
        (noisy / np.linalg.norm(noisy, axis=1, keepdims=True)).astype(np.float32), place,
        np.zeros(count + 1, np.int64), np.zeros((0, 2), np.float32), np.asarray(like.descriptors)[:0],
        np.zeros((0, 3), np.float32), np.zeros(count + 1, np.int64), np.zeros(0, np.uint8),
    )  # fmt: skip


def _sounds(count: int, side_m: float, rng: np.random.Generator) -> HeardSounds:
    encoder: Any = Encoders.named("embedded").sounds
    features = [
        np.asarray(encoder.encode(Sound(rng.normal(0, 0.1, 32000).astype(np.float32), 16000)), np.float32)
        for _ in range(count)
    ]
    offsets = np.concatenate([[0], np.cumsum([len(one) for one in features])]).astype(np.int64)
    track = rng.uniform(0, side_m, (5 * count, 3)).astype(np.float32)
    onset = np.arange(count) * 10.0
    clips = tuple(f"{k:04d}.flac" for k in range(count))
    return HeardSounds(
        onset, onset + 2.0, 5 * np.arange(count + 1, dtype=np.int64), track, offsets, np.concatenate(features), clips
    )


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
    arguments.add_argument("--voxels", type=int, default=300_000)
    arguments.add_argument("--clients", type=int, default=8)
    arguments.add_argument("--rate", type=float, default=30.0)
    arguments.add_argument("--minutes", type=float, default=10.0)
    arguments.add_argument("--map", type=Path, default=None)
    asked = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = asked.map or made_up_map(Path(folder) / "home.avlmap", asked.voxels, np.random.default_rng(0))
        report(path, asked)


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
