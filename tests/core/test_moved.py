"""Names that moved to another distribution are the new ones, warn, and say what to install where it is missing."""

import importlib
import pickle
import subprocess
import sys

import pytest

import avlmaps
from avlmaps.core import moved
from avlmaps.core.extras import install_command

LIGHT = ["avlmaps.sim.mesh", "avlmaps.recordings.clips", "avlmaps.sim.furniture.tables", "avlmaps.bench.words",
         "avlmaps.demo.driving", "avlmaps.maps.import_reference.scene",
         "avlmaps.perception.foundation.prompts"]  # fmt: skip

WITHOUT = """
import sys
class Without:
    def find_spec(self, name, *_):
        if name == "{package}":
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Without())
"""


def new_name(old: str) -> str:
    known = max((name for name in moved.MODULES if old == name or old.startswith(f"{name}.")), key=len)
    return moved.MODULES[known] + old[len(known) :]


@pytest.mark.parametrize("old", LIGHT)
def test_a_module_of_old_is_the_new_one_and_warns(old: str) -> None:
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning, match=f"{old} is now {new_name(old)}; the old name goes"):
        module = importlib.import_module(old)
    assert module is importlib.import_module(new_name(old))


def test_what_was_pickled_by_an_old_name_is_loaded() -> None:
    from avlmaps_sim.mesh import Material

    stored = pickle.dumps(Material((0.1, 0.2, 0.3)), protocol=0).replace(b"avlmaps_sim.mesh", b"avlmaps.sim.mesh")
    assert b"avlmaps.sim.mesh" in stored
    loaded = pickle.loads(stored)
    assert type(loaded) is Material
    assert tuple(loaded.colour) == (0.1, 0.2, 0.3)


@pytest.mark.parametrize("name", moved.NAMES)
def test_a_name_that_avlmaps_gave_is_still_had_with_a_warning(name: str) -> None:
    with pytest.warns(DeprecationWarning, match=f"avlmaps.{name} is now avlmaps_sim.{name}") as told:
        old = getattr(avlmaps, name)
    assert old is getattr(importlib.import_module("avlmaps_sim"), name)
    assert told[0].filename == __file__


def test_other_modules_that_are_missing_are_missing_as_ever() -> None:
    for name in ("avlmaps.nothing", "avlmaps.sim.nothing", "avlmaps.simulator"):
        with pytest.raises(ModuleNotFoundError, match="No module named"):
            importlib.import_module(name)


@pytest.mark.parametrize(
    ("code", "distribution"),
    [
        ("import avlmaps.sim.mesh", "avlmaps-sim"),
        ("import avlmaps; avlmaps.record_scene", "avlmaps-sim"),
        ("import avlmaps.perception.paper.lseg", "avlmaps-models"),
    ],
)
def test_without_its_distribution_an_old_name_says_what_to_install(code: str, distribution: str) -> None:
    package = distribution.replace("-", "_")
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT.format(package=package) + code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(f"get it with: {install_command(distribution=distribution)}")
