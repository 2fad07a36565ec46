"""Every registered backend holds to its protocol, and the suite itself can fail."""

import dataclasses

import numpy as np
import pytest

from avlmaps.core.registry import Backend, Kind, backends, load
from avlmaps.perception.conformance import NonConformanceError, check
from avlmaps.perception.models import availability

OURS = [backend for backend in backends() if backend.target.startswith("avlmaps.")]


@pytest.mark.parametrize("backend", OURS, ids=lambda b: f"{b.kind}-{b.name}")
def test_every_backend_that_is_here_conforms(backend: Backend) -> None:
    if backend.missing:
        pytest.skip(f"needs {', '.join(backend.missing)}")
    if (told := availability(backend)).state == "weights missing":
        pytest.skip(f"needs {told.model}; test_light.py holds the backends light to theirs with files of its own")
    check(backend.kind, load(backend.kind, backend.name))


class Longer:
    """A pixel encoder whose features are not of unit length."""

    def __init__(self, real) -> None:
        self.real, self.card = real, real.card
        self.vocabulary, self.understood = real.vocabulary, real.understood
        self.encode_words = real.encode_words

    def encode(self, frame) -> np.ndarray:
        return self.real.encode(frame) * np.float32(2.0)


def test_features_of_another_length_are_found_out() -> None:
    with pytest.raises(NonConformanceError, match="pixel features must have unit length"):
        check(Kind.PIXELS, Longer(load(Kind.PIXELS, "colours")))


def test_a_card_without_a_checksum_is_found_out() -> None:
    encoder = Longer(load(Kind.PIXELS, "colours"))
    encoder.card = dataclasses.replace(encoder.card, checksum="unknown")
    with pytest.raises(NonConformanceError, match="the card's checksum must be a hex SHA-256, not 'unknown'"):
        check(Kind.PIXELS, encoder)


def test_a_missing_member_is_found_out() -> None:
    with pytest.raises(NonConformanceError, match=r"lacks card, encode, .* of SoundEncoder"):
        check(Kind.SOUNDS, object())


class Pairing:
    """A matcher whose answer a test chooses; learned or not."""

    card = dataclasses.replace(load(Kind.MATCHER, "mutual-ratio").card, id="fake/pairing", dim=64)

    def __init__(self, answer) -> None:
        self.match = lambda a, b: answer(a, b) if len(a.xy) and len(b.xy) else np.zeros((0, 2), np.int64)


class Learned(Pairing):
    learned = True


def nearest(a, b) -> np.ndarray:
    """The true pairs, for features of any length."""
    return load(Kind.MATCHER, "mutual-ratio").match(a, b)


def test_a_matcher_is_given_features_of_its_own_length_with_scores_and_sizes() -> None:
    given = []
    check(Kind.MATCHER, Pairing(lambda a, b: (given.extend([a, b]), nearest(a, b))[1]))
    for one in given:
        assert one.descriptors.shape == (len(one.xy), 64) and one.size == (64, 64)
        assert len(one.score) == len(one.xy) and ((one.xy >= 0) & (one.xy <= 64)).all()


def test_only_a_learned_matcher_may_find_nothing() -> None:
    def nothing(a, b):
        return np.zeros((0, 2), np.int64)

    check(Kind.MATCHER, Learned(nothing))
    with pytest.raises(NonConformanceError, match="a picture must match itself"):
        check(Kind.MATCHER, Pairing(nothing))


@pytest.mark.parametrize(
    "wrong, said",
    [
        (lambda a, b: nearest(a, b).astype(np.float32), "whole numbers"),
        (lambda a, b: nearest(a, b) - 1, "numbers of keypoints below 40"),
        (lambda a, b: np.add(nearest(a, b), (0, 40)), "numbers of keypoints below 40"),
        (lambda a, b: np.repeat(nearest(a, b), 2, axis=0), "at most once"),
        (lambda a, b: np.stack([np.arange(40)] * 2, axis=1), "the order of a picture's keypoints must not matter"),
        (lambda a, b: nearest(a, b)[:, 0], "shape"),
    ],
)
def test_a_learned_matcher_that_breaks_a_promise_is_found_out(wrong, said: str) -> None:
    with pytest.raises(NonConformanceError, match=said):
        check(Kind.MATCHER, Learned(wrong))


def test_a_matcher_that_changes_its_mind_is_found_out() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(NonConformanceError, match="the same keypoints must give the same matches"):
        check(Kind.MATCHER, Learned(lambda a, b: rng.permutation(nearest(a, b))))


@pytest.mark.parametrize(
    "told, said",
    [
        ({"score": np.zeros(3, np.float32)}, "scores, where there are any, must have shape"),
        ({"size": (240, 320)}, r"size must be \(width, height\) or \(0, 0\), not \(240, 320\)"),
    ],
)
def test_keypoints_with_scores_or_a_size_that_cannot_be_are_found_out(told, said: str) -> None:
    real = load(Kind.LOCAL, "xfeat")

    class Wrong:
        card = real.card

        def encode(self, rgb):
            return dataclasses.replace(real.encode(rgb), **told)

    with pytest.raises(NonConformanceError, match=said):
        check(Kind.LOCAL, Wrong())
