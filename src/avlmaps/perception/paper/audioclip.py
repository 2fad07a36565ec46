"""Sounds and words in one space by AudioCLIP, the paper's sound model (Guzhov et al., ICASSP 2022, arXiv 2106.13043).

Expected is ``AudioCLIP-Partial-Training.pt`` (537 MB, MIT; the paper's) or ``AudioCLIP-Full-Training.pt``, from the
release v0.1 of https://github.com/AndreyGuzhov/AudioCLIP, and CLIP's list of byte pairs (``clip_tokens``). Features
have 1,024 numbers. A sound goes in as 44.1 kHz mono in units of 16-bit samples, five seconds at a time, a shorter one
filled up with silence behind it: so the published system (AVLMaps) does it, which keeps the first five seconds of a
sound and forgets the rest. Here a longer sound is encoded whole, one feature every five seconds, the last one at its
end. Words go in bare, as there.

The network is in ``audioclip_network`` and ``fbsp``; in evaluation, as the paper's code runs it (the demonstration
published with AudioCLIP leaves it in training, where a sound's feature depends on those beside it).
"""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32

from avlmaps.core.errors import BackendError
from avlmaps.perception.foundation.clap import check_samples
from avlmaps.perception.foundation.sound_scores import OTHERS, Contrast
from avlmaps.perception.models.checksums import checksum_of
from avlmaps.perception.models.device import chosen_batch, chosen_device, inference, unit_rows
from avlmaps.perception.models.names import public_name
from avlmaps.perception.models.precision import mixed_precision
from avlmaps.perception.models.published import load_strictly, published_file, read_tensors
from avlmaps.perception.paper.audioclip_network import NOT_NEEDED, AudioClipNetwork, SoundSizes
from avlmaps.perception.paper.clip_text import ClipTextSizes, padded
from avlmaps.perception.paper.clip_tokens import clip_tokens
from avlmaps.perception.paper.fbsp import HOP_SAMPLES, RATE_HZ, FrontEnd
from avlmaps.perception.paper.sound_windows import windows
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.resample import resampled

PROMPT = "{}"
WINDOW_SAMPLES = 5 * RATE_HZ
_FULL_SCALE = np.float32(32768.0)
_RELEASE = "https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1"
_NO_BIAS = "audio.fbsp.bias"  # the published class keeps an empty tensor for the bias that it does not have
_WINDOWS_ON_GPU = 16
_WORDS_AT_ONCE = 64


class AudioClipSounds:
    """A feature for each five seconds of a sound, in the space of the text tower that AudioCLIP learnt with.

    Args:
        model: name of the published file, or a path.

    Raises:
        BackendError: the file is not here, or is of another model.
    """

    vocabulary: tuple[str, ...] = ()

    def __init__(self, model: str = "AudioCLIP-Partial-Training.pt") -> None:
        name = public_name(model)
        how_to_get = f"curl -LO {_RELEASE}/{name}"
        path = published_file(model, how_to_get, cached=(f"checkpoints/{name}",))
        network = _loaded(path, how_to_get)
        self._tokens = clip_tokens()
        if network.sizes.tokens != len(self._tokens):
            raise BackendError(
                f"{path} was made with {network.sizes.tokens} tokens, CLIP's list of byte pairs has "
                f"{len(self._tokens)}; get the published file with: {how_to_get}"
            )
        self._device = chosen_device()
        self._network = network.eval().to(self._device)
        self._front_end = FrontEnd.of(network.audio.fbsp, network.audio.window, self._device)
        self.card = ModelCard(
            id=name,
            dim=network.sizes.dim,
            licence="MIT",
            checksum=checksum_of([path], f"{RATE_HZ} Hz, {WINDOW_SAMPLES} samples, hop {HOP_SAMPLES}", PROMPT),
            prompts=(PROMPT,),
            note=(
                "any phrase is understood, best as a bare label (dog, car horn); a yes means likelier than all of the "
                "everyday sounds that it is compared with, which was not fitted to recordings"
            ),
        )

    @property
    def logit_scale(self) -> float:
        """By how much the cosine of a sound and a phrase counts in a softmax, between 1 and 100."""
        return self._network.scale

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of five seconds.

        Raises:
            AudioError: the sound has no samples, or some that are no finite numbers.
        """
        check_samples(sound)
        heard = windows(resampled(sound, RATE_HZ).samples, WINDOW_SAMPLES)
        size = chosen_batch(_WINDOWS_ON_GPU)
        return np.concatenate([self._encode_windows(heard[at : at + size]) for at in range(0, len(heard), size)])

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, as the name of a sound."""
        texts = self._tokens.encode([PROMPT.replace("{}", word) for word in words], self._network.sizes.context)
        parts = [np.zeros((0, self.card.dim), np.float32)]
        for at in range(0, len(texts), _WORDS_AT_ONCE):
            tokens = padded(texts[at : at + _WORDS_AT_ONCE]).to(self._device)
            with mixed_precision(self._device):
                parts.append(unit_rows(self._network(tokens)))
        return np.concatenate(parts)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound holds what each phrase names, at the published scale of the cosines.

        Each phrase competes with a list of everyday sounds and with "other" (``sound_scores.Contrast``), not with those
        asked beside it. The published system stretches the cosines over a map's sounds, so that one of them always
        fits; ``SoundSettings.normalise`` does that to these scores.
        """
        return self._contrast.words(sounds, self.encode_words(words))

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the asked one (``sound_scores.Contrast``)."""
        return self._contrast.alike(sounds, asked)

    @cached_property
    def _contrast(self) -> Contrast:
        return Contrast(self.encode_words((*OTHERS, "other")), self.logit_scale)

    def _encode_windows(self, heard: Sequence[Float32[np.ndarray, " n"]]) -> Float32[np.ndarray, "b d"]:
        with inference():
            decibels = self._front_end(torch.from_numpy(_FULL_SCALE * np.stack(heard)).to(self._device))
        with mixed_precision(self._device):
            return unit_rows(self._network.audio(decibels))


def _loaded(path: Path, how_to_get: str) -> AudioClipNetwork:
    """Return the network with the weights of a file.

    Raises:
        BackendError: the file is of another model.
    """
    state = read_tensors(path, how_to_get)
    if _NO_BIAS in state and not state[_NO_BIAS].numel():
        state.pop(_NO_BIAS)
    try:
        network = AudioClipNetwork(ClipTextSizes.of(state), SoundSizes.of(state))
    except (KeyError, ValueError, IndexError, TypeError) as fault:
        raise BackendError(
            f"{path} is not a checkpoint of AudioCLIP ({type(fault).__name__}: {fault}); get the published one with: "
            f"{how_to_get}"
        ) from fault
    load_strictly(network, state, path, how_to_get, not_needed=NOT_NEEDED)
    return network
