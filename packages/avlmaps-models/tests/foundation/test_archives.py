"""Reading checkpoints that hold other programs' objects: the weights come out, nothing else comes to life."""

import os
import shutil
import sys
from argparse import Namespace
from collections import OrderedDict
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

from avlmaps.core.errors import BackendError
from avlmaps_models.paper import archives
from avlmaps_models.paper.archives import read_weights

WEIGHTS = {"net.a": torch.arange(6.0).reshape(2, 3), "net.b": torch.ones(2, dtype=torch.float16)}


class AttributeDict(dict[str, Any]):
    """As PyTorch-Lightning keeps hyper-parameters."""


class ModelCheckpoint:
    """As PyTorch-Lightning names its callbacks: by their class."""


class Trap:
    """Runs code when it is unpickled carelessly."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self) -> tuple[Any, ...]:
        return shutil.copy, (__file__, str(self.trace))


class BlockedTrap(Trap):
    """Does it with a function that torch never reads."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self.trace),)


@pytest.fixture
def lightning(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return a module in the place of PyTorch-Lightning, there only while a file is written."""
    module = ModuleType("lightning_stand_in")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for kind in (AttributeDict, ModelCheckpoint):
        monkeypatch.setattr(kind, "__module__", module.__name__)
        monkeypatch.setattr(module, kind.__name__, kind, raising=False)
    return module


def held_beside_weights(kind: str, trace: Path) -> Any:
    held: dict[str, Any] = {
        "namespace": Namespace(backbone="clip_vitl16_384", data=Path("/data"), rates=[0.1, 0.2]),
        "attributes": AttributeDict(backbone="clip_vitl16_384", depth=0),
        "callbacks": {ModelCheckpoint: {"best_model_score": torch.tensor(0.5), "monitor": "val"}},
        "numpy": {"best": np.float64(0.5), "seen": np.arange(3)},
        "ordered": OrderedDict(a=1, b={1, 2}),
        "trap": Trap(trace),
    }
    return held[kind]


@pytest.mark.parametrize("kind", ["namespace", "attributes", "callbacks", "numpy", "ordered", "trap"])
def test_weights_are_read_beside_objects_of_other_programs(
    tmp_path: Path, lightning: ModuleType, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    trace = tmp_path / "trace"
    torch.save({"state_dict": WEIGHTS, "hyper_parameters": held_beside_weights(kind, trace)}, tmp_path / "x.ckpt")
    monkeypatch.delitem(sys.modules, lightning.__name__)
    before = set(torch.serialization.get_safe_globals())
    found = read_weights(tmp_path / "x.ckpt", "get it", "net.")
    assert found.keys() == {"a", "b"}
    assert torch.equal(found["a"], WEIGHTS["net.a"])
    assert found["b"].dtype == torch.float16
    assert not trace.exists()
    assert set(torch.serialization.get_safe_globals()) == before


def test_what_reaches_for_the_system_is_refused(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    torch.save({"state_dict": WEIGHTS, "hyper_parameters": BlockedTrap(trace)}, tmp_path / "x.ckpt")
    with pytest.raises(BackendError, match="cannot be read as a checkpoint"):
        read_weights(tmp_path / "x.ckpt", "get it")
    assert not trace.exists()


def test_a_prefix_is_taken_off_only_where_all_have_it(tmp_path: Path) -> None:
    torch.save({"net.a": torch.ones(1), "b": torch.ones(1)}, tmp_path / "x.pt")
    assert read_weights(tmp_path / "x.pt", "get it", "net.").keys() == {"net.a", "b"}


@pytest.mark.parametrize("held", [[1, 2], {}, {"state_dict": {"a": 3}}, {"a": "b"}, Namespace(a=1)])
def test_what_is_no_dictionary_of_tensors_is_refused(tmp_path: Path, held: Any) -> None:
    torch.save(held, tmp_path / "x.pt")
    with pytest.raises(BackendError, match=r"no dictionary of tensors.*get it"):
        read_weights(tmp_path / "x.pt", "get it")


def test_a_file_of_the_old_format_or_of_something_else_is_told_of(tmp_path: Path) -> None:
    torch.save(WEIGHTS, tmp_path / "old.pt", _use_new_zipfile_serialization=False)
    assert read_weights(tmp_path / "old.pt", "get it", "net.").keys() == {"a", "b"}
    (tmp_path / "page.pt").write_text("<html>Sign in</html>")
    with pytest.raises(BackendError, match="cannot be read as a checkpoint"):
        read_weights(tmp_path / "page.pt", "get it")


def test_a_scripted_archive_is_opened_only_if_it_is_a_published_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "ViT-L-14.pt"
    scripted = torch.jit.trace(torch.nn.Linear(2, 3), torch.zeros(1, 2))
    torch.jit.save(scripted, str(path))
    with pytest.raises(BackendError, match="scripted archive"):
        read_weights(path, "get it")
    known = archives.hashlib.sha256(path.read_bytes()).hexdigest()
    monkeypatch.setattr(archives, "PUBLISHED_SCRIPTS", frozenset({known}))
    assert {key: tuple(value.shape) for key, value in read_weights(path, "get it").items()} == {
        "weight": (3, 2),
        "bias": (3,),
    }
