"""The floors under a walk, so that encoders may know how high over the floor a pixel lies.

Frames become voxels in level axes (``patches``). Cameras are grouped by their height; for each group the level
surfaces below it are hypotheses of its floor, and the evidence for each is weighed (``floor_choice``).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from avlmaps.maps.gravity.floor_choice import (
    CERTAIN,
    SAME_M,
    Choice,
    Expected,
    SurfacesAtHeight,
    choose_floor,
    stood_over,
)
from avlmaps.maps.gravity.patches import Sight, Voxelised, sight_of
from avlmaps.recordings.types import Frame, Ground, Recording, Subset

_BAND_M = 0.12  # cameras of one group differ in height by no more than this
_STOREY_M = 0.6  # a camera's view counts for others whose height differs by no more than this


@dataclass(frozen=True, slots=True)
class FoundFloor:
    """A floor that cameras stood over.

    Attributes:
        cameras_m: (k,) rising heights of these cameras, along up.
        height_m: of the floor, along up.
        confidence: how likely this is the floor under all the evidence, in [0, 1]; mean over the cameras.
        choice: the hypotheses behind it, of the group with the most cameras.
    """

    cameras_m: Float[np.ndarray, " k"]
    height_m: float
    confidence: float
    choice: Choice

    @property
    def camera_height_m(self) -> float:
        """Median height of these cameras over the floor."""
        return float(np.median(self.cameras_m)) - self.height_m


@dataclass(frozen=True, slots=True)
class FoundGround:
    """The floors of a recording, and their confidence.

    Attributes:
        ground: for the height of each camera the floor under it.
        floors: each of them once, lowest first.
    """

    ground: Ground
    floors: tuple[FoundFloor, ...]


def find_ground(
    frames: Iterable[Frame], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors that a recording's cameras stood over.

    Args:
        frames: spread over the recording; one after the other is held in memory.
        up_in_world: unit vector.
        start: the floor that someone gave for the start of the recording.

    Returns:
        For the height of each frame's camera the height of the floor under it, along up, and the confidence.
    """
    up = np.asarray(up_in_world, np.float64)
    return ground_of_sights([sight_of(frame, up) for frame in frames], up, start)


def ground_of_sights(
    sights: Sequence[Sight], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors from what frames show; see ``find_ground``."""
    nothing = Voxelised.union([])
    sights = sorted(sights or [Sight(np.zeros(3), nothing, nothing)], key=lambda sight: float(sight.camera_m[2]))
    cameras_m = np.array([sight.camera_m[2] for sight in sights])
    everywhere = Voxelised.union([sight.level for sight in sights])
    under_m = stood_over(np.stack([sight.camera_m for sight in sights]), everywhere)
    bands = list(_bands(cameras_m))
    views = [_view(sights, cameras_m, under_m, band) for band in bands]
    usual_m = _usual_height_m(bands, [choose_floor(view, start) for view in views])
    choices = [choose_floor(view, start, usual_m) for view in views]
    floor_m = np.concatenate(
        [np.full(len(band), choice.best.height_m) for band, choice in zip(bands, choices, strict=True)]
    )
    return FoundGround(Ground(up_in_world, cameras_m, floor_m), _floors(cameras_m, bands, choices))


def _bands(cameras_m: Float[np.ndarray, " k"]) -> Iterator[Int[np.ndarray, " m"]]:
    order = np.arange(len(cameras_m))
    for run in np.split(order, np.flatnonzero(np.diff(cameras_m) > _BAND_M) + 1):
        span_m = cameras_m[run[-1]] - cameras_m[run[0]]
        pieces = max(1, int(np.ceil(span_m / _BAND_M - 1e-6)))
        place = np.minimum(((cameras_m[run] - cameras_m[run[0]]) / max(span_m, 1e-9) * pieces).astype(int), pieces - 1)
        yield from (run[place == piece] for piece in range(pieces) if (place == piece).any())


def _view(
    sights: Sequence[Sight],
    cameras_m: Float[np.ndarray, " k"],
    under_m: Float[np.ndarray, " k"],
    band: Int[np.ndarray, " m"],
) -> SurfacesAtHeight:
    middle_m = float(np.median(cameras_m[band]))
    near = [sight for sight, at_m in zip(sights, cameras_m, strict=True) if abs(at_m - middle_m) < _STOREY_M]
    return SurfacesAtHeight(
        camera_m=middle_m,
        surface=Voxelised.union([sight.surface for sight in near]),
        level=Voxelised.union([sight.level for sight in near]),
        under_m=under_m[band],
    )


def _usual_height_m(bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]) -> float | None:
    known = [
        (choice.best.camera_height_m, len(band))
        for band, choice in zip(bands, choices, strict=True)
        if choice.best.seen and choice.confidence >= CERTAIN
    ]
    heights_m = [height_m for height_m, count in known for _ in range(count)]
    return float(np.median(heights_m)) if heights_m else None


def _floors(
    cameras_m: Float[np.ndarray, " k"], bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]
) -> tuple[FoundFloor, ...]:
    order = sorted(range(len(bands)), key=lambda index: choices[index].best.height_m)
    joined: list[list[int]] = []
    for index in order:
        height_m = choices[index].best.height_m
        if joined and height_m - choices[joined[-1][0]].best.height_m < SAME_M:
            joined[-1].append(index)
        else:
            joined.append([index])
    return tuple(_joined(cameras_m, [bands[i] for i in group], [choices[i] for i in group]) for group in joined)


def _joined(
    cameras_m: Float[np.ndarray, " k"], bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]
) -> FoundFloor:
    count = np.array([len(band) for band in bands])
    main = choices[int(count.argmax())]
    confidence = float(np.average([choice.confidence for choice in choices], weights=count))
    return FoundFloor(np.sort(cameras_m[np.concatenate(bands)]), main.best.height_m, confidence, main)


class GroundedRecording(Subset):
    """A whole recording whose frames know the up direction and where the floor is."""

    def __init__(self, whole: Recording, ground: Ground) -> None:
        super().__init__(whole, range(len(whole)))
        self.ground = ground

    def frame(self, index: int) -> Frame:
        """Read one frame and give it the ground."""
        return replace(self.whole.frame(index), ground=self.ground)

    @cached_property
    def fingerprint(self) -> str:
        """The recording's own: the ground follows from it."""
        return self.whole.fingerprint
