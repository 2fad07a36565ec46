"""Every registered backend holds to its protocol, and the suite itself can fail."""

import dataclasses

import numpy as np
import pytest

from avlmaps.core.registry import Backend, Kind, backends, load
from avlmaps.perception.conformance import NonConformanceError, check

OURS = [backend for backend in backends() if backend.target.startswith("avlmaps.")]


@pytest.mark.parametrize("backend", OURS, ids=lambda b: f"{b.kind}-{b.name}")
def test_every_backend_that_is_here_conforms(backend: Backend) -> None:
    if backend.missing:
        pytest.skip(f"needs {', '.join(backend.missing)}")
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
    with pytest.raises(NonConformanceError, match="lacks a member of SoundEncoder"):
        check(Kind.SOUNDS, object())
