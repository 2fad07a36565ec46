"""The table of what the other distributions bring is what they bring; what is missing says how to get it."""

import json
import tomllib
from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from avlmaps.cli import verbs
from avlmaps.core import registry
from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.extras import MODELS, OTHERS, SIMULATOR, Distribution, how_to_get, install_command
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.navigate import robots
from avlmaps.perception import encoders as profiles
from avlmaps_models import entries

ROOT = Path(__file__).parents[2]


def project(distribution: Distribution) -> dict:
    return tomllib.loads((ROOT / "packages" / distribution.name / "pyproject.toml").read_text())["project"]


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where `avlmaps` is installed and nothing else."""
    for module in (registry, verbs, robots, profiles):
        monkeypatch.setattr(module, "entry_points", lambda group: EntryPoints(()))
    monkeypatch.setattr(verbs, "installed", verbs.installed.__wrapped__)


@pytest.mark.parametrize("one", OTHERS, ids=lambda one: one.name)
def test_the_table_names_what_each_distribution_brings(one: Distribution) -> None:
    brought = project(one)["entry-points"]
    assert set(one.verbs) == brought.get("avlmaps.verbs", {}).keys()
    assert set(one.profiles) == brought.get("avlmaps.profiles", {}).keys()
    assert "avlmaps.scenes" in brought or one is not SIMULATOR


def test_the_table_names_every_backend_on_torch() -> None:
    assert {f"{one.kind}:{one.name}" for one in entries.BACKENDS} == set(MODELS.backends)
    assert all(one.distribution == MODELS.name for one in entries.BACKENDS)
    extras = project(MODELS)["optional-dependencies"]
    assert {one.extra for one in entries.BACKENDS} - {""} == extras.keys()


@pytest.mark.parametrize("one", OTHERS, ids=lambda one: one.name)
def test_all_distributions_have_one_version(one: Distribution) -> None:
    pyproject = tomllib.loads((ROOT / "packages" / one.name / "pyproject.toml").read_text())
    place = ROOT / "packages" / one.name / pyproject["tool"]["hatch"]["version"]["path"]
    assert place.resolve() == ROOT / "src/avlmaps/core/version.py"
    major, minor, *_ = __version__.split(".")
    assert f"avlmaps>={major}.{minor},<{major}.{int(minor) + 1}" in pyproject["project"]["dependencies"]


@pytest.mark.parametrize("verb", [verb for one in OTHERS for verb in one.verbs])
def test_a_verb_that_is_not_installed_says_how_to_get_it(verb: str, alone: None, run) -> None:
    status, out, err = run(verb, "--json")
    said = f"The verb {verb} is not installed; get it with: {how_to_get('verbs', verb)}"
    assert status == 1
    assert json.loads(out)["error"] == {"kind": "backend", "message": said}
    assert err == f"avlmaps: {said}\n"
    assert verb not in verbs.installed()[0]


def test_a_scene_a_profile_and_a_backend_that_are_not_installed_say_how_to_get_them(alone: None) -> None:
    with pytest.raises(NavigationError) as fault:
        robots.open_robot_scene("house:7")
    assert str(fault.value).endswith(f"get it with: {install_command(distribution='avlmaps-sim')}")
    get = install_command(distribution="avlmaps-models")
    with pytest.raises(BackendError, match="profile 'paper' is not installed") as fault:
        profiles.profile("paper")
    assert str(fault.value).endswith(f"get it with: {get}")
    with pytest.raises(BackendError, match="pixels backend 'tipsv2' is not installed") as fault:
        registry.find(Kind.PIXELS, "tipsv2")
    assert str(fault.value).endswith(f"get it with: {get}")
    assert profiles.profile("embedded").name == "embedded"
