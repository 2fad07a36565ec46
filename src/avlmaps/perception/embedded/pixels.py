"""The eyes that ship, and those that you trained: objects and areas by the scene networks."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, cast

import numpy as np

from avlmaps.core import lexicon as words_known
from avlmaps.core.arrays import Float, Float32
from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.embedded.scene_network import (
    DEFAULT_WEIGHTS,
    SYNTHETIC_WEIGHTS,
    Notes,
    PairedNetworks,
    SceneNetwork,
    Seen,
    load_network,
    load_pair,
    read_network,
    see_multi_scale,
)
from avlmaps.perception.embedded.words import Meanings
from avlmaps.perception.models import PUBLISHED, local_model
from avlmaps.perception.networks import Remembered, key_of, seen_in
from avlmaps.perception.protocols import ModelCard, RoomContents, WordEncoder, read_room_contents
from avlmaps.recordings.types import Frame

_ROOMS = Remembered()  # by network and frame


class NamedEncoder:
    """An encoder that distinguishes a closed set of names; by default with the two networks and the words that ship.

    The features lie in the space of ``words`` where it has room for all names; ``licence`` is of the networks.
    """

    _names: ClassVar[str]  # ``categories`` or ``rooms`` of the network's notes

    def __init__(
        self,
        network: SceneNetwork | PairedNetworks | None = None,
        words: WordEncoder | None = None,
        licence: str = "MIT",
    ) -> None:
        self._network = load_pair() if network is None else network
        self._words = cast(WordEncoder, load(Kind.WORDS, "embedded")) if words is None else words
        self.names: tuple[str, ...] = getattr(self._network.notes, self._names)
        self.codes = orthonormal_codes(self._words.encode(self.names))
        self.card = self._card(self._network.notes, self._network.checksum, licence)

    def _card(self, notes: Notes, checksum: str, licence: str) -> ModelCard:
        return ModelCard(id=notes.id, dim=self.codes.shape[1], licence=licence, checksum=checksum, note=notes.note)

    def see(self, frame: Frame) -> Seen:
        """Return the probabilities of things on the grid of ``encode``, and of kinds of room, which are remembered."""
        seen = self._network.see(frame)
        _ROOMS.put(self._key(frame), seen.room)
        return seen

    def room(self, frame: Frame) -> Float32[np.ndarray, " r"]:
        """Return the probability of each kind of room; what pixels were seen of needs no second look."""
        known = _ROOMS.get(self._key(frame))
        return self.see(frame).room if known is None else known

    def _key(self, frame: Frame) -> str:
        # No two frames agree on all of that, and a picture's every byte takes 2 ms to read.
        return key_of(self._network.checksum, frame.rgb[::8], frame.depth_m[::8], *seen_in(frame)[2:])

    @cached_property
    def meanings(self) -> Meanings:
        """Finds the meaning of a phrase among the names."""
        notes = self._network.notes
        called = tuple((name, *notes.called.get(name, ())) for name in self.names)
        kind = words_known.EntryKind.ROOM if self.names == notes.rooms else words_known.EntryKind.THING
        return Meanings(self.names, called, notes.kinds, self._words, kind)

    def name_weights(self, word: str) -> Float32[np.ndarray, " k"]:
        """Return how much a phrase means each of ``names``, 1 for the most meant; zero where it means none.

        A name takes in its narrower ones: an armchair answers to "chair".
        """
        return self.meanings.name_weights(word)


def orthonormal_codes(words: Float[np.ndarray, "n d"]) -> Float32[np.ndarray, "n k"]:
    """Return the orthonormal vectors nearest to linearly independent unit vectors, in the same order.

    More vectors than numbers in each have no such place: theirs is a space of their own, an axis for each.
    """
    if len(words) > words.shape[1]:
        return np.eye(len(words), dtype=np.float32)
    left, _, right = np.linalg.svd(np.asarray(words, np.float64), full_matrices=False)
    return (left @ right).astype(np.float32)


def features_of(
    probability: Float[np.ndarray, "*n k"], codes: Float32[np.ndarray, "k d"]
) -> Float32[np.ndarray, "*n d"]:
    """Return Σ √p·code for distributions over the names."""
    root = np.sqrt(np.maximum(probability, 0.0)).astype(np.float32, copy=False)
    return root if np.array_equal(codes, np.eye(len(codes))) else root @ codes


# Beyond these an instance's size says no more for or against it.
SMALLEST_LOG_AREA, LARGEST_LOG_AREA = -4.0, 0.7


class EmbeddedPixels(NamedEncoder):
    """Distinguishes a hundred and fifty things of homes and offices by their shape, helped a little by colour."""

    _names = "categories"

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The categories that compete for a voxel, without ``other``."""
        return tuple(name for name in self.names if name != "other")

    @property
    def room_contents(self) -> RoomContents:
        """What it names in rooms of each kind: furnished homes and its mistakes together (``training/rooms``)."""
        return read_room_contents(Path(__file__).parent)

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return features on a grid of half the size that the network looks at; zero where there is no depth."""
        seen = self.see(frame)
        return np.where(seen.known[..., None], features_of(seen.category, self.codes), np.float32(0.0))

    def see_multi_scale(self, frame: Frame) -> Seen:
        """Return better probabilities of a frame by itself, ten times slower; a map gains nothing from them."""
        return see_multi_scale(self._network, frame)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; zero for one that means none of the categories.

        That of a category is its code alone: its narrower ones are vectors of their own.
        """
        vectors = np.zeros((len(words), self.card.dim), np.float32)
        for row, word in enumerate(words):
            weights = self.meanings.own_weights(word)
            if weights.any():
                vectors[row] = features_of(weights / weights.sum(), self.codes)
        return vectors

    def understood(self, word: str) -> str:
        """Return the categories that a phrase is taken for, the most meant first, or ``""``."""
        weights = self.meanings.own_weights(word)
        best = [self.names[i] for i in np.argsort(-weights, kind="stable") if weights[i] > 0.0]
        clean = " ".join(word.lower().split())
        return clean if clean in best else " or ".join(best[:4])

    def instance_probability(
        self, name: str, mean_probability: Float[np.ndarray, " i"], area_m2: Float[np.ndarray, " i"]
    ) -> Float[np.ndarray, " i"]:
        """Return how likely connected voxels are a true instance of a name; see ``InstanceNotes``.

        ``mean_probability`` is of the name, over the voxels of each instance; ``area_m2`` is each one's surface.
        """
        notes = self._network.notes.instances
        p = np.clip(np.asarray(mean_probability, np.float64), 1e-4, 1.0 - 1e-4)
        usual_m2 = notes.area_m2.get(name, notes.default_area_m2)
        size = np.clip(np.log(np.maximum(area_m2, 1e-6) / usual_m2), SMALLEST_LOG_AREA, LARGEST_LOG_AREA)
        odds = (
            notes.bias.get(name, notes.default_bias) + notes.slopes[0] * np.log(p / (1.0 - p)) + notes.slopes[1] * size
        )
        return 1.0 / (1.0 + np.exp(-odds))


def synthetic_pixels() -> EmbeddedPixels:
    """Return the encoder whose weights saw no NYU Depth V2."""
    return EmbeddedPixels(load_network(SYNTHETIC_WEIGHTS))


class EmbeddedViews(NamedEncoder):
    """Distinguishes kinds of room by the things in them."""

    _names = "rooms"

    def _card(self, notes: Notes, checksum: str, licence: str) -> ModelCard:
        note = f"Knows these kinds of room: {', '.join(self.names)}."
        return replace(super()._card(notes, checksum, licence), id=notes.id.replace("pixels", "views"), note=note)

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        rooms = [self.room(frame) for frame in frames]
        return features_of(np.stack(rooms), self.codes) if rooms else np.zeros((0, self.card.dim), np.float32)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase; one that means no kind of room lies across all of them."""
        vectors = np.zeros((len(words), self.card.dim), np.float32)
        for row, word in enumerate(words):
            weights = self.meanings.name_weights(word)
            vector = features_of(weights / weights.sum(), self.codes) if weights.any() else self._across(word)
            vectors[row] = vector / np.linalg.norm(vector)
        return vectors

    def _across(self, word: str) -> Float32[np.ndarray, " d"]:
        vector = self._words.encode([word])[0]
        rest = vector - self.codes.T @ (self.codes @ vector)
        return rest if np.linalg.norm(rest) > 1e-3 else vector


def synthetic_views() -> EmbeddedViews:
    """Return the encoder whose weights saw no NYU Depth V2."""
    return EmbeddedViews(load_network(SYNTHETIC_WEIGHTS))


# The name under which a folder of models holds them, unless another is chosen.
MODEL = "eyes"
_HOW_TO_GET = PUBLISHED[MODEL].get
_REMEDY = f"train them again with {_HOW_TO_GET}"
# Whose the weights are: nobody but who trained them knows under which terms the frames came.
_LICENCE = "your own"


def trained_pixels(model: str = MODEL) -> EmbeddedPixels:
    """Return the pixel encoder of your own networks; see ``open_trained``."""
    return EmbeddedPixels(open_trained(model), licence=_LICENCE)


def trained_views(model: str = MODEL) -> EmbeddedViews:
    """Return the view encoder of your own networks; see ``open_trained``."""
    return EmbeddedViews(open_trained(model), licence=_LICENCE)


def open_trained(model: str = MODEL) -> SceneNetwork | PairedNetworks:
    """Return networks from a folder, or the one of a file ``NAME.onnx`` with ``NAME.json`` beside it.

    ``model`` is a name in the folder of models, or a path. ``BackendError``: they are not here, cannot be read, or do
    not go together.
    """
    place = local_model(model, _HOW_TO_GET)
    if place.is_file():
        return read_network(place.parent, place.stem, _REMEDY)
    has_first, has_second = ((place / f"{name}.onnx").is_file() for name in (DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS))
    if not has_first and not has_second:
        raise BackendError(
            f"{place} holds neither {DEFAULT_WEIGHTS}.onnx nor {SYNTHETIC_WEIGHTS}.onnx; get them with: {_HOW_TO_GET}"
        )
    if not has_first:
        return read_network(place, SYNTHETIC_WEIGHTS, _REMEDY)
    first = read_network(place, DEFAULT_WEIGHTS, _REMEDY)
    second = read_network(place, SYNTHETIC_WEIGHTS, _REMEDY) if has_second else load_network(SYNTHETIC_WEIGHTS)
    try:
        return PairedNetworks(first, second)
    except ValueError as fault:
        beside = "beside it" if has_second else "that ships"
        raise BackendError(
            f"{place / DEFAULT_WEIGHTS}.onnx and the second network {beside} do not go together ({fault}) Give the "
            "file itself as the model, to use it alone."
        ) from fault
