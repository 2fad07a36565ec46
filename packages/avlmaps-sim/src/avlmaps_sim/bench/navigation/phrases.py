"""How goals are named in commands, and the lines of programs that a perfect translator would write for them."""

from collections.abc import Sequence

from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.bench.navigation.missions import Goal, GoalKind
from avlmaps_sim.mesh import Triple

PHOTO = "{photo %d}"


def object_heat(category: str, major: bool = True) -> str:
    """Return the expression of a kind of thing's heat."""
    return f'robot.{_map(major)}(obj="{category}")'


def sound_heat(sound: str, major: bool = True) -> str:
    """Return the expression of a sound's heat."""
    return f'robot.{_map(major)}(sound="{spoken(sound)}")'


def image_heat(photo: int, major: bool = True) -> str:
    """Return the expression of a photo's heat."""
    return f'robot.{_map(major)}(img=robot.load_image("{PHOTO % photo}"))'


def area_heat(area: str, major: bool = True) -> str:
    """Return the expression of an area's heat."""
    return f'robot.{_map(major)}(area="{area}")'


def _map(major: bool) -> str:
    return "get_major_map" if major else "get_map"


def go_to(heat: str) -> str:
    """Return the line that goes to the best place of a heat."""
    return f"robot.move_to(robot.get_max_pos_3d({heat}))"


def an_object(category: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY": any of that kind."""
    return Goal(GoalKind.OBJECT, f"the {category}", f'robot.move_to_object("{category}")', tuple(boxes))


def spoken(sound: str) -> str:
    """Return a person's word for a kind of sound: of "fan or air conditioner" the first."""
    return sound.split(" or ")[0]


def a_sound(sound: str, places: Sequence[Triple]) -> Goal:
    """Return the goal "the sound of SOUND": anywhere it was heard."""
    said = f"the sound of {spoken(sound)}"
    return Goal(GoalKind.SOUND, said, go_to(sound_heat(sound)), places=tuple(places))


def an_image(photo: int, camera: Triple) -> Goal:
    """Return the goal "the image FILE": where it was taken."""
    return Goal(GoalKind.IMAGE, f"the image {PHOTO % photo}", go_to(image_heat(photo)), places=(camera,))


def an_area(area: str, rooms: Sequence[Sequence[tuple[float, float]]]) -> Goal:
    """Return the goal "the AREA": in any room of that kind."""
    corners = tuple(tuple(room) for room in rooms)
    return Goal(GoalKind.AREA, f"the {area}", go_to(area_heat(area)), rooms=corners)


def near_sound(category: str, sound: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY near the sound of SOUND"."""
    heat = f"{object_heat(category)} * {sound_heat(sound, major=False)}"
    said = f"the {category} near the sound of {spoken(sound)}"
    return Goal(GoalKind.OBJECT, said, go_to(heat), tuple(boxes), context="sound")


def near_image(category: str, photo: int, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY near the image FILE"."""
    heat = f"{object_heat(category)} * {image_heat(photo, major=False)}"
    said = f"the {category} near the image {PHOTO % photo}"
    return Goal(GoalKind.OBJECT, said, go_to(heat), tuple(boxes), context="image")


def in_area(category: str, area: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY in the AREA"."""
    heat = f"{object_heat(category)} * {area_heat(area, major=False)}"
    return Goal(GoalKind.OBJECT, f"the {category} in the {area}", go_to(heat), tuple(boxes), context="area")


def sound_near_object(sound: str, category: str, place: Triple) -> Goal:
    """Return the goal "the sound of SOUND near the CATEGORY"."""
    heat = f"{sound_heat(sound)} * {object_heat(category, major=False)}"
    said = f"the sound of {spoken(sound)} near the {category}"
    return Goal(GoalKind.SOUND, said, go_to(heat), places=(place,), context="object")


def sound_near_image(sound: str, photo: int, place: Triple) -> Goal:
    """Return the goal "the sound of SOUND near the image FILE"."""
    heat = f"{sound_heat(sound)} * {image_heat(photo, major=False)}"
    said = f"the sound of {spoken(sound)} near the image {PHOTO % photo}"
    return Goal(GoalKind.SOUND, said, go_to(heat), places=(place,), context="image")


def heat_of(goal: Goal) -> str:
    """Return the expression of what a goal names, as an argument of a skill."""
    line = goal.program
    for before in ("robot.move_to(robot.get_max_pos_3d(", "robot.move_to_object("):
        if line.startswith(before):
            return line.removeprefix(before)[: -2 if before.count("(") == 2 else -1]
    raise ValueError(f"{line!r} goes to nothing that has a heat")
