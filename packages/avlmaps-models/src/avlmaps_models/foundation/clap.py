"""Sounds and words in one space by CLAP (Wu et al., ICASSP 2023, arXiv 2211.06687; published code: LAION-AI/CLAP).

Any CLAP that transformers runs (``ClapModel``): ``laion/larger_clap_general`` (194 million weights, speech and music,
too), ``laion/clap-htsat-unfused`` and ``laion/clap-htsat-fused`` (154 million, everyday sounds), all Apache-2.0, 512
numbers a feature. A sound goes in as 48 kHz mono, ten seconds at a time, as a spectrogram of 64 mel bands that the
checkpoint's own settings describe; a shorter one is repeated and filled with silence (``repeatpad``), as published.

Where published code meets a longer sound it takes ten seconds of it at random, so that one file has many features, and
what it left out is lost. Here a longer sound is cut into windows of ten seconds, one every five seconds, the last at
its end; each has a feature. The fused variant knows a second way, four crops of a long sound at once, which is for such
sounds alone: windows go its first way, as short sounds went in its training (published code sends one of a batch, drawn
at random, the second way).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32

from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_batch, select_device, unit_rows
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.sound_windows import by_portions, usable_samples, windows
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_sounds import ContrastSounds

PROMPT = "This is a sound of {}"
_MOST_TOKENS = 77
_WINDOWS_ON_GPU = 16
_SHARED = 0.5  # of a window, with the next one
# settings of the spectrogram that a feature depends on
_SHAPING = (
    "sampling_rate", "nb_max_samples", "fft_window_size", "hop_length", "feature_size", "frequency_min",
    "frequency_max", "padding", "top_db",
)  # fmt: skip


class ClapSounds(ContrastSounds):
    """A feature for each ten seconds of a sound, in the space of CLAP's text encoder.

    Args:
        model: hub id or folder.
    """

    def __init__(self, model: str = "laion/larger_clap_general") -> None:
        from transformers import AutoTokenizer, ClapFeatureExtractor, ClapModel

        folder = pretrained_folder(model)
        self._model: Any = load_pretrained(ClapModel, folder, model, select_device(), torch.float32)
        self._tokenizer = load_helper(AutoTokenizer, folder, model)
        self._spectrogram = load_helper(ClapFeatureExtractor, folder, model)
        self._rate_hz = int(self._spectrogram.sampling_rate)
        self._window = int(self._spectrogram.nb_max_samples)
        # a fused network expects four spectrograms of a window and another mel scale, against the settings
        self._truncation = "fusion" if self._model.config.audio_config.enable_fusion else "rand_trunc"
        described = [f"{name} {getattr(self._spectrogram, name)}" for name in _SHAPING]
        card = ModelCard(
            id=public_name(model),
            dim=int(self._model.config.projection_dim),
            licence="Apache-2.0",
            checksum=checksum_of(weights_in(folder), *described, f"shared {_SHARED}", PROMPT),
            prompts=(PROMPT,),
            note=(
                "any phrase is understood; a yes means likelier than all of the everyday sounds that it is compared "
                "with, which was not fitted to recordings"
            ),
        )
        super().__init__(card, float(self._model.logit_scale_a.detach().exp()))

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of ten seconds, one every five seconds.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        pieces = windows(usable_samples(sound, self._rate_hz), self._window, round(self._window * (1.0 - _SHARED)))
        return by_portions(pieces, max(1, select_batch(_WINDOWS_ON_GPU)), self.card.dim, self._encode_windows)

    def _read(self, texts: Sequence[str]) -> torch.Tensor:
        return text_features(self._model, self._tokenizer, texts, _MOST_TOKENS)

    def _encode_windows(self, pieces: Sequence[Float32[np.ndarray, " n"]]) -> Float32[np.ndarray, "b d"]:
        heard = self._spectrogram(
            list(pieces), truncation=self._truncation, sampling_rate=self._rate_hz, return_tensors="pt"
        )
        mels = heard["input_features"].to(self._device, torch.float32)
        second_way = torch.zeros((len(pieces), 1), dtype=torch.bool, device=self._device)
        with mixed_precision(self._device):
            found = self._model.get_audio_features(input_features=mels, is_longer=second_way)
        return unit_rows(found.pooler_output)
