"""Networks that the user trained: found in a folder of models, used as those that ship, refused in one sentence."""

import shutil
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import msgspec
import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check
from avlmaps.perception.embedded.pixels import open_trained, synthetic_pixels, trained_pixels, trained_views
from avlmaps.perception.embedded.scene_network import (
    DEFAULT_WEIGHTS,
    SYNTHETIC_WEIGHTS,
    Notes,
    SceneNetwork,
    checksum_of,
    load_network,
    load_pair,
)
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.recordings.types import Frame

SHIPPED = Path(str(files("avlmaps.perception.embedded") / "weights"))
CAMERA = Pinhole(150.0, 150.0, 80.0, 60.0, 160, 120)
FRAME = Frame(
    0, "0", 0.0, np.full((120, 160, 3), 128, np.uint8), np.full((120, 160), 2.0, np.float32), np.eye(4),
    Rig(CAMERA, CAMERA),
)  # fmt: skip


@pytest.fixture
def eyes(tmp_path: Path) -> Iterator[Path]:
    """The folder of trained networks, still empty, where models are looked for."""
    folder = tmp_path / "models" / "eyes"
    folder.mkdir(parents=True)
    with using_models(ModelSettings(folder=folder.parent)):
        yield folder


def bring(folder: Path, *names: str) -> None:
    """Copy networks that ship, as if they had been trained."""
    for name in names:
        for end in ("onnx", "json"):
            shutil.copy(SHIPPED / f"{name}.{end}", folder)


def rewrite(folder: Path, name: str, content: bytes | None = None, **changes: object) -> None:
    """Change a network's notes and content, with a checksum that is right."""
    weights, path = folder / f"{name}.onnx", folder / f"{name}.json"
    if content is not None:
        weights.write_bytes(content)
    notes = msgspec.structs.replace(msgspec.json.decode(path.read_bytes(), type=Notes), **changes)
    notes = msgspec.structs.replace(notes, checksum=checksum_of(weights.read_bytes(), notes))
    path.write_bytes(msgspec.json.encode(notes))


@pytest.mark.nightly
def test_both_networks_are_the_pair_and_satisfy_the_protocols(eyes: Path) -> None:
    bring(eyes, DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS)
    assert open_trained().checksum == load_pair().checksum
    check(Kind.PIXELS, trained_pixels())
    check(Kind.VIEWS, trained_views())


def test_a_first_network_looks_with_the_second_that_ships(eyes: Path) -> None:
    bring(eyes, DEFAULT_WEIGHTS)
    assert open_trained().checksum == load_pair().checksum
    rewrite(eyes, DEFAULT_WEIGHTS, temperature=load_network().notes.temperature + 0.1)
    assert open_trained().checksum != load_pair().checksum


def test_a_second_network_looks_alone(eyes: Path) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    assert isinstance(open_trained(), SceneNetwork)
    assert trained_pixels().card.checksum == synthetic_pixels().card.checksum


def test_a_file_looks_alone_wherever_it_lies(eyes: Path) -> None:
    bring(eyes, DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS)
    assert open_trained(str(eyes / f"{DEFAULT_WEIGHTS}.onnx")).checksum == load_network().checksum
    assert open_trained(str(eyes / f"{SYNTHETIC_WEIGHTS}.onnx")).checksum == load_network(SYNTHETIC_WEIGHTS).checksum


def test_the_profile_finds_them_and_says_whose_they_are(eyes: Path) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    rewrite(eyes, SYNTHETIC_WEIGHTS, id="own/pixels-1")
    cards = Encoders.named("trained").cards()
    assert (cards[Kind.PIXELS].id, cards[Kind.PIXELS].licence) == ("own/pixels-1", "your own")
    assert (cards[Kind.VIEWS].id, cards[Kind.VIEWS].licence) == ("own/views-1", "your own")
    assert cards[Kind.PIXELS].checksum == cards[Kind.VIEWS].checksum == trained_views().card.checksum


def test_they_are_looked_for_under_another_name(eyes: Path) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    eyes.rename(eyes.parent / "night")
    with pytest.raises(BackendError, match=r"The model eyes is not here \(looked in .*python -m training\.pixels"):
        load(Kind.PIXELS, "trained")
    assert load(Kind.PIXELS, "trained@night").card.checksum == synthetic_pixels().card.checksum


def test_without_a_folder_of_models_the_error_says_which_option_sets_one() -> None:
    with using_models(ModelSettings()), pytest.raises(BackendError, match=r"ModelSettings\.folder=DIR sets one"):
        open_trained("no-such-eyes")


def test_an_empty_folder_is_refused(eyes: Path) -> None:
    with pytest.raises(BackendError, match=r"holds neither scene_encoder\.onnx nor scene_encoder_synthetic\.onnx"):
        open_trained()


@pytest.mark.parametrize("content", [None, b"", b"{", b'{"id": 3}', b"\xff\xfe"])
def test_damaged_notes_are_refused(eyes: Path, content: bytes | None) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    notes = eyes / f"{SYNTHETIC_WEIGHTS}.json"
    notes.unlink() if content is None else notes.write_bytes(content)
    with pytest.raises(BackendError, match=r"weights cannot be read .* train them again with python -m training"):
        open_trained()


def test_weights_of_other_notes_are_refused_at_the_first_frame(eyes: Path) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    (eyes / f"{SYNTHETIC_WEIGHTS}.onnx").write_bytes((SHIPPED / f"{DEFAULT_WEIGHTS}.onnx").read_bytes())
    with pytest.raises(BackendError, match=r"do not belong together.*train them again"):
        open_trained().see(FRAME)


def test_what_onnxruntime_cannot_run_is_one_sentence(eyes: Path) -> None:
    bring(eyes, SYNTHETIC_WEIGHTS)
    rewrite(eyes, SYNTHETIC_WEIGHTS, b"no network", id="own/pixels-1")
    with pytest.raises(BackendError, match=r"The weights of own/pixels-1 cannot be run by onnxruntime .*update"):
        open_trained().see(FRAME)


@pytest.mark.parametrize(("beside", "which"), [((), "that ships"), ((SYNTHETIC_WEIGHTS,), "beside it")])
def test_networks_of_other_rooms_do_not_go_together(eyes: Path, beside: tuple[str, ...], which: str) -> None:
    bring(eyes, DEFAULT_WEIGHTS, *beside)
    rewrite(eyes, DEFAULT_WEIGHTS, rooms=load_network().notes.rooms[1:])
    with pytest.raises(BackendError, match=f"the second network {which} do not go together .*Give the file itself"):
        open_trained()
    assert open_trained(str(eyes / f"{DEFAULT_WEIGHTS}.onnx")).notes.rooms == load_network().notes.rooms[1:]
