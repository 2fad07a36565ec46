"""Encoders of one's own that write into what they are given, or say the same of everything."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Places, Walk, Words, _card
from msgspec import structs

from avlmaps.core.errors import BackendError
from avlmaps.maps.build import build_map
from avlmaps.maps.finish import feature_doubts
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.perceived import given_features
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame

WALK = Walk(4)


class Writing(Words):
    """Blackens all that it is given."""

    def encode(self, frame: Frame) -> np.ndarray:
        made = super().encode(frame)
        frame.rgb[:], frame.depth_m[:], frame.world_from_camera[:] = 0, 0.0, 0.0
        return made


class WritingCorners(Corners):
    """Blackens the picture."""

    def encode(self, rgb: np.ndarray) -> Any:
        found = super().encode(rgb)
        rgb[:] = 0
        return found


class Constant(Words):
    """Says the same of everything."""

    def __init__(self, said: float) -> None:
        self.said = np.float32([said, 0.0, 0.0, 0.0])

    def encode(self, frame: Frame) -> np.ndarray:
        return np.tile(self.said, (*frame.rgb[::4, ::4].shape[:2], 1))


class ConstantViews:
    """Says the same of every picture."""

    card = _card("views", 3)

    def encode(self, frames: list[Frame]) -> np.ndarray:
        return np.tile(np.float32([0.6, 0.8, 0.0]), (len(frames), 1))

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.tile(np.float32([0.6, 0.8, 0.0]), (len(words), 1))


def made(pixels: Any = None, features: Any = None, **others: Any) -> Any:
    mapper = Mapper(SETTINGS, Encoders("fake", pixels=pixels, **others), WALK.up_in_world)
    for frame in WALK.frames():
        mapper.add(frame, None if features is None else given_features(features(frame), mapper.dim, frame))
    return mapper.snapshot()


def require_same_voxels(one: Any, other: Any) -> None:
    for name in ("index", "feature", "weight", "rgb"):
        np.testing.assert_array_equal(getattr(one.voxels, name), getattr(other.voxels, name), err_msg=name)


def test_what_an_encoder_writes_into_changes_nothing(tmp_path: Path) -> None:
    careless = {"pixels": Writing(), "local": WritingCorners(), "place": Places()}
    careful = {"pixels": Words(), "local": Corners(), "place": Places()}
    one, other = (made(**used) for used in (careless, careful))
    require_same_voxels(one, other)
    assert bytes(one.keyframes.thumbnails) == bytes(other.keyframes.thumbnails)
    built = [
        build_map(WALK, tmp_path / name, Encoders("fake", **used), SETTINGS, progress=False)
        for name, used in (("careless", careless), ("careful", careful))
    ]
    require_same_voxels(*built)


class LongViews(ConstantViews):
    """Says what is longer than one."""

    def encode(self, frames: list[Frame]) -> np.ndarray:
        return 3.0 * super().encode(frames)


@pytest.mark.parametrize("given", [{"pixels": Constant(0.5)}, {"views": LongViews()}])
def test_features_without_unit_length_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(BackendError, match=r"length (0\.5|3) .*divide it by its length"):
        made(**given)


@pytest.mark.parametrize(("said", "word"), [(0.0, "zero"), (1.0, "the same")])
def test_pixels_that_say_the_same_everywhere_are_a_doubt(said: float, word: str) -> None:
    (doubt,) = (one for one in made(Constant(said)).info.doubts if "features" in one)
    assert f"features of pixels by fake/pixels are {word} in all" in doubt
    (doubt,) = (one for one in made(features=Constant(said).encode).info.doubts if "features" in one)
    assert f"are {word} in all" in doubt
    assert not [one for one in made(Words()).info.doubts if "features" in one]


def test_views_and_sounds_that_are_all_the_same_are_a_doubt() -> None:
    stored = made(Words(), views=ConstantViews())
    voxels, keyframes, sounds = stored.voxels, stored.keyframes, stored.sounds
    assert not list(feature_doubts(voxels, keyframes, sounds, stored.info.models))  # of two keyframes nothing is known
    models = {**stored.info.models, "sounds": structs.replace(stored.info.models["views"], id="fake/ears")}
    same = np.tile(np.float32([0.6, 0.8, 0.0]), (9, 1))
    alike = voxels, replace(keyframes, view=same, world_from_camera=WALK.world_from_camera), sounds
    alike = *alike[:2], replace(sounds, feature=same), models
    views, sounds = feature_doubts(*alike)
    assert "views by fake/views are the same in all 9 keyframes" in views
    assert "sounds by fake/ears are the same in all 9 stretches" in sounds
    same[4, 0] = 0.5
    assert not list(feature_doubts(*alike))


def test_the_end_of_a_mapper_map_doubts_features_and_a_silent_microphone() -> None:
    mapper = Mapper(SETTINGS, Encoders("fake", pixels=Constant(1.0)), WALK.up_in_world, behind=True)
    for frame in WALK.frames():
        mapper.add(frame)
        mapper.add_sound(Sound(np.zeros(1600, np.float32), 16_000))
    mapper.snapshot()
    assert not mapper.doubts
    mapper.finish()
    silent, features = mapper.doubts
    assert silent.startswith("The sound is silent throughout: every sample is 0. Check the microphone")
    assert features.startswith("The features of pixels by fake/pixels are the same")


def test_a_camera_that_stood_has_one_view() -> None:
    stored = made(Words(), views=ConstantViews())
    for said, count in ((0.6, 0), (0.0, 1)):
        view = np.full((9, 3), said, np.float32)
        pose = np.repeat(np.asarray(stored.keyframes.world_from_camera)[:1], 9, axis=0)
        stood = replace(stored.keyframes, view=view, world_from_camera=pose)
        assert len(list(feature_doubts(stored.voxels, stood, stored.sounds, stored.info.models))) == count
