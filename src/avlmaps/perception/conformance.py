"""The promises of every backend, ours and others': call ``check(kind, backend)`` in a test of your own.

Each check builds small inputs itself, needs no data and no network, and raises ``NonConformanceError`` with one
sentence that says which promise of ``avlmaps.perception.protocols`` is broken.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import AvlmapsError, NonConformanceError, hold
from avlmaps.core.registry import Kind
from avlmaps.perception import protocols
from avlmaps.perception.protocols import PROTOCOLS
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame

PHRASES = ("red chair", "dog bark", "kitchen")


def check(kind: Kind, backend: Any) -> None:
    """Hold a backend to its protocol; ``NonConformanceError`` names the promise that it breaks."""
    lacking = [name for name in protocols.members_of(PROTOCOLS[kind]) if not hasattr(backend, name)]
    hold(not lacking, f"{type(backend).__qualname__} lacks {', '.join(lacking)} of {PROTOCOLS[kind].__name__}")
    card: protocols.ModelCard = backend.card
    hold(card.id and card.licence, f"the card {card} must name a model and its licence")
    hold(card.dim >= 1, f"the card's dim is {card.dim}")
    hold(
        len(card.checksum) == 64 and set(card.checksum) <= set("0123456789abcdef"),
        f"the card's checksum must be a hex SHA-256, not {card.checksum!r}",
    )
    hold(card.prompts and all("{}" in prompt for prompt in card.prompts), "each prompt must hold {} for the word")
    _CHECKS[kind](backend)


def _check_rows(rows: np.ndarray, count: int, dim: int, what: str, zero_allowed: bool = False) -> None:
    hold(rows.dtype == np.float32, f"{what} must be float32, not {rows.dtype}")
    hold(rows.shape == (count, dim), f"{what} must have shape {(count, dim)}, not {rows.shape}")
    hold(np.isfinite(rows).all(), f"{what} must be finite")
    length = np.linalg.norm(rows, axis=-1)
    unit = np.abs(length - 1.0) < 1e-3
    hold((unit | (length == 0.0)).all() if zero_allowed else unit.all(), f"{what} must have unit length, not {length}")


def _check_words(encode: Callable[[Any], np.ndarray], dim: int, zero_allowed: bool) -> None:
    rows = encode(PHRASES)
    _check_rows(rows, len(PHRASES), dim, "word features", zero_allowed)
    alone = np.concatenate([encode((phrase,)) for phrase in PHRASES])
    hold(np.allclose(rows, alone, atol=2e-3), "a phrase's feature must not depend on what is encoded beside it")


def example_frame(seed: int = 0, width: int = 96, height: int = 64) -> Frame:
    """Return a made-up frame: blurred colour noise over a sloping floor."""
    import cv2

    rng = np.random.default_rng(seed)
    rgb = cv2.resize(rng.integers(0, 256, (8, 12, 3), np.uint8), (width, height), interpolation=cv2.INTER_CUBIC)
    depth_m = np.linspace(1.0, 4.0, height, dtype=np.float32)[::-1, None].repeat(width, axis=1).copy()
    camera = Pinhole(80.0, 80.0, width / 2, height / 2, width, height)
    return Frame(0, "example", 0.0, rgb, depth_m, np.eye(4), Rig(camera, camera))


def example_sound(seed: int = 0, seconds: float = 1.0, rate_hz: int = 16000) -> Sound:
    """Return a made-up sound: a falling tone in a little noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate_hz)) / rate_hz
    samples = 0.3 * np.sin(2 * np.pi * (900 - 300 * t) * t) * np.exp(-2 * t) + 0.01 * rng.standard_normal(len(t))
    return Sound(samples.astype(np.float32), rate_hz)


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    # The last digits of a network's output depend on where memory was allocated.
    return one.shape == other.shape and np.allclose(one, other, rtol=1e-4, atol=1e-5)


def _check_pixel_encoder(encoder: protocols.PixelEncoder) -> None:
    features = encoder.encode(example_frame())
    hold(features.ndim == 3, f"pixel features must have three axes, not {features.ndim}")
    flat = features.reshape(-1, features.shape[-1])
    _check_rows(flat, len(flat), encoder.card.dim, "pixel features", zero_allowed=True)
    hold(_equal(features, encoder.encode(example_frame())), "the same frame must give the same features")
    hold(all(isinstance(word, str) for word in encoder.vocabulary), "the vocabulary must be words")
    _check_words(encoder.encode_words, encoder.card.dim, zero_allowed=True)
    for phrase, row in zip(PHRASES, encoder.encode_words(PHRASES), strict=True):
        hold(
            bool(encoder.understood(phrase)) == bool(row.any()),
            f"understood({phrase!r}) is {encoder.understood(phrase)!r} but its feature says otherwise",
        )


def _check_view_encoder(encoder: protocols.ViewEncoder) -> None:
    frames = [example_frame(seed) for seed in range(3)]
    _check_rows(encoder.encode(frames), 3, encoder.card.dim, "view features")
    alone = np.concatenate([encoder.encode([frame]) for frame in frames])
    hold(np.allclose(encoder.encode(frames), alone, atol=2e-3), "a frame's feature must not depend on its batch")
    _check_words(encoder.encode_words, encoder.card.dim, zero_allowed=False)


def _check_sound_encoder(encoder: protocols.SoundEncoder) -> None:
    short, long = encoder.encode(example_sound()), encoder.encode(example_sound(seconds=30.0))
    _check_rows(short, len(short), encoder.card.dim, "sound features")
    _check_rows(long, len(long), encoder.card.dim, "sound features")
    hold(len(short) >= 1, "any sound must have a window")
    hold(len(long) > len(short), "a long sound must be encoded whole, by windows")
    if isinstance(encoder, protocols.FrameSoundEncoder):
        hold(
            abs(len(long) - 30.0 / encoder.hop_s - 0.5) <= 0.5 + 1e-6,
            f"30 s must have a vector for each of its steps of {encoder.hop_s} s, not {len(long)}",
        )
    hold(_equal(short, encoder.encode(example_sound())), "the same sound must give the same features")
    for bad in (np.zeros(0, np.float32), np.full(800, np.nan, np.float32)):
        try:
            encoder.encode(Sound(bad, 16000))
        except AvlmapsError:
            continue
        raise NonConformanceError("a sound without samples or with NaN must be refused by an AudioError")
    _check_words(encoder.encode_words, encoder.card.dim, zero_allowed=False)
    _check_scores(encoder.score_words([short, long], PHRASES), (2, len(PHRASES)), "score_words")
    _check_scores(encoder.score_sounds([short, long], short), (2,), "score_sounds")
    hold(encoder.score_words([], PHRASES).shape == (0, len(PHRASES)), "score_words must survive a map without sounds")


def _check_scores(scores: np.ndarray, shape: tuple[int, ...], what: str) -> None:
    hold(scores.shape == shape, f"{what} must have shape {shape}, not {scores.shape}")
    hold(((scores >= 0.0) & (scores <= 1.0)).all(), f"{what} must lie in [0, 1]")


def _example_local(encoder_dim: int, seed: int = 0, count: int = 40) -> protocols.LocalFeatures:
    rng = np.random.default_rng(seed)
    descriptors = np.abs(rng.standard_normal((count, encoder_dim))).astype(np.float32)
    descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
    xy = rng.uniform(0, 64, (count, 2)).astype(np.float32)
    score = rng.uniform(0.1, 0.9, count).astype(np.float32)
    return protocols.LocalFeatures(xy, descriptors, score, (64, 64))


def _check_local_encoder(encoder: protocols.LocalEncoder) -> None:
    frame = example_frame(width=320, height=240)
    found = encoder.encode(frame.rgb)
    _check_rows(found.descriptors, len(found.xy), encoder.card.dim, "local descriptors")
    hold(found.xy.shape == (len(found.xy), 2), f"keypoints must have shape (n, 2), not {found.xy.shape}")
    hold(((found.xy >= 0) & (found.xy <= (320, 240))).all(), "keypoints must lie in the picture")
    if len(found.score):
        _check_scores(found.score, (len(found.xy),), "keypoints' scores, where there are any,")
    hold(found.size in ((0, 0), (320, 240)), f"the picture's size must be (width, height) or (0, 0), not {found.size}")
    hold(_equal(found.xy, encoder.encode(frame.rgb).xy), "the same picture must give the same keypoints")
    blank = encoder.encode(np.full((240, 320, 3), 128, np.uint8))
    hold(blank.descriptors.shape == (0, encoder.card.dim), "a blank picture has no keypoints, and descriptors (0, d)")


def _check_place_encoder(encoder: protocols.PlaceEncoder) -> None:
    dim = 128
    local = [_example_local(dim, seed) for seed in range(4)]
    rgb = example_frame().rgb
    state = encoder.fit(local, np.random.default_rng(0))
    again = encoder.fit(local, np.random.default_rng(0))
    hold(all(_equal(state[key], again[key]) for key in state), "the same seed must learn the same")
    rows = np.stack([encoder.encode(rgb, features, state) for features in local])
    _check_rows(rows, 4, rows.shape[1], "place descriptors")
    none = protocols.LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, dim), np.float32))
    blank = encoder.encode(rgb, none, state)
    _check_rows(blank[None], 1, rows.shape[1], "the descriptor of a picture without keypoints", zero_allowed=True)
    hold(not (state and blank.any()), "what learns from keypoints must have descriptor zero where there are none")
    hold(_equal(rows[0], encoder.encode(rgb, local[0], state)), "the same picture must give the same descriptor")


def _check_matcher(matcher: protocols.Matcher) -> None:
    a, other = _example_local(matcher.card.dim, 0), _example_local(matcher.card.dim, 1, count=55)
    order = np.random.default_rng(1).permutation(len(a.xy))
    b = _taken(a, order)
    pairs = matcher.match(a, b)
    for found, count in ((pairs, len(b.xy)), (matcher.match(a, other), len(other.xy))):
        hold(found.ndim == 2 and found.shape[1] == 2, f"matches must have shape (m, 2), not {found.shape}")
        hold(np.issubdtype(found.dtype, np.integer), f"matches must be whole numbers, not {found.dtype}")
        for column, most in zip(found.T, (len(a.xy), count), strict=True):
            hold(((column >= 0) & (column < most)).all(), f"matches must be numbers of keypoints below {most}")
            hold(len(np.unique(column)) == len(column), "a keypoint may be matched at most once")
    hold(np.array_equal(pairs, matcher.match(a, b)), "the same keypoints must give the same matches")
    as_before = {(i, order[j]) for i, j in pairs.tolist()} ^ {(i, j) for i, j in matcher.match(a, a).tolist()}
    hold(len(as_before) <= 0.1 * len(pairs) + 1, "the order of a picture's keypoints must not matter")
    if not isinstance(matcher, protocols.LearnedMatcher):
        hold(len(pairs) >= len(a.xy) // 2, "a picture must match itself")
        hold(np.array_equal(order[pairs[:, 1]], pairs[:, 0]), "a picture's keypoints must match themselves")
    none = _taken(a, order[:0])
    for found in (matcher.match(a, none), matcher.match(none, a)):
        hold(found.shape == (0, 2), "matching with nothing must give no matches, shape (0, 2)")


def _taken(local: protocols.LocalFeatures, rows: np.ndarray) -> protocols.LocalFeatures:
    return replace(local, xy=local.xy[rows], descriptors=local.descriptors[rows], score=local.score[rows])


_CHECKS: dict[Kind, Callable[[Any], None]] = {
    Kind.WORDS: lambda encoder: _check_words(encoder.encode, encoder.card.dim, zero_allowed=False),
    Kind.PIXELS: _check_pixel_encoder,
    Kind.VIEWS: _check_view_encoder,
    Kind.SOUNDS: _check_sound_encoder,
    Kind.LOCAL: _check_local_encoder,
    Kind.PLACE: _check_place_encoder,
    Kind.MATCHER: _check_matcher,
}
