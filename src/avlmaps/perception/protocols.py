"""The protocols of backends. Arrays are numpy at every boundary; features have unit length.

One conformance suite (``avlmaps.perception.conformance``) holds for every backend of a protocol, ours or others'.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from avlmaps.core.arrays import Float, Float32, Float64, Int, UInt8
from avlmaps.core.registry import Kind
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame

TABLE = "room_contents.csv"
FURNISHED = Path(__file__).parent
UNIT_WITHIN = 0.02  # by as much the length of a feature may differ from one


@dataclass(frozen=True, slots=True, eq=False)
class RoomContents:
    """The mean surface, m², of each thing (row) in a room of each kind (column); both are names of the lexicon."""

    things: tuple[str, ...]
    kinds: tuple[str, ...]
    surface_m2: Float64[np.ndarray, "t r"]


@cache
def read_room_contents(folder: Path = FURNISHED) -> RoomContents:
    """Return the table of a folder (furnished rooms, or an encoder's): a row a thing, a column a kind of room."""
    text = (folder / TABLE).read_text(encoding="utf-8")
    head, *rows = csv.reader(text.splitlines())
    surface = np.array([[float(value) for value in row[1:]] for row in rows], np.float64)
    return RoomContents(tuple(row[0] for row in rows), tuple(head[1:]), surface)


@dataclass(frozen=True, slots=True)
class ModelCard:
    """Which model made the features; it is written into the map."""

    id: str  # the model's name and version, such as ``avlmaps/words-1``
    dim: int  # length of a feature
    licence: str  # SPDX name of the weights' licence
    checksum: str  # hex SHA-256 of the weights (or of the code's own constants); queries need the same
    prompts: tuple[str, ...] = ("{}",)  # that a word is put into before it is encoded, at ``{}``
    note: str = ""  # what a user must know of its limits, one sentence


@runtime_checkable
class WordEncoder(Protocol):
    """Turns phrases into vectors."""

    card: ModelCard

    def encode(self, phrases: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; the same phrase gives the same vector beside any other phrases."""
        ...


@runtime_checkable
class PixelEncoder(Protocol):
    """Gives every region of a picture a feature that words can be compared with."""

    card: ModelCard

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Names that compete with a queried word for a voxel (the paper's class list), without ``other``."""
        ...

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return features on a grid that covers the colour picture evenly, each of unit length or all zero.

        Zero says that the encoder has nothing to say of that pixel; it then adds no feature to the map.
        """
        ...

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each word; all zero for a word of which this encoder understands nothing."""
        ...

    def understood(self, word: str) -> str:
        """Return the part of the phrase that this encoder can act on (``red`` of ``red cabinet``), or ``""``."""
        ...


@runtime_checkable
class BatchPixelEncoder(PixelEncoder, Protocol):
    """A pixel encoder that is quicker with several frames at once (on a GPU)."""

    @property
    def batch(self) -> int:
        """How many frames it likes to be given at once."""
        ...

    def encode_batch(self, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
        """Return the features of ``encode`` for each frame (to rounding)."""
        ...


class NamedEncoder(Protocol):
    """An encoder that distinguishes a closed set of names.

    Its features lie in the span of orthonormal codes, one for each name: Σ √p·code. A phrase may mean several names.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """The names that it distinguishes."""
        ...

    @property
    def codes(self) -> Float32[np.ndarray, "k d"]:
        """The code of each name."""
        ...

    def name_weights(self, word: str) -> Float32[np.ndarray, " k"]:
        """Return for each name how much a phrase means it, in [0, 1]; all zero where it means none."""
        ...


@runtime_checkable
class NamedPixelEncoder(NamedEncoder, PixelEncoder, Protocol):
    """A pixel encoder that distinguishes a closed set of names and can say how likely each of them is."""

    def instance_probability(
        self, name: str, mean_probability: Float[np.ndarray, " i"], area_m2: Float[np.ndarray, " i"]
    ) -> Float[np.ndarray, " i"]:
        """Return how likely connected voxels are a true instance of a name.

        ``mean_probability`` is of the name, over the voxels of each instance; ``area_m2`` a voxel's face for each of
        its voxels.
        """
        ...


@runtime_checkable
class SurveyedEncoder(Protocol):
    """A pixel encoder whose answers were counted in furnished rooms of known kinds.

    What it names in a kitchen says more about kitchens than what stands there: it also says what it takes things for.
    """

    @property
    def room_contents(self) -> RoomContents:
        """The mean surface of what it names so in a room of each kind."""
        ...


@runtime_checkable
class ViewEncoder(Protocol):
    """Gives a whole picture one feature that the name of an area can be compared with."""

    card: ModelCard

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        ...

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase."""
        ...


@runtime_checkable
class NamedViewEncoder(NamedEncoder, ViewEncoder, Protocol):
    """A view encoder that distinguishes a closed set of rooms."""


@runtime_checkable
class ScaledEncoder(Protocol):
    """A pixel or view encoder of an open vocabulary that learnt by how much its cosines count (CLIP, SigLIP).

    The cosines of such a model differ by hundredths between a right and a wrong word; its softmax was trained with
    them multiplied by this. An encoder without it says nothing of the kind.
    """

    @property
    def logit_scale(self) -> float:
        """A cosine higher by 1 / logit_scale makes a word e times as likely; about 100 for CLIP."""
        ...


@runtime_checkable
class SoundEncoder(Protocol):
    """Gives a sound features that words and other sounds can be compared with."""

    card: ModelCard

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The kinds of sound that it knows; empty for an open vocabulary."""
        ...

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of a sound; long sounds have many, any sound at least one.

        ``AudioError``: the sound has no samples, or holds NaN.
        """
        ...

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase."""
        ...

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound is what each phrase names, calibrated: in [0, 1], at least 0.5 is 'yes'."""
        ...

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one, calibrated: in [0, 1], 0.5 is 'yes'."""
        ...


@runtime_checkable
class FrameSoundEncoder(SoundEncoder, Protocol):
    """A sound encoder that gives a vector for each short step of time: a track can be mapped whole, silence and all."""

    @property
    def hop_s(self) -> float:
        """Seconds of a step: row i of ``encode`` is what sounds from i · hop_s on; a last, shorter step has its own."""
        ...


@dataclass(frozen=True, slots=True)
class LocalFeatures:
    """Keypoints of one picture."""

    xy: Float32[np.ndarray, "n 2"]  # pixels, sub-pixel, the centre of the first pixel at (0.5, 0.5)
    descriptors: Float32[np.ndarray, "n d"]  # of unit length
    # the detector's confidence in each, in [0, 1]; empty where it is not known
    score: Float32[np.ndarray, " n_or_none"] = field(default_factory=lambda: np.zeros(0, np.float32))
    # (width, height) of the picture, pixels; (0, 0) where it is not known. Learned matchers need it
    size: tuple[int, int] = (0, 0)


@runtime_checkable
class LocalEncoder(Protocol):
    """Finds keypoints and describes them."""

    card: ModelCard

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return the picture's keypoints; none for a blank picture."""
        ...


@runtime_checkable
class PlaceEncoder(Protocol):
    """Gives a whole picture one descriptor, to find the keyframes that saw the same place."""

    card: ModelCard

    def fit(self, local: Sequence[LocalFeatures], rng: "np.random.Generator") -> dict[str, np.ndarray]:
        """Learn from the map's own keyframes (VLAD: the visual words); the map stores the returned arrays.

        What has learnt from others' pictures before returns none.
        """
        ...

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return a unit vector; zero where one that is made of keypoints has none (a network sees any picture)."""
        ...


@runtime_checkable
class Matcher(Protocol):
    """Finds which keypoints of two pictures show the same point."""

    card: ModelCard

    def match(self, a: LocalFeatures, b: LocalFeatures) -> Int[np.ndarray, "m 2"]:
        """Return rows (index in a, index in b); each index at most once."""
        ...


@runtime_checkable
class LearnedMatcher(Matcher, Protocol):
    """A matcher that is a network.

    It reads scores and the sizes of the pictures as well, and takes only the keypoints that it was learnt on. What it
    pairs hangs on its weights alone: with random ones it need not even pair a picture with itself, as others must.
    """

    @property
    def learned(self) -> bool:
        """True."""
        ...


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a picture was taken, and the number of points that agree with that."""

    world_from_camera: Float[np.ndarray, "4 4"]
    inliers: int


PROTOCOLS: dict[Kind, type] = {
    Kind.WORDS: WordEncoder,
    Kind.PIXELS: PixelEncoder,
    Kind.VIEWS: ViewEncoder,
    Kind.SOUNDS: SoundEncoder,
    Kind.LOCAL: LocalEncoder,
    Kind.PLACE: PlaceEncoder,
    Kind.MATCHER: Matcher,
}


def members_of(protocol: type) -> tuple[str, ...]:
    """Return the names of a protocol's members."""
    bases = [base for base in protocol.__mro__ if getattr(base, "_is_protocol", False) and base is not Protocol]
    names = {name for base in bases for name in (*vars(base), *vars(base).get("__annotations__", ()))}
    return tuple(sorted(name for name in names if not name.startswith("_")))
