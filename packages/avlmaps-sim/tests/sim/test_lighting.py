"""Light in a scene: what shadow, distance, slant and bounces must do to it."""

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps_sim import shapes
from avlmaps_sim.lighting import default_lights, light_map
from avlmaps_sim.mesh import Material
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import Area, Light, Scene, SceneBuilder

WHITE, RED = Material((0.85, 0.85, 0.85)), Material((0.9, 0.1, 0.1))
DOWN = np.array([[0.0, -1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 2.4], [0.0, 0.0, 0.0, 1.0]])
CAMERA = Pinhole(60.0, 60.0, 60.0, 60.0, 120, 120)


def room(lights: tuple[Light, ...], walls: Material = WHITE, things: dict[str, object] | None = None) -> Scene:
    """Return a closed room of 6 x 6 x 2.6 m round the origin; its walls are sheets that may differ in colour."""
    builder = SceneBuilder("room")
    low, high = -3.0, 3.0
    builder.add("floor", shapes.sheet((low, low, 0.0), (6.0, 0, 0), (0, 6.0, 0), WHITE))
    builder.add("ceiling", shapes.sheet((low, low, 2.6), (6.0, 0, 0), (0, 6.0, 0), WHITE))
    for origin, along in (((low, low, 0.0), (6.0, 0, 0)), ((low, high, 0.0), (6.0, 0, 0)),
                          ((low, low, 0.0), (0, 6.0, 0)), ((high, low, 0.0), (0, 6.0, 0))):  # fmt: skip
        builder.add("wall", shapes.sheet(origin, along, (0, 0, 2.6), walls))
    for category, mesh in (things or {}).items():
        builder.add(category, mesh)
    builder.areas.append(Area("room", np.array([[low, low], [high, low], [high, high], [low, high]]), 0.0, 2.6))
    builder.lights.extend(lights)
    return builder.build()


def floor_light(scene: Scene) -> np.ndarray:
    """Return the (120, 120, 3) linear light on what a camera under the ceiling sees, row 0 towards +x."""
    renderer = Renderer(scene)
    renderer.render(CAMERA, DOWN)
    layer = renderer._layers_for(CAMERA.width * CAMERA.height)[0]
    return layer.colour.reshape(120, 120, 3)


def at(image: np.ndarray, x: float, y: float, height: float = 0.0) -> np.ndarray:
    """Return what a picture from straight above shows at a place."""
    depth = 2.4 - height
    return image[int(60 - 60 * x / depth), int(60 - 60 * y / depth)]


def test_under_a_table_it_is_darker_than_beside_it_but_not_black():
    table = shapes.slab(0.0, 1.0, 0.7, 1.0, 0.8, 0.04, WHITE)
    lamp = (Light((0.0, -1.0, 2.3)),)
    without, having = floor_light(room(lamp)), floor_light(room(lamp, things={"table": table}))
    shadow = (0.0, 2.2)  # the lamp's shadow of the table's far half falls here; the camera sees past the edge
    assert at(having, *shadow)[1] < 0.7 * at(without, *shadow)[1]
    assert at(having, *shadow)[1] > 0.05 * at(without, *shadow)[1]
    assert at(having, -1.0, -1.0)[1] == pytest.approx(at(without, -1.0, -1.0)[1], rel=0.15)


def test_light_falls_with_distance_and_slant_from_the_lamp():
    image = floor_light(room((Light((0.0, 0.0, 2.2)),)))
    values = [float(at(image, x, 0.0)[1]) for x in (0.0, 0.8, 1.6, 2.3)]
    assert values == sorted(values, reverse=True)
    assert values[-1] < 0.6 * values[0]


def test_a_wall_keeps_the_light_of_one_room_out_of_the_other():
    wall = shapes.box((0.2, -3.0, 0.0), (0.32, 3.0, 2.6), WHITE)
    here, beyond = (floor_light(room((Light((x, 0.0, 2.2)),), things={"wall between": wall})) for x in (-1.6, 1.9))
    assert at(beyond, -1.5, 0.0)[1] < 0.02 * at(here, -1.5, 0.0)[1]


def test_red_walls_colour_what_they_light():
    white, red = (floor_light(room((Light((0.0, 0.0, 2.0)),), walls=look)) for look in (WHITE, RED))
    near_wall = (0.0, 2.3)
    ratio = [float(at(image, *near_wall)[0] / at(image, *near_wall)[1]) for image in (white, red)]
    assert ratio[0] == pytest.approx(1.0, abs=0.02)
    assert ratio[1] > 1.1


def test_twice_the_lamps_power_is_brighter_and_no_lamp_is_dark():
    dim, bright = (floor_light(room((Light((0.0, 0.0, 2.0), (p, p, p)),))) for p in (0.2, 0.4))
    assert np.median(bright / dim) == pytest.approx(2.0, rel=0.15)


def test_a_room_without_lamps_gets_one_under_its_ceiling():
    scene = room(())
    (lamp,) = default_lights(scene)
    assert scene.areas[0].contains(np.array(lamp.position[:2]))
    assert 1.8 < lamp.position[2] < 2.6
    assert np.median(floor_light(scene)) > 0.05


def test_a_glowing_screen_lights_the_floor_before_it():
    screen = shapes.sheet((2.9, -0.6, 0.5), (0, 1.2, 0), (0, 0, 1.2), Material((1.0, 1.0, 1.0), emission=1.0))
    faint = (Light((-2.0, 0.0, 2.0), (0.02, 0.02, 0.02)),)
    off, on = floor_light(room(faint)), floor_light(room(faint, things={"screen": screen}))
    assert at(on, 1.8, 0.0)[1] > 1.5 * at(off, 1.8, 0.0)[1]


def test_the_bulbs_of_a_chandelier_count_as_one_lamp_of_their_sum():
    bulbs = tuple(Light((0.1 * k, 0.0, 2.0), (0.1, 0.1, 0.1)) for k in range(-2, 3))
    one, many = floor_light(room((Light((0.0, 0.0, 2.0), (0.5, 0.5, 0.5)),))), floor_light(room(bulbs))
    assert np.allclose(one, many, rtol=1e-4)


def test_pictures_of_a_bright_and_of_a_dim_room_are_exposed_alike():
    pictures = [Renderer(room((Light((0.0, 0.0, 2.0), (p, p, p)),))).render(CAMERA, DOWN).rgb for p in (0.3, 1.5)]
    means = [float(np.mean(picture)) for picture in pictures]
    assert abs(means[0] - means[1]) < 15
    assert 90 < means[0] < 215


def test_every_sample_of_a_light_map_is_finite_and_every_triangle_has_samples():
    scene = room((Light((0.0, 0.0, 2.0)),), things={"ball": shapes.ellipsoid((1.0, 1.0, 0.4), (0.4, 0.4, 0.4), RED)})
    light = light_map(scene, np.full((len(scene.mesh.materials), 3), 0.5))
    assert np.isfinite(light.light).all()
    assert (light.light >= 0).all()
    on_patch = light.sample[:, 0] < 0
    assert (light.sample[on_patch, 1] < len(light.first)).all()
    assert (light.sample[~on_patch] < len(light.light)).all()
    assert (light.sample[~on_patch] >= 0).all()
