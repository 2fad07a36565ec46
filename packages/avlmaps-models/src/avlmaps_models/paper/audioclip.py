"""Sounds and words in one space by AudioCLIP, the paper's sound model (Guzhov et al., ICASSP 2022, arXiv 2106.13043).

Expected is ``AudioCLIP-Partial-Training.pt`` (537 MB, MIT; the paper's) or ``AudioCLIP-Full-Training.pt``, from the
release v0.1 of https://github.com/AndreyGuzhov/AudioCLIP, and CLIP's list of byte pairs (``clip_tokens``). Features
have 1,024 numbers. A sound goes in as 44.1 kHz mono in units of 16-bit samples, five seconds at a time, a shorter one
filled up with silence behind it: so the published system (AVLMaps) does it, which uses the first five seconds of a
sound and forgets the rest. Here a longer sound is encoded whole, one feature every five seconds, the last one at its
end. Words go in bare, as there; each competes with a list of everyday sounds and with "other". The published system
stretches the cosines over a map's sounds instead, so that one of them always fits; ``SoundSettings.normalise`` does
that to these scores.

The network is in ``audioclip_network`` and ``fbsp``; in evaluation, as the paper's code runs it (the demonstration
published with AudioCLIP leaves it in training, where a sound's feature depends on those beside it).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import inference, select_batch, select_device, unit_rows
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.published import load_strictly, published_file, read_tensors
from avlmaps_models.common.sound_scores import OTHERS
from avlmaps_models.common.sound_windows import by_portions, usable_samples, windows
from avlmaps_models.foundation.open_sounds import ContrastSounds
from avlmaps_models.paper.audioclip_network import NOT_NEEDED, AudioClipNetwork, SoundSizes
from avlmaps_models.paper.clip_text import ClipTextSizes, padded
from avlmaps_models.paper.clip_tokens import clip_tokens
from avlmaps_models.paper.fbsp import HOP_SAMPLES, RATE_HZ, FrontEnd

PROMPT = "{}"
WINDOW_SAMPLES = 5 * RATE_HZ
_FULL_SCALE = np.float32(32768.0)
_RELEASE = "https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1"
_NO_BIAS = "audio.fbsp.bias"  # the published class stores an empty tensor for the bias that it does not have
_WINDOWS_ON_GPU = 16


class AudioClipSounds(ContrastSounds):
    """A feature for each five seconds of a sound, in the space of the text tower that AudioCLIP learnt with.

    Args:
        model: name of the published file, or a path.

    Raises:
        BackendError: the file is not here, or is of another model.
    """

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
        device = select_device()
        self._network = network.eval().to(device)
        self._front_end = FrontEnd.of(network.audio.fbsp, network.audio.window, device)
        card = ModelCard(
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
        super().__init__(card, network.scale, (*OTHERS, "other"))

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of five seconds.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        samples = usable_samples(sound, RATE_HZ)
        samples = np.pad(samples, (0, max(0, WINDOW_SAMPLES - len(samples))))
        heard = windows(samples, WINDOW_SAMPLES, WINDOW_SAMPLES)
        return by_portions(heard, select_batch(_WINDOWS_ON_GPU), self.card.dim, self._encode_windows)

    def _read(self, texts: Sequence[str]) -> torch.Tensor:
        return self._network(padded(self._tokens.encode(texts, self._network.sizes.context)).to(self._device))

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
