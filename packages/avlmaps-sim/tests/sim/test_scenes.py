"""Scenes by name."""

import pytest

from avlmaps_sim.scenes import SceneError, open_scene


@pytest.mark.parametrize("name", ["house:3", "house:3:held-out", "house:3:training"])
def test_a_building_is_named_by_what_opens_it_again(name: str) -> None:
    scene = open_scene(name)
    assert scene.name == name
    assert open_scene(scene.name).objects == scene.objects


@pytest.mark.parametrize("spec", [None, 5])
def test_what_is_no_name_of_a_scene_is_refused(spec: object) -> None:
    with pytest.raises(SceneError, match="a scene is a text such as house:12"):
        open_scene(spec)  # pyright: ignore[reportArgumentType]
