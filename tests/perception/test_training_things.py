"""Small things in the homes that the eyes learn from."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from avlmaps_sim.homes import make_home

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT.parent / "shared" / "things"
with pytest.MonkeyPatch.context() as patch:  # training is beside the package, not in it
    patch.syspath_prepend(str(ROOT))
    models, things = (import_module(f"training.pixels.{name}") for name in ("models", "things"))


@pytest.mark.skipif(not FOLDER.is_dir(), reason="no ../shared/things")
def test_things_lie_about_and_those_held_out_are_others():
    scene = make_home(3, "training")
    full = things.with_things(scene, FOLDER, np.random.default_rng(1), "training")
    added = full.objects[len(scene.objects) :]
    assert 40 < len(added) < 160
    floor, ceiling = min(a.floor_m for a in scene.areas), max(a.ceiling_m for a in scene.areas)
    assert all(floor - 0.05 < thing.low[2] and thing.high[2] < ceiling + 0.05 for thing in added)
    seen, held = (models.small_things(FOLDER, which) for which in ("training", "held-out"))
    assert len(seen["plate"]) == 11
    assert not {thing.name for thing in seen["plate"]} & {thing.name for thing in held["plate"]}
