"""Tests of the backends on torch: tiny random checkpoints in the published layouts, no network."""

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

if find_spec("torch") is None:
    collect_ignore_glob = ["test_*.py"]  # `make test-foundation` runs them, where torch is
else:
    os.environ["HF_HUB_OFFLINE"] = "1"
    import avlmaps_models.common.device  # noqa: F401 - before transformers, see models/operators.py


@pytest.fixture(autouse=True)
def _quick_and_reproducible(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    import torch

    torch.set_num_threads(1)
    torch.manual_seed(0)
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path_factory.mktemp("home")))


@pytest.fixture
def models(tmp_path: Path) -> Iterator[Path]:
    """Return an empty folder of models that is in force for this test."""
    from avlmaps.perception.models import ModelSettings, using_models

    folder = tmp_path / "models"
    folder.mkdir()
    with using_models(ModelSettings(folder=folder, device="cpu", precision="float32", offline=True)):
        yield folder
