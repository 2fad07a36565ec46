"""Sounds in the space of CLIP ViT-B/32 by Wav2CLIP, which the paper compares with (Wu et al., ICASSP 2022).

Expected is ``Wav2CLIP.pt`` (47 MB, MIT) from the release v0.1.0-alpha of
https://github.com/descriptinc/lyrebird-wav2clip, and for words ``openai/clip-vit-base-patch32`` (605 MB, MIT), whose
features of pictures it learnt to imitate (arXiv 2110.11499). Features have 512 numbers. A sound goes in as 16 kHz mono,
whole: the logarithm of its power spectrum, brought to mean 0 and deviation 1, through a ResNet-18 and two linear
layers. The published code takes mean and deviation over a batch; here each window is alone, so that its feature does
not depend on its company. Sounds above ten seconds, the length of those that it learnt from, are cut into windows of
ten seconds, the last one at the end.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32
from torch import nn
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.perception.models.checksums import checksum_of, weights_in
from avlmaps.perception.models.names import public_name
from avlmaps.perception.models.sound_scores import OTHERS
from avlmaps.perception.models.sound_windows import usable_samples, windows
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.device import inference, select_device, unit_rows
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.published import load_strictly, published_file, read_tensors
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_sounds import ContrastSounds

RATE_HZ = 16_000
WORDS = "openai/clip-vit-base-patch32"
PROMPT = "{}"
# The two parts that hear, less a classifier. The published loader looks at nothing else, so that what training needed
# beside them (the pictures' side, the losses' scales) may be in the file or not.
_HEARING, _CLASSIFIER = ("audio_encoder.", "audio_transform."), "audio_encoder.fc."
_LONGEST_SAMPLES = 10 * RATE_HZ
_HOP_SAMPLES = 353
_LEAST_POWER = 1e-7
_BLOCKS = (2, 2, 2, 2)
_HOW_TO_GET = "curl -LO https://github.com/descriptinc/lyrebird-wav2clip/releases/download/v0.1.0-alpha/Wav2CLIP.pt"
_MOST_TOKENS = 77


class _Spectrogram(nn.Module):
    """Power of each frequency; frames are centred, the ends mirrored."""

    window: torch.Tensor

    def __init__(self, length: int) -> None:
        super().__init__()
        self.register_buffer("window", torch.zeros(length))

    def forward(self, samples: torch.Tensor) -> torch.Tensor:
        """Return (n, 1, length / 2 + 1, frames) of (n, samples)."""
        length = len(self.window)
        spectrum = torch.stft(
            samples,
            length,
            _HOP_SAMPLES,
            window=self.window,
            center=True,
            pad_mode="reflect",
            normalized=False,
            onesided=True,
            return_complex=True,
        )
        return spectrum.abs().square()[:, None]


class _Block(nn.Module):
    """Two convolutions beside the identity, as in ResNet-18."""

    def __init__(self, channels: int, out_channels: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(channels, out_channels, 3, stride, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(out_channels)
        self.conv2 = nn.Conv2d(out_channels, out_channels, 3, 1, 1, bias=False)
        self.bn2 = nn.BatchNorm2d(out_channels)
        self.downsample = None
        if stride != 1 or channels != out_channels:
            self.downsample = nn.Sequential(
                nn.Conv2d(channels, out_channels, 1, stride, bias=False), nn.BatchNorm2d(out_channels)
            )

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        y = functional.relu(self.bn1(self.conv1(x)))
        y = self.bn2(self.conv2(y))
        return functional.relu(y + (x if self.downsample is None else self.downsample(x)))


class _Encoder(nn.Module):
    """ResNet-18 over one channel, without its classifier."""

    def __init__(self, frame: int, stem: int) -> None:
        super().__init__()
        self.spectrogram = _Spectrogram(frame)
        self.conv1 = nn.Conv2d(1, stem, 7, 2, 3, bias=False)
        self.bn1 = nn.BatchNorm2d(stem)
        widths = [stem, *(stem << stage for stage in range(4))]
        self.layer1, self.layer2, self.layer3, self.layer4 = (
            nn.Sequential(
                _Block(channels, out, 1 if stage == 0 else 2), *(_Block(out, out, 1) for _ in range(count - 1))
            )
            for stage, ((channels, out), count) in enumerate(zip(pairwise(widths), _BLOCKS, strict=True))
        )

    def forward(self, spectrum: torch.Tensor) -> torch.Tensor:
        """Return (n, 8·stem) of normalised spectra."""
        x = functional.relu(self.bn1(self.conv1(spectrum)))
        x = functional.max_pool2d(x, 3, 2, 1)
        x = self.layer4(self.layer3(self.layer2(self.layer1(x))))
        return functional.adaptive_avg_pool2d(x, 1).flatten(1)


class _Transform(nn.Module):
    """From what was heard to CLIP's space."""

    def __init__(self, width: int) -> None:
        super().__init__()
        # the place between is that of a dropout, which does nothing here
        self.sequential = nn.Sequential(nn.Linear(width, width), nn.ReLU(), nn.Identity(), nn.Linear(width, width))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.sequential(x)


class Wav2ClipNetwork(nn.Module):
    """The two parts of the published checkpoint that hear; sizes are read off it: frames of 512, 64 channels first."""

    def __init__(self, frame: int = 512, stem: int = 64) -> None:
        super().__init__()
        self.audio_encoder = _Encoder(frame, stem)
        self.audio_transform = _Transform(8 * stem)
        self.frame, self.dim = frame, 8 * stem

    @classmethod
    def like(cls, state: Mapping[str, torch.Tensor]) -> "Wav2ClipNetwork":
        """Return a network of a checkpoint's sizes, or raise ``KeyError`` where it has no such parts."""
        return cls(len(state["audio_encoder.spectrogram.window"]), len(state["audio_encoder.conv1.weight"]))

    def spectrum(self, samples: torch.Tensor) -> torch.Tensor:
        """Return the normalised logarithm of a sound's power spectrum, of (1, samples)."""
        power = torch.log(self.audio_encoder.spectrogram(samples) + _LEAST_POWER)
        return (power - power.mean()) / (power.std() + 1e-9)

    def forward(self, spectrum: torch.Tensor) -> torch.Tensor:
        """Return (1, dim) of a normalised spectrum."""
        return self.audio_transform(self.audio_encoder(spectrum))


class Wav2ClipSounds(ContrastSounds):
    """A feature for each sound, or for each ten seconds of a longer one, in the space of CLIP ViT-B/32.

    It stands for the picture of what makes the sound; words and the scale of the cosines are CLIP's own.

    Args:
        model: name of the published file, or a path.

    Raises:
        BackendError: the file or CLIP is not here, or is of another model.
    """

    def __init__(self, model: str = "Wav2CLIP.pt") -> None:
        name = public_name(model)
        path = published_file(model, _HOW_TO_GET, cached=(f"checkpoints/{name}",))
        device = select_device()
        self._network = _loaded(path).eval().to(device)
        dim = self._network.dim
        folder = self._load_words(dim, device)
        card = ModelCard(
            id=name,
            dim=dim,
            licence="MIT",
            checksum=checksum_of([path, *weights_in(folder)], f"{RATE_HZ} Hz, {_LONGEST_SAMPLES} samples", PROMPT),
            prompts=(PROMPT,),
            note=(
                "the paper's baseline: it learnt from pictures of what sounds, never from words; a yes means likelier "
                "than all of the everyday sounds that it is compared with, which was not fitted to recordings"
            ),
        )
        super().__init__(card, float(self._clip.logit_scale.detach().exp()), (*OTHERS, "other"))

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window: one for a sound of up to ten seconds.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        samples = usable_samples(sound, RATE_HZ)
        # a sound too short to be mirrored around half a frame; the published code fails there
        samples = np.pad(samples, (0, max(0, self._network.frame // 2 + 1 - len(samples))))
        return np.concatenate(
            [self._encode_window(part) for part in windows(samples, _LONGEST_SAMPLES, _LONGEST_SAMPLES)]
        )

    def _read(self, texts: Sequence[str]) -> torch.Tensor:
        return text_features(self._clip, self._tokenizer, texts, _MOST_TOKENS)

    def _encode_window(self, samples: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "1 d"]:
        with inference():
            spectrum = self._network.spectrum(torch.from_numpy(samples)[None].to(self._device))
        with mixed_precision(self._device):
            return unit_rows(self._network(spectrum))

    def _load_words(self, dim: int, device: torch.device) -> Path:
        from transformers import CLIPModel, CLIPTokenizer

        folder = pretrained_folder(WORDS)
        self._clip: Any = load_pretrained(CLIPModel, folder, WORDS, torch.device("cpu"), torch.float32)
        self._tokenizer = load_helper(CLIPTokenizer, folder, WORDS)
        if self._clip.config.projection_dim != dim:
            raise BackendError(
                f"{folder} has features of {self._clip.config.projection_dim} numbers, Wav2CLIP of {dim}; get the "
                f"right one with: hf download {WORDS}"
            )
        del self._clip.vision_model, self._clip.visual_projection  # nothing is looked at here
        self._clip.to(device)
        return folder


def _loaded(path: Path) -> Wav2ClipNetwork:
    """Return the network with the weights of a file.

    Raises:
        BackendError: the file is of another model.
    """
    state = read_tensors(path, _HOW_TO_GET)
    needed = {
        name: value for name, value in state.items() if name.startswith(_HEARING) and not name.startswith(_CLASSIFIER)
    }
    try:
        network = Wav2ClipNetwork.like(needed)
    except (KeyError, TypeError) as fault:
        raise BackendError(
            f"{path} is not a checkpoint of Wav2CLIP ({type(fault).__name__}: {fault}); get the published one with: "
            f"{_HOW_TO_GET}"
        ) from fault
    load_strictly(network, needed, path, _HOW_TO_GET)
    return network
