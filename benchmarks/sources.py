"""What it costs to find out where a sound came from, against the plain way.

    python benchmarks/sources.py

A building of nine rooms is driven past a sound of 5 s with four microphones. "plain": every frame of the sound is
steered at every voxel. Ours takes cells of surface, the frames with most onset, and steers at doorways where walls lie
between. Processor time of one thread; ``ratio`` compares within a run.
"""

from timing import parser, seconds, show, use_one_thread

use_one_thread()

from pathlib import Path  # noqa: E402
from tempfile import TemporaryDirectory  # noqa: E402

import numpy as np  # noqa: E402

from avlmaps.core.progress import silence_progress  # noqa: E402
from avlmaps.core.timeline import Trajectory  # noqa: E402
from avlmaps.maps.sources.correlation import SPEED_M_S, correlate  # noqa: E402
from avlmaps.maps.sources.find import find_sources  # noqa: E402
from avlmaps.maps.types import SourceEvidence  # noqa: E402
from avlmaps.recordings.audio import AudioTrack  # noqa: E402
from avlmaps.recordings.channels import ChannelSound, read_channels, with_microphones, write_channels  # noqa: E402
from avlmaps.recordings.microphones import Microphones, microphones_named  # noqa: E402

RATE_HZ, BEGIN_S, SECONDS = 16_000, 1.5, 5.0
SIDE_M, HIGH_M, STEP_M, ROOMS = (6.0, 5.0), 2.4, 0.05, 3
SOURCE_M = np.array([7.5, 9.0, 0.6])


def building() -> np.ndarray:
    """Return the middles of the voxels of nine rooms with doorways and ceilings."""
    size = (SIDE_M[0] * ROOMS, SIDE_M[1] * ROOMS)
    x, y = (np.arange(0.0, side, STEP_M) + STEP_M / 2 for side in size)
    up = np.arange(STEP_M, HIGH_M, STEP_M) + STEP_M / 2
    floor = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    parts = [floor, floor + np.array([0.0, 0.0, HIGH_M])]
    for number in range(ROOMS + 1):
        for along, axis in ((y, 0), (x, 1)):
            free = along[np.abs(along % SIDE_M[1 - axis] - 2.5) > 0.45]
            wall = np.stack(np.meshgrid(free, up, indexing="ij"), axis=-1).reshape(-1, 2)
            at = np.full(len(wall), number * SIDE_M[axis])
            parts.append(np.column_stack([at, wall] if axis == 0 else [wall[:, 0], at, wall[:, 1]]))
    return np.concatenate(parts)


def drive() -> Trajectory:
    """Return a drive of a metre through the room in the middle."""
    stamps_s = np.arange(0.0, BEGIN_S + SECONDS + 1.0, 0.1)
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    poses[:, :3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    poses[:, :3, 3] = np.column_stack(
        [np.linspace(8.5, 9.5, len(stamps_s)), np.full(len(stamps_s), 7.0), np.full(len(stamps_s), 1.3)]
    )
    return Trajectory(stamps_s, poses)


def recorded(walk: Trajectory, array: Microphones, folder: Path) -> AudioTrack:
    """Return the track of the array in bursts of noise without reflections, written into a folder."""
    rng, hop = np.random.default_rng(0), RATE_HZ // 10
    count = round(walk.stamps_s[-1] * RATE_HZ)
    noise = rng.standard_normal(count) * (np.arange(count) % 4000 < 2500)
    noise[: round(BEGIN_S * RATE_HZ)], noise[round((BEGIN_S + SECONDS) * RATE_HZ) :] = 0.0, 0.0
    heard = 1e-4 * rng.standard_normal((len(array), count))
    for first in range(0, count, hop):
        at = np.arange(first, min(first + hop, count))
        ear_m = array.in_world_m(walk.at(np.array([min(first / RATE_HZ, walk.stamps_s[-1])])))[0]
        for channel, away_m in enumerate(np.linalg.norm(ear_m - SOURCE_M, axis=1)):
            heard[channel, at] += 0.1 / away_m * np.interp(at - away_m / SPEED_M_S * RATE_HZ, np.arange(count), noise)
    path = folder / "track.flac"
    write_channels(path, ChannelSound(heard.astype(np.float32), RATE_HZ))
    return with_microphones(AudioTrack.open(path), array)


def plain(track: AudioTrack, walk: Trajectory, voxel_m: np.ndarray) -> np.ndarray:
    """Return the steered power of every frame at every voxel."""
    array = track.microphones
    assert array is not None
    sound = read_channels(track, BEGIN_S - 1.0, BEGIN_S + SECONDS)
    found = correlate(sound.samples, RATE_HZ, BEGIN_S - 1.0, 1.0, 0.3)
    delays_s = found.first_s + found.step_s * np.arange(found.curve.shape[2])
    total = np.zeros(len(voxel_m))
    for ear_m, curves in zip(array.in_world_m(walk.at(found.at_s)), found.curve, strict=True):
        late_s = np.linalg.norm(voxel_m[:, None] - ear_m, axis=2) / SPEED_M_S
        for curve, (one, other) in zip(curves, found.pair, strict=True):
            total += np.interp(late_s[:, one] - late_s[:, other], delays_s, curve)
    return total


def _place(found: SourceEvidence) -> np.ndarray:
    total = found.heard[0].astype(np.float64) + found.expected[0] + np.log(found.prior)
    return found.place[int(np.argmax(total))]


def main() -> None:
    """Measure and print."""
    asked = parser(str(__doc__).splitlines()[0]).parse_args()
    voxel_m, walk, array = building(), drive(), microphones_named("square4")
    with TemporaryDirectory() as folder, silence_progress(True):
        track = recorded(walk, array, Path(folder))
        spans, up = [(BEGIN_S, BEGIN_S + SECONDS)], np.array([0.0, 0.0, 1.0])
        find_sources(track, walk, spans, voxel_m, up)
        ours_s, found = min((seconds(find_sources, track, walk, spans, voxel_m, up) for _ in range(3)), key=_first)
        more_s, _ = min((seconds(find_sources, track, walk, spans * 3, voxel_m, up) for _ in range(2)), key=_first)
        plain_s, power = seconds(plain, track, walk, voxel_m)
    assert found is not None
    off = [float(np.linalg.norm(at[:2] - SOURCE_M[:2])) for at in (_place(found), voxel_m[int(np.argmax(power))])]
    rows: list[dict[str, object]] = [
        {"way": "ours", "s of the first sound": ours_s, "s of each more": (more_s - ours_s) / 2, "error m": off[0]},
        {"way": "plain", "s of the first sound": plain_s, "s of each more": plain_s, "error m": off[1]},
    ]
    facts: dict[str, object] = {
        "voxels": len(voxel_m), "candidates": len(found.place), "seconds of sound": SECONDS, "ratio": plain_s / ours_s
    }  # fmt: skip
    show("Where a sound came from", rows, facts, asked.json)


def _first(pair: tuple[float, object]) -> float:
    return pair[0]


if __name__ == "__main__":
    main()
