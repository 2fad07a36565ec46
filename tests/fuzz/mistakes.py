"""Cases that are well-formed and wrong: the mistakes of ``avlmaps bench recordings``, built into maps.

The law: the build is refused with one sentence, or its map carries a doubt or a notice that the right map has not, or
the map is right: nine of ten voxels lie within 10 cm of the true surface, nine of ten cameras within 25 cm of their
true places, and the colours are those of the right pictures. A map that is wrong without a word is a finding.
"""

import json
import re
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from campaign import build, in_child, verdict_of

from avlmaps.core import poses
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.map_data import MapData
from avlmaps.recordings.open import open_recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import FOLDER, FORMATS, TUM_CAMERA, Format, Judge
from avlmaps_sim.bench.recordings.situations import situations

# Of twelve seconds: on a walk of half a metre the noise of a Kinect hides half the scale of the positions.
_PACE = {"frames": 30, "rate_hz": 2.5, "turn_rad_s": 0.5}
WALKS = (
    RoomWalk("room", seed=71, **_PACE),
    RoomWalk("room, noise of a Kinect", seed=72, noise=0.0019, **_PACE),
    RoomWalk("room, somebody walks by", seed=73, people=1, **_PACE),
)
OTHER = RoomWalk("room, other", seed=74, **_PACE)
_CAMERA = TUM_CAMERA.resized(80, 60)
_FORMS = (FOLDER, *FORMATS)
_TWO = 0.2  # share of cases with two mistakes


@cache
def _draft(walk: RoomWalk) -> Draft:
    return walk.draft(_CAMERA)


@dataclass(frozen=True)
class Right:
    """A right recording in a format, and what is usually said of its map."""

    judge: Judge
    said: frozenset[str]


@cache
def right(walk: RoomWalk, form: Format) -> Right:
    """Build the map of a right recording; nothing may be doubted of it, and it must be right itself."""
    with tempfile.TemporaryDirectory() as folder:
        case = form.write(_draft(walk), Path(folder) / "walk")
        out = Path(folder) / "out.avlmap"
        judge = Judge(_draft(walk), form)
        assert in_child(lambda: build(case, out, ()))[0] == 0
        stored = read(out)
        assert not stored.info.doubts and is_right(stored, case, judge), f"{walk.name} as {form.name}"
        return Right(judge, frozenset(map(_plain, stored.info.notices)))


def _plain(notice: str) -> str:
    """Return a notice without numbers and paths."""
    return re.sub(r"\S*/\S*|[\d.,]+", "#", notice)


def is_right(stored: MapData, case: Path, judge: Judge) -> bool:
    """Return whether a map is right, up to a motion of the world; its recording is compared for the colours."""
    opened = open_recording(case)
    if not judge.is_right(opened):
        return False
    key = stored.keyframes
    middle = len(key.stamp_s) // 2
    frame = int(np.argmin(np.abs(opened.stamps_s - key.stamp_s[middle])))
    to_true = judge.poses[opened.name(frame)] @ poses.inverse(key.world_from_camera[middle])
    return judge.is_surface(poses.apply(to_true, stored.grid.centre_of(np.asarray(stored.voxels.index))))


def run_mistake(number: int, scratch: Path) -> dict[str, object]:
    """Run one case; return its line for the report, with the verdict map, told, sentence or finding."""
    rng = np.random.default_rng([2026, 33, number])
    walk, form = WALKS[int(rng.integers(len(WALKS)))], _FORMS[number % len(_FORMS)]
    known = situations()
    chosen = [known[int(i)] for i in rng.integers(len(known), size=1 + int(rng.random() < _TWO))]
    draft = _draft(walk)
    for situation in chosen:
        draft = situation.change(draft, _draft(OTHER), rng)
    if not form.holds(draft):
        form = FOLDER
    known_right = right(walk, form)
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        case, out = form.write(draft, Path(folder) / "walk"), Path(folder) / "out.avlmap"
        begin = time.perf_counter()
        status, text = in_child(lambda: build(case, out, ()) or look(out, case, known_right))
        seconds = round(time.perf_counter() - begin, 3)
        told = status == 0 and _told(out, known_right)
    done = f"{walk.name}: {' and '.join(situation.name for situation in chosen)}"
    verdict = "told" if told else verdict_of(status, text)
    return {"case": f"wrong {number}", "seed": f"wrong {form.name}", "done": done, "verdict": verdict, "status": status,
            "s": seconds, "text": text.replace(folder, "CASE")}  # fmt: skip


def _told(out: Path, known: Right) -> bool:
    info = json.loads((out / "map.json").read_bytes())
    return bool(info.get("doubts")) or not known.said.issuperset(map(_plain, info["notices"]))


def look(out: Path, case: Path, known: Right) -> int:
    """Raise where a map is wrong and nothing was said."""
    if not _told(out, known) and not is_right(read(out), case, known.judge):
        raise AssertionError("The map is wrong, and nothing is said of it.")
    return 0
