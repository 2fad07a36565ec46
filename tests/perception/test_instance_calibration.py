"""The calibration of instances: usual areas from the lexicon, and the bias at which enough pieces are true."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.perception.embedded.scene_network import load_network
from avlmaps_sim.homes import furnish

with pytest.MonkeyPatch.context() as patch:  # training is beside the package, not in it
    patch.syspath_prepend(str(Path(__file__).resolve().parents[2]))
    instances, borrowed = (import_module(f"training.pixels.{name}") for name in ("instances", "borrowed"))


def pieces(rng: np.random.Generator, count: int, bias: float) -> Any:
    """Return pieces that are true with the odds that the rule gives them, plus a bias."""
    one = instances.Pieces("sofa", rng.uniform(0.05, 0.95, count), rng.uniform(0.05, 4.0, count), np.zeros(count, bool))
    odds = instances.log_odds(one, instances.InstanceNotes(instances.SLOPES, area_m2={"sofa": area("sofa")})) + bias
    return instances.Pieces("sofa", one.probability, one.area_m2, rng.random(count) < 1.0 / (1.0 + np.exp(-odds)))


def area(name: str) -> float:
    entry = lexicon().find(name, EntryKind.THING)
    assert entry is not None
    found = instances.usual_area_m2(entry)
    assert found is not None
    return found


@given(seed=st.integers(0, 1000), true_bias=st.floats(-0.5, 2.0))
def test_enough_of_the_confident_pieces_are_true(seed: int, true_bias: float):
    one = pieces(np.random.default_rng(seed), 2000, true_bias)
    notes = instances.fit_instances([one], ("sofa",))
    sure = instances.log_odds(one, notes) + notes.default_bias >= 0.0
    assert one.is_true[sure].mean() >= instances.PRECISION
    more = instances.log_odds(one, notes) + notes.default_bias + 0.1001 >= 0.0
    at_end = notes.default_bias >= instances.BIASES[-1] - 0.01
    assert at_end or one.is_true[more].mean() < instances.PRECISION


def test_a_network_that_is_always_wrong_is_refused():
    one = pieces(np.random.default_rng(0), 200, 0.0)
    wrong = instances.Pieces(one.category, one.probability, one.area_m2, np.zeros(200, bool))
    with pytest.raises(ValueError, match="too little"):
        instances.fit_instances([wrong], ("sofa",))


def test_larger_things_show_more_surface():
    assert area("mug" if lexicon().find("mug") else "cup") < area("chair") < area("sofa") < 6.0


def test_every_kind_with_a_size_in_the_lexicon_has_a_usual_area():
    notes = load_network().notes
    sized = {name for name in notes.categories if (e := lexicon().find(name, EntryKind.THING)) and e.size_m is not None}
    assert set(notes.instances.area_m2) == sized


def test_a_bed_of_twenty_centimetres_is_less_likely_than_a_cushion_of_that_size():
    encoder = EmbeddedPixels()
    p, small = np.array([0.6]), np.array([0.04])
    assert encoder.instance_probability("bed", p, small)[0] < 0.3
    assert encoder.instance_probability("cushion", p, small)[0] > encoder.instance_probability("bed", p, small)[0]


def test_an_artists_model_takes_the_box_of_the_piece_that_it_replaces(tmp_path: Path):
    trimesh.creation.icosphere(subdivisions=1, radius=3.0).export(tmp_path / "Couch_Large1.glb")
    plain = [furnish.make("sofa", np.random.default_rng(seed)) for seed in range(12)]
    with borrowed.borrowed_furniture(tmp_path):
        mixed = [furnish.make("sofa", np.random.default_rng(seed)) for seed in range(12)]
    assert {piece.family == "Couch_Large1" for piece in mixed} == {True, False}
    for one, other in zip(plain, mixed, strict=True):
        np.testing.assert_allclose(one.mesh.low, other.mesh.low, atol=1e-4)
        np.testing.assert_allclose(one.mesh.high, other.mesh.high, atol=1e-4)
    after = furnish.make("sofa", np.random.default_rng(0))
    assert after.family == plain[0].family


def test_models_that_training_sees_and_models_to_measure_on_are_apart(tmp_path: Path):
    for name in ("Couch_Large1", "Couch_Large2", "Couch_Large3", "Couch_Medium1", "Couch_Medium2", "loungeSofa"):
        trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / f"{name}.glb")
    seen: dict[str, set[str]] = {}
    for which in ("training", "held-out"):
        with borrowed.borrowed_furniture(tmp_path, which):
            made = [furnish.make("sofa", np.random.default_rng(seed)).family for seed in range(60)]
        seen[which] = {family for family in made if (tmp_path / f"{family}.glb").is_file()}
    assert seen["training"] and seen["held-out"]
    assert not seen["training"] & seen["held-out"]


def test_a_folder_without_models_is_refused(tmp_path: Path):
    with pytest.raises(FileNotFoundError, match="none of the models"), borrowed.borrowed_furniture(tmp_path):
        pass
