"""Options in sentences, as each front spells them."""

import subprocess
import sys
from contextvars import copy_context
from threading import Thread

import pytest

from avlmaps.core.wording import Spelling, asked_as, flag, option, options_as


@pytest.mark.parametrize(
    ("spelling", "said"),
    [
        (Spelling.ARGUMENT, "overwrite=True, Corrections.depth_unit_m=METRES, Corrections.depth_unit_m"),
        (Spelling.FLAG, "--overwrite, --depth-unit METRES, --depth-unit"),
        (Spelling.FIELD, "overwrite=True, depth_unit=METRES, depth_unit"),
    ],
)
def test_each_front_spells_options_in_its_way(spelling, said):
    with options_as(spelling):
        assert f"{option('overwrite')}, {option('depth-unit', 'METRES')}, {option('depth-unit')}" == said
        assert flag("depth-unit", "METRES") == "--depth-unit METRES"


def test_the_spelling_ends_with_its_front():
    with pytest.raises(KeyError), options_as(Spelling.FLAG):
        raise KeyError
    assert option("overwrite") == "overwrite=True"


def test_who_asks_is_answered_in_their_spelling_and_the_front_in_its_own():
    with options_as(Spelling.FLAG):
        with asked_as(Spelling.FIELD):
            context = copy_context()
            assert option("camera-height-m") == "camera_height_m"
        assert option("camera-height-m") == "--camera-height-m"
        said: list[str] = []
        for run in (lambda work: work(), context.run):
            thread = Thread(target=run, args=(lambda: said.append(option("camera-height-m")),))
            thread.start()
            thread.join()
    assert said == ["--camera-height-m", "camera_height_m"]


def test_processes_that_a_front_starts_spell_as_it_does():
    code = "from avlmaps.core.wording import option; print(option('overwrite'))"
    with options_as(Spelling.FLAG):
        said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.strip() == "--overwrite"
