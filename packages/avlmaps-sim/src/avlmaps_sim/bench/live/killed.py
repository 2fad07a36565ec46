"""Live maps whose process is killed: what is left is a whole map, and how much of the drive it lacks.

Run as a program, it plays a recording at its own pace and prints after each frame how many are in the map.
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from avlmaps.live.live_map import LiveMap
from avlmaps.maps.store.folder import read
from avlmaps.recordings.open import open_recording

_WAITS_S = 60.0
_LOOK_S = 0.2


def lost_s(recording: Path, path: Path, profile: str, rng: np.random.Generator, within_s: float = 10.0) -> float:
    """Play a recording in another process, kill it at most ``within_s`` after its first save, and open what is left.

    Returns:
        How many seconds before the kill the first frame came into the map that what is left lacks.

    Raises:
        MapError: what is left is no whole map.
    """
    words = [sys.executable, "-m", __name__, str(recording), str(path), profile]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    lines: list[str] = []
    try:
        for line in process.stdout:
            lines.append(line)
            if line.rstrip().endswith("saved"):
                break
        time.sleep(float(rng.uniform(0.0, within_s)))
    finally:
        process.kill()
    killed_s = time.monotonic()
    lines += process.stdout.readlines()
    process.stdout.close()
    process.wait()
    left = read(path)
    counted = [line.split() for line in lines if line.endswith("\n")]
    later = [float(words[0]) for words in counted if int(words[1]) > left.info.counts.frames]
    return max(0.0, killed_s - later[0]) if later else 0.0


def main() -> None:
    """Play until the end, or until somebody kills us."""
    recording, path, profile = open_recording(Path(sys.argv[1])), Path(sys.argv[2]), sys.argv[3]
    with LiveMap(path, profile, up_in_world=recording.up_in_world, overwrite=True) as live:
        begin_s = time.monotonic()
        for index in range(len(recording)):
            since_s = float(recording.stamps_s[index] - recording.stamps_s[0])
            time.sleep(max(0.0, begin_s + since_s - time.monotonic()))
            frame = recording.frame(index)
            live.add_frame(frame.rgb, frame.depth_m, frame.rig, frame.world_from_camera, frame.stamp_s)
            _tell(live)
        until_s = time.monotonic() + _WAITS_S  # the drive may be shorter than the time until the kill
        while time.monotonic() < until_s:
            time.sleep(_LOOK_S)
            _tell(live)


def _tell(live: LiveMap) -> None:
    saved = "saved" if live.status().saved_age_s >= 0.0 else "-"
    sys.stdout.write(f"{time.monotonic()} {len(live)} {saved}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
