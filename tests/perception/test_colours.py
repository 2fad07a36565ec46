"""Colour words for pixels: what people call colours, in light and shade."""

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.colours import COLOURS, SHADES, ColourWords
from avlmaps.recordings.types import Frame

ENCODER = ColourWords()


def frame_of(rgb: np.ndarray) -> Frame:
    height, width = rgb.shape[:2]
    camera = Pinhole(50.0, 50.0, width / 2, height / 2, width, height)
    depth = np.ones((height, width), np.float32)
    return Frame(0, "000000", 0.0, rgb, depth, np.eye(4), Rig(camera, camera))


def painted(*codes: str) -> np.ndarray:
    """Return the feature of a patch of each colour, given in hexadecimal."""
    pixels = np.array([[int(code[k : k + 2], 16) for k in (0, 2, 4)] for code in codes], np.uint8)
    rgb = np.repeat(np.repeat(pixels[None], 8, axis=0), 8, axis=1)
    return ENCODER.encode(frame_of(rgb))[0, ::2]


def named(*codes: str) -> list[str]:
    scores = painted(*codes) @ ENCODER.encode_words(COLOURS).T
    return [COLOURS[k] for k in scores.argmax(axis=1)]


@pytest.mark.parametrize(
    ("name", "codes"),
    {
        "red": ["ff0000", "b22222", "8b0000", "5a0a10"],
        "green": ["008000", "228b22", "2e8b57"],
        "blue": ["0000ff", "4169e1", "000080", "1e3c78"],
        "yellow": ["ffff00", "ffd700"],
        "orange": ["ffa500", "ff7f0e"],
        "brown": ["8b4513", "654321"],
        "beige": ["f5f5dc", "deb887"],
        "purple": ["800080", "663399"],
        "pink": ["ffc0cb", "ff69b4"],
        "turquoise": ["40e0d0", "008b8b"],
        "white": ["ffffff", "f0f0f0"],
        "grey": ["808080", "a9a9a9", "696969"],
        "black": ["000000", "141414"],
    }.items(),
)
def test_colours_are_called_what_people_call_them(name: str, codes: list[str]) -> None:
    assert named(*codes) == [name] * len(codes)


def test_a_red_front_stays_red_when_the_exposure_changes() -> None:
    rng = np.random.default_rng(0)
    for gain in (0.35, 0.6, 1.0, 1.3):
        linear = (np.array([150, 28, 38]) / 255.0) ** 2.2 * gain
        rgb = np.clip(255 * linear ** (1 / 2.2) + rng.normal(0, 4, (64, 64, 3)), 0, 255).astype(np.uint8)
        scores = ENCODER.encode(frame_of(rgb)).reshape(-1, ENCODER.card.dim) @ ENCODER.encode_words(COLOURS).T
        assert np.mean(scores.argmax(axis=1) == COLOURS.index("red")) > 0.98


def test_dark_and_light_are_told_apart() -> None:
    asked = ENCODER.encode_words(["dark blue", "blue", "light blue"])
    scores = painted("10205a", "3264c8", "a0c4f4") @ asked.T
    assert scores[0].argmax() == 0
    assert scores[2].argmax() == 2


@pytest.mark.parametrize(
    ("phrase", "understood", "terms"),
    [
        ("red cabinet", "red", {"red"}),
        ("the Crimson cabinet", "crimson", {"red"}),
        ("a dark-red chair", "dark red", {"red", "dark"}),
        ("navy blue sofa", "navy blue", {"blue", "dark"}),
        ("light grey wall", "light grey", {"grey", "light"}),
        ("gray door", "gray", {"grey"}),
        ("black and white chair", "black white", {"black", "white"}),
        ("reddish box", "reddish", {"red"}),
        ("purplish rug", "purplish", {"purple"}),
        ("bluish rug", "bluish", {"blue"}),
        ("bright yellow sign", "bright yellow", {"yellow"}),
        ("chair", "", set()),
        ("a dark corner", "", set()),
        ("other", "", set()),
        ("coloured", "", set()),
        ("", "", set()),
    ],
)
def test_a_phrase_is_read_for_its_colour(phrase: str, understood: str, terms: set[str]) -> None:
    assert ENCODER.understood(phrase) == understood
    feature = ENCODER.encode_words([phrase])[0]
    assert {(COLOURS + SHADES)[k] for k in np.flatnonzero(feature)} == terms
    assert np.linalg.norm(feature) == pytest.approx(1.0 if terms else 0.0)


def test_the_kitchens_cabinets_are_red(shared_data) -> None:
    import cv2

    picture = cv2.imread(str(shared_data / "data/redkitchen/frame-000100.color.jpg"))[..., ::-1]
    scores = ENCODER.encode(frame_of(np.ascontiguousarray(picture))) @ ENCODER.encode_words(COLOURS).T
    name = scores.argmax(axis=-1)
    assert np.mean(name[30:48, 55:90] == COLOURS.index("red")) > 0.9  # fronts
    assert np.mean(name[100:117, 25:70] == COLOURS.index("red")) < 0.1  # floor
