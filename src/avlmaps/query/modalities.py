"""Where a sound was heard or came from, by its name or by a clip, and where a photo was taken."""

import itertools
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Float32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError, QueryError
from avlmaps.core.question import Part, Role
from avlmaps.core.wording import option
from avlmaps.maps.types import HeardSounds
from avlmaps.query.factors import NearAnchors, stretch_scores
from avlmaps.query.settings import FOUND_AT, HeatSettings, SoundSettings
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.images import COLOUR_SUFFIXES

if TYPE_CHECKING:
    from avlmaps.maps.sources.candidates import Spread
    from avlmaps.query.locate import Located
    from avlmaps.query.sound_sources import SourceMap

# A clip whose loudest sample is below this (−80 dB of full scale) holds nothing to compare.
_SILENCE = 1e-4


def sound_features(sounds: HeardSounds) -> list[Float32[np.ndarray, "windows d"]]:
    """Return the features of each heard sound."""
    return [np.asarray(sounds.feature[a:b], np.float32) for a, b in itertools.pairwise(sounds.feature_offsets)]


def sound_factor(
    space: Space, sounds: HeardSounds, scores: Float[np.ndarray, " sounds"], part: Part, settings: SoundSettings,
    heat: HeatSettings,
) -> NearAnchors:  # fmt: skip
    """Return the heat of a sound, by each one's probability to match: anchors are the places along its track."""
    best = float(np.max(scores, initial=0.0))
    note = ""
    if not len(sounds):
        note = "the map holds no sounds"
    elif best < FOUND_AT:
        note = (
            f"none of the {len(sounds)} detected sounds is like {part.query!r}; the best score is {best:.2f}, "
            f"below {FOUND_AT:.2f}"
        )
    used = (
        stretch_scores(np.asarray(scores, np.float64)) if settings.normalise == "min-max" else np.clip(scores, 0.0, 1.0)
    )
    which = np.repeat(np.arange(len(sounds)), np.diff(sounds.track_offsets))
    anchors = np.asarray(sounds.track, np.float64).reshape(-1, 3)
    return NearAnchors(
        space, part, heat.falloff_per_m(part.role), anchors, used[which], which, best >= FOUND_AT, part.query, note
    )


def read_clip(path: Path) -> Sound:
    """Read a clip to ask with. ``QueryError``: it is missing, unreadable or silent."""
    if not path.is_file():
        raise QueryError(f"The clip {path} is not there; check the name.")
    if path.suffix.lower() in COLOUR_SUFFIXES:
        raise QueryError(f"{path} is a picture, no clip; give it as {option('image')}.")
    try:
        sound = AudioTrack.open(path).read()
    except AudioError as fault:
        said = str(fault)
        unread = f"{path} cannot be read as sound: {said}"
        raise QueryError(f"The clip {said if said.startswith(str(path)) else unread}") from fault
    return require_audible(sound, str(path))


def require_audible(sound: Sound, name: str) -> Sound:
    """Return the sound, or raise ``QueryError`` where it is empty, silent or holds NaN."""
    if not len(sound.samples):
        raise QueryError(f"The clip {name} has no samples; ask with another one.")
    if not np.isfinite(sound.samples).all():
        raise QueryError(f"The clip {name} holds NaN or infinity; ask with another one.")
    loudest = float(np.abs(sound.samples).max())
    if loudest < _SILENCE:
        raise QueryError(
            f"The clip {name} is silent (its loudest sample is {loudest:.2g}); ask with one that has sound."
        )
    return sound


_LEAST = 0.05  # sounds of a lower score are left out


@dataclass(frozen=True, eq=False, kw_only=True)
class SourceAnchors(NearAnchors):
    """Heat of where sounds came from: the anchors of a source are the cells of its region.

    What is sought is right where the sound is one and its source lies so near; as context the sound alone counts.
    """

    spreads: "tuple[Spread, ...]"  # for each source, how well its place is known
    waits: bool = False  # whether such a sound was heard whose place is not found yet, in a map that grows
    found: bool = field(init=False)
    note: str = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        best = float((self.scores * self.confidence[self.instance]).max(initial=0.0))
        object.__setattr__(self, "found", best >= FOUND_AT)
        object.__setattr__(self, "note", "" if self.found else self._absence())

    @cached_property
    def confidence(self) -> Float[np.ndarray, " i"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Probability that the source of each lies where its heat is highest, within ``RIGHT_M``; 1 of context."""
        if self.part.role is Role.CONTEXT:
            return np.ones(len(self.spreads))
        return np.array([spread.right for spread in self.spreads])

    def spread_of(self, instance: int) -> "Spread":
        """Return how well the place of a source is known."""
        return self.spreads[instance]

    def _absence(self) -> str:
        from avlmaps.maps.sources.candidates import RIGHT_M

        best = float(self.scores.max(initial=0.0))
        if best < FOUND_AT and self.waits:
            return "it was heard, but where it came from is not known (a map that grows finds it in a moment)"
        if best < FOUND_AT:
            return f"no detected sound is like {self.part.query!r}; the best score is {best:.2f}"
        spread = self.spreads[int(self.instance[np.argmax(self.scores * self.confidence[self.instance])])]
        return (
            f"it was heard, but its source is only known to lie {spread.around('the best guess')}; a goal is right "
            f"within {RIGHT_M:g} m"
        )


def source_factor(
    space: Space, sources: "SourceMap", scores: Float[np.ndarray, " sounds"], part: Part, settings: SoundSettings,
    heat: HeatSettings,
) -> SourceAnchors:  # fmt: skip
    """Return the heat of where a sound came from, by the probability of each to match.

    A cell has the source's score times how likely it is against the likeliest cell. Unlikely sounds are not joined.
    """
    order = np.argsort(-scores, kind="stable")
    kind, with_prior = "" if part.is_file else part.query, settings.prior == "lexicon"
    found = sources.sources([i for i in order.tolist() if scores[i] >= FOUND_AT], kind, with_prior)
    unsure = [i for i in order.tolist() if _LEAST <= scores[i] < FOUND_AT and sources.is_located(i)]
    found += [sources.joined([i], kind, with_prior) for i in unsure]
    places, values, which = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, np.int64)]
    for number, one in enumerate(found):
        cells, share = sources.anchors(one)
        places.append(cells)
        values.append(share * max(float(np.clip(scores[i], 0.0, 1.0)) for i in one.events))
        which.append(np.full(len(cells), number))
    return SourceAnchors(
        space=space, part=replace(part, at="source"), falloff_per_m=heat.falloff_per_m(part.role),
        anchors=np.concatenate(places), scores=np.concatenate(values), instance=np.concatenate(which),
        understood=part.query, spreads=tuple(one.density.spread for one in found),
        waits=any(scores[i] >= FOUND_AT and not sources.is_located(i) for i in order.tolist()),
    )  # fmt: skip


# A guess stays a guess, however few keypoints agree with it.
_LEAST_CERTAINTY, _MOST_OF_A_GUESS = 0.01, 0.49


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that came without a file of its own."""

    rgb: np.ndarray  # (h, w, 3) uint8, as ``require_fitting`` checks
    focal_35mm: float | None = None  # the focal length for 35 mm film in its EXIF, mm; None where it has none


Attachment = UInt8[np.ndarray, "h w 3"] | Photo | Sound
"""A picture or a sound that comes with a question, instead of a file."""


def read_picture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """Read a picture as RGB. ``QueryError``: it is missing or no picture."""
    import cv2

    if not path.is_file():
        kind = "is a folder" if path.is_dir() else "is not there"
        raise QueryError(f"The picture {path} {kind}; check the name.")
    encoded = np.frombuffer(path.read_bytes(), np.uint8)
    # The pose is that of the picture as its pixels lie, so a camera's turn flag must not rotate it.
    picture = cv2.imdecode(encoded, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION) if len(encoded) else None
    if picture is None:
        raise QueryError(f"The picture {path} cannot be read as an image; use a PNG or a JPEG.")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


def require_fitting(rgb: np.ndarray, intrinsics: object) -> None:
    """Raise ``QueryError`` where a picture is not RGB of whole bytes, or not of the size its intrinsics are for."""
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or rgb.size == 0:
        raise QueryError(
            f"The picture is an array of {rgb.dtype} and shape {rgb.shape}; give RGB, uint8 of (height, width, 3)."
        )
    height, width = rgb.shape[:2]
    if intrinsics is not None and not isinstance(intrinsics, Pinhole):
        raise QueryError(
            "The intrinsics of a picture are an avlmaps.Pinhole(fx, fy, cx, cy, width, height), not "
            f"{type(intrinsics).__name__}."
        )
    if intrinsics is not None and (intrinsics.width, intrinsics.height) != (width, height):
        raise QueryError(
            f"The picture has {width}x{height} pixels, its intrinsics are for "
            f"{intrinsics.width}x{intrinsics.height}; give those of the picture as it is."
        )


def image_factor(space: Space, located: "Located", part: Part, heat: HeatSettings) -> NearAnchors:
    """Return the heat of a picture: an anchor of score 1 at the camera, and where it fits as well; else at a guess."""
    is_located = located.world_from_camera is not None
    pose = located.world_from_camera if is_located else located.guess
    confidence = max(min(located.score, _MOST_OF_A_GUESS), _LEAST_CERTAINTY)
    if is_located:
        confidence = 1.0 if located.elsewhere is None else located.score
    found = pose is not None and confidence >= FOUND_AT
    anchors = np.array([each[:3, 3] for each in (pose, located.elsewhere) if each is not None]).reshape(-1, 3)
    notes = [] if is_located else [f"the picture could not be located ({located.inliers} points agree)"]
    if located.notes and (not is_located or located.elsewhere is not None):
        notes.append(f"{located.notes[0][:1].lower()}{located.notes[0][1:].rstrip('.')}")
    if pose is not None and not is_located:
        notes.append("the heat is that of the best guess")
    note, instance = "; ".join(notes), np.arange(len(anchors))
    return NearAnchors(
        space, part, heat.falloff_per_m(part.role), anchors, np.ones(len(anchors)), instance, found, part.query, note,
        float(confidence),
    )  # fmt: skip
