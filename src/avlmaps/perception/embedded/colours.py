"""Colour words for pixels: a plain stand-in for a pixel encoder, honest about what it is.

It knows thirteen basic colour terms, and dark and light; it knows nothing of things. A phrase is read for its
colour (``red`` of ``red cabinet``), the rest goes unread, and the answer says so.

A colour is compared with named examples in CIELAB, with chroma taken relative to lightness so that a red front in
the shade is still red. All 32,768 colours of five bits a channel are computed once; a picture costs a look-up.
"""

import hashlib
import re
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Float, Float32, UInt8
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.types import Frame

COLOURS = (
    "black", "grey", "white", "red", "orange", "yellow", "green",
    "turquoise", "blue", "purple", "pink", "brown", "beige",
)  # fmt: skip
SHADES = ("dark", "medium", "light")

# Examples in sRGB, as hexadecimal. Each chromatic colour is also taken at lower exposures (see ``_GAINS``).
_EXAMPLES = {
    "black": "000000 101010 202020 1a1c22 241f1c 18202a 2a2a2a 1c2030 22283a 2c2e3a 30282c",
    "grey": "484848 606060 808080 a0a0a0 b4b4b4 70757c 7c7670 8a93a0 9a9489 5a626c "
    "545049 404858 505a6a 3c4450 606c7c 788898 504c58 605860 90989c",
    "white": "ffffff f4f4f4 e6e6e6 d8dade dcd9d2 eef2f8 f8f4ec ced2d8",
    "red": "ff0000 d81820 b01020 e03030 c80028 a01c1c f02030 8c1020 e04038 "
    "c02840 701030 901838 a02848 b03050 803040 c03860 681828",
    "orange": "ff8000 ff9820 f07010 ff6a20 e88820 ffa030 e8702c",
    "yellow": "ffff00 f8e020 e8d040 fff060 d8c818 f0e080 f8d030 c8b820",
    "green": "00ff00 20a030 108040 60b040 90d060 408050 70a878 2a7030 a0e0a0 608838 88a820 507048",
    "turquoise": "00ffff 20c8c0 10a0a0 40e0d0 80d8d8 2090a0 60b8b8 b0f0e8 108888",
    "blue": "0000ff 2050d0 1040a0 4080f0 80b0f0 3060a0 60a0e0 101880 4868c0 a8c8f8 305088 486890",
    "purple": "800080 8020c0 a040d0 6030a0 b080e0 603070 9060b0 785098 c8a8e8 5a4080 7c4a8c 80487a 885080",
    "pink": "ff80c0 ffb0d0 f060a0 ff90a8 e890b0 ffc0cb d86090 ff40a0 e8a0a8 d878a8",
    "brown": "804020 603018 8a5a30 704828 a06838 503020 a87848 785840 "
    "906848 b88048 c09058 5c4030 4a3030 5c3c3a 6e4c48 8c6458",
    "beige": "f0e0c0 e0d0a8 d8c098 e8d8b8 f5f5dc d2b48c e0c8a0 c8b490 d8c8b0 dcb884",
}  # fmt: skip

# Linear-light exposures at which a colour has the same name. Dark orange is brown and dark yellow olive, so those
# are not dimmed; a dim grey is a darker grey, which has examples of its own.
_GAINS = {
    "red": (1.0, 0.5, 0.25, 0.1),
    "green": (1.0, 0.5, 0.25),
    "turquoise": (1.0, 0.5),
    "blue": (1.0, 0.5, 0.25, 0.12),
    "purple": (1.0, 0.5, 0.25),
    "brown": (1.0, 0.5),
}

# The meaning of words that are no basic term themselves.
_SYNONYMS = {
    "gray": "grey", "silver": "light grey", "charcoal": "dark grey", "steel-grey": "grey", "ebony": "black",
    "ivory": "white", "cream": "beige", "off-white": "white",
    "crimson": "red", "scarlet": "red", "ruby": "red", "cherry-red": "red", "vermilion": "red",
    "burgundy": "dark red", "maroon": "dark red", "wine-red": "dark red", "claret": "dark red",
    "amber": "orange", "tangerine": "orange", "apricot": "light orange", "coral": "light orange",
    "gold": "yellow", "golden": "yellow", "mustard": "dark yellow", "lemon-yellow": "yellow", "blond": "beige",
    "olive": "dark green", "lime": "light green", "emerald": "green", "mint": "light green", "jade": "green",
    "khaki": "beige", "teal": "dark turquoise", "cyan": "turquoise", "aqua": "turquoise", "aquamarine": "turquoise",
    "navy": "dark blue", "azure": "blue", "cobalt": "blue", "indigo": "dark blue", "ultramarine": "blue",
    "sky-blue": "light blue", "violet": "purple", "lilac": "light purple", "lavender": "light purple",
    "mauve": "light purple", "plum": "dark purple", "aubergine": "dark purple", "magenta": "pink", "fuchsia": "pink",
    "rose": "pink", "salmon": "pink", "chocolate": "dark brown", "chestnut": "brown", "bronze": "brown",
    "tan": "beige", "sand": "beige", "ochre": "brown", "rust": "brown", "auburn": "brown",
}  # fmt: skip
_SHADE_WORDS = {
    "dark": "dark", "deep": "dark", "darker": "dark", "light": "light", "pale": "light", "lighter": "light",
    "pastel": "light", "bright": "", "vivid": "", "medium": "medium",
}  # fmt: skip

# Of a colour's feature; the shade is the smaller part, so that "red" takes dark and light red alike.
_SHADE_PART = 0.6
# Softness of the memberships, in the units of ``_coordinates``.
_SOFTNESS = 7.0
_LIGHTNESS_SCALE = 0.5
_CELL = 4


def _linear(srgb: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _lab(linear: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    # CIELAB, D65
    xyz_from_rgb = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    )
    ratio = linear @ xyz_from_rgb.T / xyz_from_rgb.sum(axis=1)
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def _coordinates(lab: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    # Exposure scales lightness and chroma together, so that their ratio identifies the colour; below a lightness of 15
    # chroma is mostly noise and counts less.
    chroma = np.linalg.norm(lab[..., 1:], axis=-1, keepdims=True)
    relative = 100.0 / np.maximum(np.hypot(chroma, np.maximum(lab[..., :1], 15.0)), 1e-9)
    return np.concatenate([lab[..., :1] * _LIGHTNESS_SCALE, lab[..., 1:] * relative], axis=-1)


def _example_table() -> tuple[Float[np.ndarray, "e 3"], np.ndarray]:
    linear, colour = [], []
    for number, name in enumerate(COLOURS):
        for code in _EXAMPLES[name].split():
            rgb = _linear(np.array([int(code[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0)
            for gain in _GAINS.get(name, (1.0,)):
                linear.append(rgb * gain)
                colour.append(number)
    return _coordinates(_lab(np.array(linear))), np.array(colour)


def example_of(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of one of ``COLOURS``, 0 to 255."""
    code = _EXAMPLES[colour].split()[0]
    return int(code[:2], 16), int(code[2:4], 16), int(code[4:], 16)


def memberships(srgb: Float[np.ndarray, "n 3"]) -> Float32[np.ndarray, "n 16"]:
    """Return unit vectors of colours in [0, 1]: how much each is each basic term, then dark, medium and light."""
    lab = _lab(_linear(srgb))
    examples, colour = _example_table()
    points = _coordinates(lab)
    nearest = np.full((len(points), len(COLOURS)), np.inf)
    for example, number in zip(examples, colour, strict=True):
        squared = ((points - example) ** 2).sum(axis=1)
        np.minimum(nearest[:, number], squared, out=nearest[:, number])
    weight = np.exp(-(nearest - nearest.min(axis=1, keepdims=True)) / (2 * _SOFTNESS**2))
    weight /= np.linalg.norm(weight, axis=1, keepdims=True)
    lightness = lab[:, :1]
    shade = np.exp(-(((lightness - np.array([[20.0, 50.0, 80.0]])) / 18.0) ** 2))
    shade /= np.linalg.norm(shade, axis=1, keepdims=True)
    feature = np.concatenate([weight, _SHADE_PART * shade], axis=1)
    return (feature / np.linalg.norm(feature, axis=1, keepdims=True)).astype(np.float32)


class ColourWords:
    """A pixel encoder that knows colours and nothing else."""

    def __init__(self) -> None:
        content = repr((COLOURS, _EXAMPLES, _GAINS, _SYNONYMS, _SHADE_WORDS, _SHADE_PART, _SOFTNESS)).encode()
        self.card = ModelCard(
            id="avlmaps/colour-words-1",
            dim=len(COLOURS) + len(SHADES),
            licence="MIT",
            checksum=hashlib.sha256(content).hexdigest(),
            note="it reads the colour in a phrase and knows nothing of things",
        )

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The basic colour terms."""
        return COLOURS

    @cached_property
    def _table(self) -> Float32[np.ndarray, "32768 16"]:
        level = (np.arange(32) + 0.5) / 32
        return memberships(np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3))

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf 16"]:
        """Return a feature for each four by four pixels' mean colour."""
        import cv2

        height, width = frame.rgb.shape[:2]
        size = max(1, round(width / _CELL)), max(1, round(height / _CELL))
        return self.encode_colours(np.asarray(cv2.resize(frame.rgb, size, interpolation=cv2.INTER_AREA), np.uint8))

    def encode_colours(self, rgb: UInt8[np.ndarray, "*n 3"]) -> Float32[np.ndarray, "*n 16"]:
        """Return a feature for each colour."""
        level = rgb.astype(np.int32) >> 3
        return self._table[(level[..., 0] << 10) | (level[..., 1] << 5) | level[..., 2]]

    def without_colours(self, phrase: str) -> str:
        """Return the rest of a phrase without its words of colour."""
        left = f" {phrase.lower()} "
        for text, _, _ in _colours_in(phrase):
            for form in (text, text.replace("-", " ")):
                left = left.replace(f" {form} ", " ", 1)
        return " ".join(left.split())

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n 16"]:
        """Return unit vectors of the phrases' colours, the sum where there are several; zero for none."""
        features = np.zeros((len(words), self.card.dim), np.float32)
        for row, phrase in zip(features, words, strict=True):
            for _, colour, shade in _colours_in(phrase):
                term = np.zeros(self.card.dim)
                term[COLOURS.index(colour)] = 1.0
                if shade:
                    term[len(COLOURS) + SHADES.index(shade)] = _SHADE_PART
                row += term / np.linalg.norm(term)
            row /= max(float(np.linalg.norm(row)), 1e-9)
        return features

    def understood(self, word: str) -> str:
        """Return the words of colour in a phrase, or ``""``."""
        return " ".join(text for text, _, _ in _colours_in(word))


def _meaning(token: str) -> str:
    # The basic term (with its shade) that a word of colour stands for, "" for any other word.
    for word in (token, token.removesuffix("ish"), re.sub(r"(.)\1ish$", r"\1", token), token.removesuffix("ish") + "e"):
        if word in COLOURS:
            return word
        if word in _SYNONYMS:
            return _SYNONYMS[word]
    return ""


def _colours_in(phrase: str) -> list[tuple[str, str, str]]:
    # The words, the basic term and the shade (or "") of each colour in a phrase, in order.
    joined = phrase.lower()
    for compound in (word for word in _SYNONYMS if "-" in word):
        joined = joined.replace(compound.replace("-", " "), compound)
    found: list[tuple[str, str, str]] = []
    words: list[str] = []
    shade = ""
    for token in re.findall(r"[a-z]+(?:-[a-z]+)*", joined):
        for piece in [token] if _meaning(token) else token.split("-"):
            meaning = _meaning(piece)
            if meaning:
                own_shade, _, colour = meaning.rpartition(" ")
                if found and not words and found[-1][1:] == ("blue", "dark") and colour == "blue":
                    found[-1] = (f"{found[-1][0]} {piece}", "blue", "dark")  # navy blue is one colour
                else:
                    found.append((" ".join([*words, piece]), colour, shade or own_shade))
                words, shade = [], ""
            elif piece in _SHADE_WORDS:
                words, shade = [*words, piece], _SHADE_WORDS[piece] or shade
            else:
                words, shade = [], ""
    return found
