"""A feature for every 40 ms of sound by PE-A-Frame (Perception Encoder Audio-Visual, arXiv 2512.19687; Meta).

``facebook/pe-a-frame-small`` (450 million weights), ``-base`` (560) and ``-large`` (1,400), Apache-2.0; published code:
facebookresearch/perception_models, and ``PeAudioFrameLevelModel`` of transformers. A sound goes in as 48 kHz mono,
filled to whole frames of 1,920 samples by its own reflection; its text encoder knows free descriptions ("a person
talking"), without a sentence around them.

The model learnt to say for each frame whether a description holds: with frame a and text t, both as its heads give them
and of any length, the probability is sigmoid(scale · a·t + bias). Features of unit length would lose that, so that they
are stored in homogeneous coordinates, one number longer (1,025): (a, r) for a frame, (scale · t, bias / r) for a text,
each scaled to unit length. Their product is positive just where the answer is yes, and what the model says is had back
exactly. r, a quarter of the length that its head's weights make likely, only sees to it that the last number is small.

Two things differ from calling transformers 5.23, both to stay with the published code: the text feature is taken before
the text model's last normalisation (as in perception_models, which takes the 22nd layer of 28), and not by
``get_text_audio_embeds``, which reads hidden states that it did not ask for.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Float32

from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_device, to_numpy
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.sound_scores import OTHERS, QUIET, joined, one_kind, sigmoid
from avlmaps_models.common.sound_windows import WORDS_AT_ONCE, by_portions, usable_samples
from avlmaps_models.common.texts import text_tokens

_MOST_TOKENS = 512
_PUBLISHED_THRESHOLD = 0.3  # published code takes a description to hold where its probability is above this
_CHUNK = 750  # frames that go through at once, 30 s
_CONTEXT = 50  # frames of a chunk on either side that its neighbour gives the features of
_STEADY = 5  # frames: a yes holds for 0.2 s on average, or for all of a shorter sound
_MOMENT = 25  # frames that a sound is compared with another by
_RISE = 20.0  # of the score of two moments where their cosine passes 0.5


class FrameSounds:
    """A feature for each 40 ms of a sound, in homogeneous coordinates (see the module).

    Args:
        model: hub id or folder.
    """

    vocabulary: tuple[str, ...] = ()

    def __init__(self, model: str = "facebook/pe-a-frame-base") -> None:
        from transformers import AutoTokenizer, PeAudioFeatureExtractor, PeAudioFrameLevelModel

        folder = pretrained_folder(model)
        self._device = select_device()
        self._model: Any = load_pretrained(PeAudioFrameLevelModel, folder, model, self._device, torch.float32)
        self._model.text_model.config.tie_last_hidden_states = False  # hidden_states[-1] as the last layer gives it
        self._tokenizer = load_helper(AutoTokenizer, folder, model)
        self._framed = load_helper(PeAudioFeatureExtractor, folder, model)
        self._rate_hz, self._hop = int(self._framed.sampling_rate), int(self._framed.hop_length)
        self.hop_s = self._hop / self._rate_hz
        self._space = _Space(
            r=_likely_length(self._model.audio_head) / 4.0,
            scale=float(self._model.text_audio_logit_scale.detach()),
            bias=float(self._model.text_audio_logit_bias.detach()),
        )
        self.card = ModelCard(
            id=public_name(model),
            dim=int(self._model.config.text_config.hidden_size) + 1,
            licence="Apache-2.0",
            checksum=checksum_of(
                weights_in(folder), f"pe-a-frame {self._rate_hz} {self._hop} chunk {_CHUNK} context {_CONTEXT}"
            ),
            prompts=("{}",),
            note=(
                "any description is understood; the score is the model's own probability, shifted so that its "
                "published threshold of 0.3 becomes 0.5"
            ),
        )

    def encode(self, sound: Sound) -> Float32[np.ndarray, "frames d"]:
        """Return a unit vector for each 40 ms, the last one of what is left.

        Raises:
            AudioError: the sound has no samples, or some that are not finite numbers.
        """
        samples = usable_samples(sound, self._rate_hz)
        parts = []
        for begin, end, kept in _chunks(-(-len(samples) // self._hop)):
            heard = self._framed(
                samples[begin * self._hop : end * self._hop], sampling_rate=self._rate_hz, return_tensors="pt"
            ).to(self._device)
            with mixed_precision(self._device):
                frames = self._model.get_audio_embeds(heard["input_values"], heard["padding_mask"])
            parts.append(self._space.frames(to_numpy(frames[0])[kept]))
        return np.concatenate(parts)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each description; its product with a frame's is positive where it holds."""
        return _unit(self._texts(words))

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "frames d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound holds what each phrase describes, by its likeliest fifth of a second.

        The model's own probability, with its odds raised by those of the published threshold: 0.3 becomes 0.5.
        """
        if not sounds or not words:
            return np.zeros((len(sounds), len(words)), np.float32)
        rows, starts = joined(sounds)
        logits = np.split(self._space.logits(rows, self._texts(words)), starts[1:])
        return sigmoid(np.stack([_steady(each).max(axis=0) for each in logits])).astype(np.float32)

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "frames d"]], asked: Float32[np.ndarray, "frames d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one.

        Of the queried sound that second counts which speaks most clearly for some kind of sound (a clip may begin and
        end in silence); it is compared with the second of each sound that is most like it.
        """
        moments, profiles = self._moments(asked)
        clearest = int(profiles.max(axis=1).argmax())
        scores = np.zeros(len(sounds), np.float32)
        for i, rows in enumerate(sounds):
            own, kinds = self._moments(rows)
            cosine = own @ moments[clearest]
            nearest = int(cosine.argmax())
            scores[i] = one_kind(float(cosine[nearest]), kinds[nearest], profiles[clearest], _RISE)
        return scores

    def _moments(
        self, rows: Float32[np.ndarray, "frames d"]
    ) -> tuple[Float32[np.ndarray, "moments e"], Float[np.ndarray, "moments k"]]:
        """Return the direction of each second of a sound, and how likely it is of each kind that is not a silence."""
        starts = np.arange(0, len(rows), _MOMENT)
        count = np.diff(np.append(starts, len(rows)))[:, None]
        frames = np.add.reduceat(self._space.published(rows), starts, axis=0) / count
        kinds = sigmoid(self._space.logits(self._space.frames(frames.astype(np.float32)), self._kinds))
        return _unit(frames.astype(np.float32)), kinds

    @cached_property
    def _kinds(self) -> Float32[np.ndarray, "k d"]:
        return self._texts([kind for kind in OTHERS if kind not in QUIET])

    def _texts(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return the homogeneous coordinates of descriptions, not scaled to unit length."""
        return self._space.texts(by_portions(words, WORDS_AT_ONCE, self.card.dim - 1, self._text_rows))

    def _text_rows(self, texts: Sequence[str]) -> Float32[np.ndarray, "n e"]:
        tokens = text_tokens(self._tokenizer, texts, _MOST_TOKENS, self._device)
        with mixed_precision(self._device):
            states = self._model.text_model(
                input_ids=tokens["input_ids"], attention_mask=tokens["attention_mask"], output_hidden_states=True
            ).hidden_states
            return to_numpy(self._model.text_audio_head(states[-1][:, 0]))


@dataclass(frozen=True, slots=True)
class _Space:
    """Homogeneous coordinates: what the model says is linear in them.

    Attributes:
        r: the last number of a frame before it is scaled to unit length.
        scale: the model's, of the product of frame and text.
        bias: the model's.
    """

    r: float
    scale: float
    bias: float

    def frames(self, published: Float32[np.ndarray, "n e"]) -> Float32[np.ndarray, "n d"]:
        """Return unit vectors for frames as the model's head gives them."""
        return _unit(np.concatenate([published, np.full((len(published), 1), self.r, np.float32)], axis=1))

    def published(self, rows: Float32[np.ndarray, "n d"]) -> Float[np.ndarray, "n e"]:
        """Return the frames as the model's head gave them."""
        return rows[:, :-1].astype(np.float64) * (self.r / rows[:, -1:])

    def texts(self, published: Float32[np.ndarray, "n e"]) -> Float32[np.ndarray, "n d"]:
        """Return coordinates whose product with a frame's has the sign of the answer at the published threshold."""
        bias = self.bias - np.log(_PUBLISHED_THRESHOLD / (1.0 - _PUBLISHED_THRESHOLD))
        last = np.full((len(published), 1), bias / self.r, np.float32)
        return np.concatenate([self.scale * published, last], axis=1).astype(np.float32)

    def logits(self, rows: Float32[np.ndarray, "n d"], texts: Float32[np.ndarray, "m d"]) -> Float[np.ndarray, "n m"]:
        """Return the log-odds that each text (of ``texts``, not scaled) holds in each frame, 0 at the threshold."""
        return (rows @ texts.T).astype(np.float64) * (self.r / rows[:, -1:].astype(np.float64))


def _likely_length(head: Any) -> float:
    """Return how long a head makes a vector whose normalised numbers are independent, from its weights."""
    parts = (head.layer_norm.weight, head.layer_norm.bias, head.proj.weight)
    gain, shift, weights = (part.detach().to("cpu", torch.float64) for part in parts)
    return max(1e-6, float(((weights * gain).square().sum() + (weights @ shift).square().sum()).sqrt()))


def _chunks(frames: int) -> Iterator[tuple[int, int, slice]]:
    """Yield (begin, end) of what goes through at once, frames, and which of its features count."""
    core = frames if frames <= _CHUNK else _CHUNK - 2 * _CONTEXT
    for at in range(0, frames, core):
        begin, end = max(0, at - _CONTEXT), min(frames, at + core + _CONTEXT)
        yield begin, end, slice(at - begin, min(frames, at + core) - begin)


def _steady(logits: Float[np.ndarray, "frames n"]) -> Float[np.ndarray, "_ n"]:
    """Return running means over 0.2 s; the mean of all of a shorter sound."""
    length = min(_STEADY, len(logits))
    sums = np.cumsum(np.concatenate([np.zeros((1, logits.shape[1])), logits]), axis=0)
    return (sums[length:] - sums[:-length]) / length


def _unit(rows: Float32[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    length = np.linalg.norm(rows.astype(np.float64), axis=1, keepdims=True)
    return (rows / np.maximum(length, 1e-12)).astype(np.float32)
