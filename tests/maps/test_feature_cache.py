"""Features are made once: what the store keeps, what it finds, what it lets go, and maps that are the same with it."""

import inspect
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Ears, Pixels, Places, Walk, register_fakes, write_beeps
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as some
from safetensors.numpy import load_file

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.build import build_map
from avlmaps.perception.cache import CacheSettings, FeatureStore, cache_note, cached, with_cache
from avlmaps.perception.conformance import check
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.networks import key_of
from avlmaps.perception.protocols import (
    BatchPixelEncoder,
    FrameSoundEncoder,
    LocalEncoder,
    LocalFeatures,
    PlaceEncoder,
    SoundEncoder,
    ViewEncoder,
)
from avlmaps.recordings.types import Frame, Ground

register_fakes()
CARD = Pixels.card
COUNTS: dict[str, int] = {}


def _count(what: str, how_many: int = 1) -> None:
    COUNTS[what] = COUNTS.get(what, 0) + how_many


class CountedPixels(Pixels):
    def encode(self, frame: Frame) -> np.ndarray:
        _count("pixels")
        return super().encode(frame)


class CountedViews:
    card = CARD

    def encode(self, frames: Sequence[Frame]) -> np.ndarray:
        _count("views", len(frames))
        rows = np.stack([frame.rgb[:2, :2, 0].reshape(4) + 1.0 for frame in frames])
        return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.tile(np.eye(4, dtype=np.float32)[0], (len(words), 1))


class CountedCorners(Corners):
    def encode(self, rgb: np.ndarray) -> LocalFeatures:
        _count("local")
        return super().encode(rgb)


class CountedPlaces(Places):
    def encode(self, rgb: np.ndarray, local: LocalFeatures, state: dict[str, np.ndarray]) -> np.ndarray:
        _count("place")
        return super().encode(rgb, local, state)


class CountedEars(Ears):
    def encode(self, sound: object) -> np.ndarray:
        _count("sounds")
        return super().encode(sound)


MAKERS = {
    Kind.PIXELS: CountedPixels,
    Kind.VIEWS: CountedViews,
    Kind.LOCAL: CountedCorners,
    Kind.PLACE: CountedPlaces,
    Kind.SOUNDS: CountedEars,
}


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    COUNTS.clear()
    return tmp_path / "home"


def counted(name: str, *needs: str) -> Encoders:
    """Return a profile of fakes that count; ``torch`` among the needs passes them off as large models."""
    for kind, maker in MAKERS.items():
        register(Backend(kind, name, f"{__name__}:{maker.__name__}", needs=needs))
    return Encoders(name, **{kind.value: name for kind in MAKERS})


@pytest.fixture
def torch_like(monkeypatch: pytest.MonkeyPatch) -> Encoders:
    monkeypatch.setattr(Backend, "missing", property(lambda self: ()))
    return counted("counted-torch", "torch")


def array_files(path: Path) -> dict[str, bytes]:
    """Return all arrays of a map, by file."""
    return {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*.safetensors")}


# The store


@given(array=some.arrays(st.sampled_from([np.float16, np.float32]), some.array_shapes(max_dims=3, max_side=5)))
def test_what_is_kept_comes_back_bit_by_bit(tmp_path_factory: pytest.TempPathFactory, array: np.ndarray) -> None:
    store = FeatureStore(tmp_path_factory.mktemp("store"))
    assert store.get(Kind.PIXELS, CARD, "k") is None
    store.put(Kind.PIXELS, CARD, "k", {"features": array})
    kept = store.get(Kind.PIXELS, CARD, "k")
    assert kept is not None
    found = kept["features"]
    assert found.dtype == array.dtype and found.tobytes() == array.tobytes() and found.shape == array.shape
    assert store.get(Kind.VIEWS, CARD, "k") is None, "another module's"
    assert store.get(Kind.PIXELS, replace(CARD, checksum="f" * 64), "k") is None, "another model's"


def test_a_kept_file_is_safetensors_in_a_folder_named_for_its_model(tmp_path: Path) -> None:
    one = {"features": np.ones((2, 3), np.float16)}
    FeatureStore(tmp_path).put(Kind.PIXELS, replace(CARD, id="google/tips ../x"), "k", one)
    (file,) = tmp_path.rglob("*.safetensors")
    assert file.parent.name == f"pixels-google-tips-..-x-{CARD.checksum[:16]}"
    assert file.parent.parent == tmp_path
    assert np.array_equal(load_file(file)["features"], np.ones((2, 3)))


@pytest.mark.parametrize("left", [0, 4, -6])
def test_a_file_that_was_cut_counts_as_none_and_is_replaced(tmp_path: Path, left: int) -> None:
    store, kept = FeatureStore(tmp_path), {"features": np.arange(12, dtype=np.float16)}
    store.put(Kind.PIXELS, CARD, "k", kept)
    (file,) = tmp_path.rglob("*.safetensors")
    file.write_bytes(file.read_bytes()[:left])
    assert store.get(Kind.PIXELS, CARD, "k") is None
    store.put(Kind.PIXELS, CARD, "k", kept)
    assert store.get(Kind.PIXELS, CARD, "k") is not None


def test_what_was_used_longest_ago_goes_first(tmp_path: Path) -> None:
    one = {"features": np.zeros(2000, np.float16)}  # 4 kB
    earlier = FeatureStore(tmp_path, 4.5e6)
    for i in range(5):
        earlier.put(Kind.PIXELS, CARD, f"old{i}", one)
    files = {file.stem: file for file in tmp_path.rglob("*.safetensors")}
    size = files["old0"].stat().st_size
    for age, name in enumerate(["old3", "old1", "old4", "old0", "old2"]):  # old3 was used last of all
        os.utime(files[name], (time.time() - 1000 - age, time.time() - 1000 - age))
    later = FeatureStore(tmp_path, 5.5 * size)
    later._opened_s -= 10.0
    assert later.get(Kind.PIXELS, CARD, "old2") is not None  # the oldest, but used now
    later.put(Kind.PIXELS, CARD, "new", one)
    left = {file.stem for file in tmp_path.rglob("*.safetensors")}
    assert left == {"new", "old2", "old3", "old1"}, "90 % of the limit is left, the least recently used are gone"


def test_a_folder_that_cannot_be_written_is_a_note_and_no_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("no folder")
    store = FeatureStore(tmp_path / "file")
    store.put(Kind.PIXELS, CARD, "a", {"features": np.zeros(3, np.float16)})
    store.put(Kind.PIXELS, CARD, "b", {"features": np.zeros(3, np.float16)})
    assert capsys.readouterr().err.count("note: Features are not cached any longer") == 1
    assert store.get(Kind.PIXELS, CARD, "a") is None


def test_a_limit_of_nothing_is_refused() -> None:
    with pytest.raises(BackendError, match="limit is 0 GB"):
        CacheSettings(limit_gb=0)


def test_keys_tell_types_shapes_and_order_apart() -> None:
    a = np.arange(6, dtype=np.float32)
    keys = [
        key_of(a), key_of(a.reshape(2, 3)), key_of(a.astype(np.float64)), key_of(a.view(np.int32)), key_of(-a),
        key_of(a, a), key_of("1", "2"), key_of("12"), key_of("2", "1"), key_of(1, 2), key_of(None), key_of("None"),
    ]  # fmt: skip
    assert len(set(keys)) == len(keys)
    assert key_of(a[::2]) == key_of(a[::2].copy())


# What an encoder sees


def test_all_that_an_encoder_may_look_at_is_in_the_key_and_nothing_else(tmp_path: Path) -> None:
    encoder = cached(Kind.PIXELS, CountedPixels(), FeatureStore(tmp_path))

    def encodes(frame: Frame) -> bool:
        before = COUNTS.get("pixels", 0)
        encoder.encode(frame)
        return COUNTS.get("pixels", 0) > before

    frame = Walk(2).frame(0)
    ground = Ground(np.array([0.0, 0.0, 1.0]), np.array([1.0]), np.array([0.0]))
    rig = replace(frame.rig, rgb=replace(frame.rig.rgb, fx=21.0))
    moved = frame.world_from_camera.copy()
    moved[2, 3] += 0.5
    darker = frame.rgb.copy()
    darker[0, 0, 0] ^= 1
    deeper = frame.depth_m.copy()
    deeper[0, 0] += 1.0
    assert encodes(frame)
    assert not encodes(frame)
    assert not encodes(replace(frame, index=7, name="other", stamp_s=9.0))
    for other in (
        replace(frame, rgb=darker),
        replace(frame, depth_m=deeper),
        replace(frame, rig=rig),
        replace(frame, world_from_camera=moved),
        replace(frame, ground=ground),
        replace(frame, ground=replace(ground, floor_m=np.array([0.1]))),
    ):
        assert encodes(other)
        assert not encodes(other)
    with using_models(ModelSettings(precision="bfloat16")):
        assert encodes(frame), "another precision makes other features"


@pytest.mark.few(2)
@pytest.mark.parametrize("size", [(0, 0), (32, 24)])
@pytest.mark.parametrize("scored", [False, True])
@pytest.mark.parametrize("count", [0, 5])
def test_keypoints_come_back_as_they_were(tmp_path: Path, size: tuple[int, int], scored: bool, count: int) -> None:
    rng = np.random.default_rng(0)
    local = LocalFeatures(
        rng.uniform(0, 24, (count, 2)).astype(np.float32),
        rng.normal(size=(count, 8)).astype(np.float32),
        size=size,
        **({"score": rng.uniform(size=count).astype(np.float32)} if scored else {}),
    )

    class Real:
        card = Corners.card

        def encode(self, rgb: np.ndarray) -> LocalFeatures:
            _count("local")
            return local

    encoder, rgb = cached(Kind.LOCAL, Real(), FeatureStore(tmp_path)), np.zeros((24, 32, 3), np.uint8)
    first, second = encoder.encode(rgb), encoder.encode(rgb)
    assert COUNTS["local"] == 1
    for told in (first, second):
        assert told.size == size
        for name in ("xy", "descriptors", "score"):
            assert np.array_equal(getattr(told, name), getattr(local, name)), name
            assert getattr(told, name).shape == getattr(local, name).shape


def test_encoders_keep_their_protocols_whatever_way_they_are_asked(tmp_path: Path) -> None:
    used = with_cache(Encoders.named("embedded"), CacheSettings(tmp_path))
    encoders = {
        BatchPixelEncoder: used.pixels,
        ViewEncoder: used.views,
        SoundEncoder: used.sounds,
        LocalEncoder: used.local,
        PlaceEncoder: used.place,
    }
    for protocol, encoder in encoders.items():
        assert isinstance(encoder, protocol)
        for name in getattr(protocol, "__protocol_attrs__", ()) or dir(protocol):
            if not name.startswith("_"):
                inspect.getattr_static(encoder, name)  # as isinstance asks from Python 3.12 on
    assert not isinstance(used.sounds, FrameSoundEncoder)
    check(Kind.SOUNDS, used.sounds)
    check(Kind.VIEWS, used.views)
    check(Kind.PLACE, used.place)


def test_an_encoder_of_steps_stays_one(tmp_path: Path) -> None:
    class Steps:
        card, vocabulary, hop_s = CARD, (), 0.04

        def encode(self, *_: object) -> None: ...

        encode_words = score_words = score_sounds = encode

    assert isinstance(cached(Kind.SOUNDS, Steps(), FeatureStore(tmp_path)), FrameSoundEncoder)


# Whole builds


def test_a_second_build_with_another_voxel_size_encodes_nothing(
    torch_like: Encoders, tmp_path: Path, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    walk = Walk(audio=write_beeps(tmp_path / "beeps.flac"))
    build_map(walk, tmp_path / "a", torch_like, SETTINGS)
    assert set(COUNTS) == {"pixels", "views", "local", "place", "sounds"}
    assert COUNTS["pixels"] == 22
    assert (home / "cache" / "features").is_dir(), "on by default for large models"
    COUNTS.clear()
    capsys.readouterr()
    build_map(walk, tmp_path / "b", torch_like, replace(SETTINGS, voxel_size_m=0.1))
    assert COUNTS == {} and "22 from the cache" in capsys.readouterr().err


@pytest.mark.slow
def test_a_map_is_the_same_with_the_cache_and_without(torch_like: Encoders, tmp_path: Path) -> None:
    off, store = CacheSettings("off"), CacheSettings(tmp_path / "store")
    keys = {
        build_map(Walk(), tmp_path / name, torch_like, SETTINGS, cache=cache).info.build_key
        for name, cache in (("none", off), ("filling", store), ("filled", store))
    }
    assert len(keys) == 1
    assert array_files(tmp_path / "none") == array_files(tmp_path / "filling") == array_files(tmp_path / "filled")


def test_the_embedded_profile_is_left_as_it_is() -> None:
    used = Encoders.named("embedded")
    assert with_cache(used, CacheSettings()) is used
    assert cache_note(used, Kind.PIXELS) == ""
