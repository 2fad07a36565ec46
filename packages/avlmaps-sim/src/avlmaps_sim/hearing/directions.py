"""What an array with a chip says of where sounds come from: an azimuth ten times a second while something sounds.

The azimuth is that of the source, or of the last corner that it goes round where a wall lies between, plus the device's
offset and an error; a share of the azimuths are anything. Devices say whole degrees.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.microphones import DirectionTrack
from avlmaps_sim.hearing.impulse import Acoustics
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Scene

RATE_HZ = 10.0
ERROR_DEG = 8.0


def said_directions(
    scene: Scene,
    sounds: Sequence[tuple[float, float, Triple]],
    stamps_s: Float[np.ndarray, " n"],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    rng: np.random.Generator,
    offset_rad: float = 0.0,
    outliers: float = 0.1,
) -> DirectionTrack:
    """Return the azimuths that a device on the robot says.

    ``sounds`` have onset, offset and place. All azimuths are too great by ``offset_rad``; a share ``outliers`` is
    anything.
    """
    building, walk = Acoustics(scene, 16_000), Trajectory(stamps_s, world_from_camera)
    at_s: list[float] = []
    azimuth: list[float] = []
    for onset_s, offset_s, place in sorted(sounds):
        source = building.sounds_from(np.asarray(place))
        times = np.arange(np.ceil(onset_s * RATE_HZ), offset_s * RATE_HZ) / RATE_HZ
        times = times[(times >= stamps_s[0]) & (times <= stamps_s[-1])]
        times = times[times > (at_s[-1] if at_s else -np.inf)]  # of sounds at once it says the first
        for time_s, pose in zip(times.tolist(), walk.at(times), strict=True):
            ear = pose[:3, 3]
            air, _ = building.floor_at(float(ear[2]))
            corner = air.ways(source, ear[None])[0].corner
            away = (source[:2] if corner is None else np.asarray(corner)) - ear[:2]
            at_s.append(time_s)
            azimuth.append(float(np.arctan2(away[1], away[0]) - np.arctan2(pose[1, 2], pose[0, 2])))
    true = np.array(azimuth)
    said = true + offset_rad + np.deg2rad(ERROR_DEG) * rng.standard_normal(len(true))
    said = np.where(rng.random(len(true)) < outliers, rng.uniform(-np.pi, np.pi, len(true)), said)
    whole = np.deg2rad(np.rint(np.rad2deg(np.angle(np.exp(1j * said)))))
    return DirectionTrack.of(at_s, whole)
