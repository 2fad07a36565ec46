"""How well photos are located, and at what cost: keypoints and places beside each other, in one run.

python benchmarks/locate.py RECORDING [--elsewhere FOLDER] [--photos 60] [--pairs 25] [--json]
python benchmarks/locate.py --homes house:1000000:held-out ... --methods xfeat

Every other frame of the recording makes the map, frames in between are the photos, and their own poses are the truth:
right is within 25 cm and 10 degrees. Photos are taken as they are, darkened, noisy, blurred and through another focal
length. Pairs are single keyframes as a map and photos turned from them by an angle. In the last rows nothing is there
to be found: other places, and a map that holds the place twice, 100 m apart, where the answer must say so.

Homes are recorded twice: on the day of the map, and on another day and another walk, with things moved. The photos are
of the second walk, by day and by the light of the lamps alone; photos of the next home are of elsewhere.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import timing

timing.use_one_thread()

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.core.columns import concat, take  # noqa: E402
from avlmaps.core.poses import inverse, rotation_angle_rad  # noqa: E402
from avlmaps.maps.types import Keyframes  # noqa: E402
from avlmaps.perception.encoders import Encoders  # noqa: E402
from avlmaps.perception.protocols import LocalFeatures, ModelCard  # noqa: E402
from avlmaps.query.locate import LocatableMap, LocateSettings, locate  # noqa: E402
from avlmaps.recordings.open import open_recording  # noqa: E402
from avlmaps.recordings.types import Recording, Subset  # noqa: E402
from avlmaps_sim.bench.harness.figures import in_percent, wilson  # noqa: E402
from avlmaps_sim.bench.locate import map_of  # noqa: E402
from avlmaps_sim.recorder import RecordSettings, record_scene  # noqa: E402
from avlmaps_sim.scenes import on_day, open_scene  # noqa: E402

NEAR_M, NEAR_RAD = 0.25, np.deg2rad(10.0)
TURNED_DEG = ((10, 25), (25, 45), (45, 70))
SEED = 0
Picture = np.ndarray
_CARD = ModelCard("pooled", 64, "MIT", "0" * 64)


@dataclass(frozen=True, slots=True)
class Pooled:
    """The mean of a picture's descriptors as the descriptor of its place, to compare VLAD with."""

    card: ModelCard = field(default=_CARD)

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Learn nothing."""
        return {}

    def encode(self, rgb: Picture, local: LocalFeatures, state: dict[str, np.ndarray]) -> np.ndarray:
        """Return a unit vector; zero where there are no keypoints."""
        total = local.descriptors.sum(axis=0, dtype=np.float32)
        return total / max(float(np.linalg.norm(total)), 1e-9)


# Keypoints, places and matchers that are compared, by the names of the registry.
METHODS: dict[str, dict[str, object]] = {
    "xfeat": {"local": "xfeat", "place": "xfeat", "matcher": "xfeat"},
    "xfeat, pooled places": {"local": "xfeat", "place": Pooled(), "matcher": "xfeat"},
}


def _gamma(rgb: Picture, gain: float, noise: float, rng: np.random.Generator) -> Picture:
    """Return a picture in less light: linear light is scaled, and the sensor's noise stays as it is."""
    linear = gain * (rgb / 255.0) ** 2.2 + rng.normal(scale=noise, size=rgb.shape)
    return (255.0 * linear.clip(0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)


def _zoomed(rgb: Picture, zoom: float) -> Picture:
    """Return a picture as through a lens of another focal length; what a wider one would see besides is black."""
    height, width = rgb.shape[:2]
    across = np.array([[zoom, 0.0, 0.5 * width * (1.0 - zoom)], [0.0, zoom, 0.5 * height * (1.0 - zoom)]])
    return np.asarray(cv2.warpAffine(rgb, across, (width, height), flags=cv2.INTER_AREA), np.uint8)


CONDITIONS: dict[str, Callable[[Picture, np.random.Generator], Picture]] = {
    "as it is": lambda rgb, _: rgb,
    "dim (a tenth)": lambda rgb, rng: _gamma(rgb, 0.1, 0.002, rng),
    "dim and noisy": lambda rgb, rng: _gamma(rgb, 0.1, 0.01, rng),
    "noisy": lambda rgb, rng: (rgb + rng.normal(scale=20.0, size=rgb.shape)).clip(0, 255).astype(np.uint8),
    "blurred": lambda rgb, _: np.asarray(cv2.blur(rgb, (11, 1)), np.uint8),
    "zoom 0.7": lambda rgb, _: _zoomed(rgb, 0.7),
    "zoom 1.5": lambda rgb, _: _zoomed(rgb, 1.5),
}


@dataclass(frozen=True, slots=True)
class Truth:
    """A photo and where it was taken; None where it is of another place."""

    rgb: Picture
    world_from_camera: np.ndarray | None


def photos_of(recording: Recording, rows: Sequence[int]) -> list[Truth]:
    """Return frames of a recording as photos."""
    colour_from_depth = inverse(recording.rig.rgb_from_depth)
    frames = (recording.frame(int(row)) for row in rows)
    return [Truth(frame.rgb, frame.world_from_camera @ colour_from_depth) for frame in frames]


@dataclass(frozen=True, slots=True)
class Answer:
    """``right``, ``wrong``, ``none`` or ``twice`` for a photo, how far off, and the seconds that it took."""

    said: str
    off_m: float
    took_s: float


def located(stored: LocatableMap, truth: Truth, camera: Pinhole | None = None) -> Answer:
    """Locate a photo."""
    begin_s = time.thread_time()
    found = locate(stored, truth.rgb, camera, np.random.default_rng(SEED), LocateSettings())
    took_s = time.thread_time() - begin_s
    if found.elsewhere is not None:
        return Answer("twice", np.inf, took_s)
    if found.world_from_camera is None:
        return Answer("none", np.inf, took_s)
    if truth.world_from_camera is None:
        return Answer("wrong", np.inf, took_s)
    off_m = float(np.linalg.norm((found.world_from_camera - truth.world_from_camera)[:3, 3]))
    near = off_m <= NEAR_M and rotation_angle_rad(found.world_from_camera, truth.world_from_camera) <= NEAR_RAD
    return Answer("right" if near else "wrong", off_m, took_s)


def row_of(method: str, what: str, answers: Sequence[Answer], wanted: str = "right") -> dict[str, object]:
    """Return one line of the table."""
    said = [answer.said for answer in answers]
    hits = said.count(wanted)
    off_m = [answer.off_m for answer in answers if answer.said == "right"]
    return {
        "keypoints": method, "photos": what, "of": len(said), "as they should": hits,
        "95 %": in_percent(wilson(hits, len(said))), "wrong": said.count("wrong"),
        "median cm": 100.0 * float(np.median(off_m)) if off_m else "",
        "s a photo": float(np.median([answer.took_s for answer in answers])) if answers else 0.0,
    }  # fmt: skip


def doubled(stored: LocatableMap) -> LocatableMap:
    """Return a map that holds its place twice, 100 m apart."""
    own = stored.keyframes
    moved = np.array(own.world_from_camera)
    moved[:, 0, 3] += 100.0
    away = np.array([100.0, 0.0, 0.0], np.float32)
    copy = replace(own, world_from_camera=moved, centre=own.centre + away, points_world=own.points_world + away)
    return replace(stored, keyframes=concat([own, copy]))


def pairs_of(stored: LocatableMap, recording: Recording, between_deg: tuple[int, int], count: int) -> Iterator[Any]:
    """Yield maps of one keyframe, each with a photo that looks at its middle and is turned by so many degrees."""
    poses = np.asarray(recording.world_from_camera)
    keyframes, rng, made = stored.keyframes, np.random.default_rng(SEED), 0
    for row in rng.permutation(len(keyframes)).tolist():
        pose, middle = np.asarray(keyframes.world_from_camera[row]), np.asarray(keyframes.centre[row], np.float64)
        turned = np.rad2deg(rotation_angle_rad(poses, np.broadcast_to(pose, poses.shape)))
        there = (inverse(poses) @ np.append(middle, 1.0))[:, :3]
        rig: Rig = stored.rig
        u = rig.rgb.fx * there[:, 0] / np.maximum(there[:, 2], 1e-6) + rig.rgb.cx
        v = rig.rgb.fy * there[:, 1] / np.maximum(there[:, 2], 1e-6) + rig.rgb.cy
        inside = (there[:, 2] > 0.5) & (abs(u / rig.rgb.width - 0.5) < 0.3) & (abs(v / rig.rgb.height - 0.5) < 0.3)
        fits = np.flatnonzero(inside & (turned >= between_deg[0]) & (turned < between_deg[1]))
        if len(fits) and made < count:
            made += 1
            (truth,) = photos_of(recording, [int(rng.choice(fits))])
            yield replace(stored, keyframes=take(keyframes, np.array([row]))), truth


def measure(method: str, recording: Recording, elsewhere: Sequence[Picture], photos: int, pairs: int) -> list[Any]:
    """Return the lines of one way to locate photos in a recording."""
    rng = np.random.default_rng(SEED)
    stored = mapped(method, Subset(recording, np.arange(0, len(recording), 2)))
    rows = np.arange(1, len(recording), 2)
    truths = photos_of(recording, rows[np.linspace(0, len(rows) - 1, min(photos, len(rows))).astype(int)].tolist())
    lines: list[dict[str, object]] = []
    for name, changed in CONDITIONS.items():
        seen = [replace(truth, rgb=changed(truth.rgb, rng)) for truth in truths]
        lines.append(row_of(method, name, [located(stored, truth) for truth in seen]))
    for between in TURNED_DEG:
        chosen = list(pairs_of(stored, recording, between, pairs))
        for name in ("as it is", "dim and noisy"):
            seen = [(one, replace(truth, rgb=CONDITIONS[name](truth.rgb, rng))) for one, truth in chosen]
            answers = [located(one, truth, recording.rig.rgb) for one, truth in seen]
            lines.append(row_of(method, f"turned by {between[0]}-{between[1]}°, {name}", answers))
    twice = doubled(stored)
    lines.append(row_of(method, "the place is there twice", [located(twice, truth) for truth in truths[::3]], "twice"))
    answers = [located(stored, Truth(rgb, None)) for rgb in elsewhere]
    answers += [located(stored, Truth(np.ascontiguousarray(one.rgb[:, ::-1]), None)) for one in truths]
    return [*lines, row_of(method, "elsewhere and mirrored", answers, "none")]


def mapped(method: str, recording: Recording) -> LocatableMap:
    """Return the keyframes of a map; print what each costs."""
    used = Encoders.named("embedded", **METHODS[method], pixels=None, sounds=None)
    begin_s = time.thread_time()
    stored = map_of(recording, used, np.random.default_rng(SEED))
    keyframes: Keyframes = stored.keyframes
    made_s = (time.thread_time() - begin_s) / len(keyframes)
    held = sum(np.asarray(getattr(keyframes, name)).nbytes for name in ("place", "xy", "descriptors", "points_world"))
    print(f"{method}: {len(keyframes)} keyframes, {made_s:.3f} s and {held / len(keyframes) / 1e3:.0f} kB each")
    return stored


def walked(spec: str, folder: Path, frames: int, *, lamps_alone: bool = False) -> Recording:
    """Record a scene by day, or by its lamps alone."""
    scene = open_scene(spec)
    if lamps_alone:  # the light of windows is bluish, that of lamps is not
        scene = replace(scene, lights=tuple(one for one in scene.lights if one.colour[0] >= one.colour[2]))
    record_scene(scene, folder, RecordSettings(hearing="none", sources=0, max_frames=frames))
    return open_recording(folder)


def measure_homes(method: str, homes: Sequence[tuple[Recording, Recording, Recording]]) -> list[Any]:
    """Return the lines of one way to locate photos of homes; each home is its map, another day, and that by night."""
    rng, answers = np.random.default_rng(SEED), dict[str, list[Answer]]()
    days = [photos_of(day, range(len(day))) for _, day, _ in homes]
    for number, (first, _, night) in enumerate(homes):
        stored = mapped(method, first)
        nightly = photos_of(night, range(len(night)))
        dim = [replace(one, rgb=CONDITIONS["dim and noisy"](one.rgb, rng)) for one in nightly]
        others = [replace(one, world_from_camera=None) for one in days[(number + 1) % len(days)]]
        twice = doubled(stored)
        for name, of, truths in (
            ("another day", stored, days[number]), ("another day, by lamps", stored, nightly),
            ("another day, by lamps, dim and noisy", stored, dim), ("two identical homes", twice, days[number][::3]),
            ("another home", stored, others),
        ):  # fmt: skip
            answers.setdefault(name, []).extend(located(of, truth) for truth in truths)
    wanted = {"two identical homes": "twice", "another home": "none"}
    return [row_of(method, name, some, wanted.get(name, "right")) for name, some in answers.items()]


def main() -> None:
    """Measure each method, print."""
    arguments = timing.parser(__doc__ or "")
    arguments.add_argument("recording", type=Path, nargs="?")
    arguments.add_argument("--elsewhere", type=Path, help="folder of photos of other places")
    arguments.add_argument("--homes", nargs="*", default=[], help="two scenes or more by name, each on two days")
    arguments.add_argument("--photos", type=int, default=60)
    arguments.add_argument("--pairs", type=int, default=25)
    arguments.add_argument("--frames", type=int, default=160, help="of the walk that maps a home")
    arguments.add_argument("--methods", nargs="*", default=list(METHODS), choices=list(METHODS))
    given = arguments.parse_args()
    cv2.setNumThreads(1)
    lines: list[dict[str, object]] = []
    if given.recording:
        recording = open_recording(given.recording)
        paths = sorted(given.elsewhere.glob("*.jpg"))[: given.photos] if given.elsewhere else []
        elsewhere = [np.ascontiguousarray(np.asarray(cv2.imread(str(path)))[..., ::-1]) for path in paths]
        for method in given.methods:
            lines += measure(method, recording, elsewhere, given.photos, given.pairs)
    if given.homes:
        with tempfile.TemporaryDirectory() as folder:
            homes = [
                (
                    walked(spec, Path(folder) / f"{number}-map", given.frames),
                    walked(on_day(spec, 1), Path(folder) / f"{number}-day", given.photos),
                    walked(on_day(spec, 1), Path(folder) / f"{number}-night", given.photos, lamps_alone=True),
                )
                for number, spec in enumerate(given.homes)
            ]
            for method in given.methods:
                lines += measure_homes(method, homes)
    timing.show("Photos located", lines, {}, given.json)


if __name__ == "__main__":
    main()
