"""The things that a program's words, heatmaps and places mean, found by queries to a map."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from numbers import Real
from typing import TYPE_CHECKING, cast

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError, ProgramError, SeveralFitError
from avlmaps.core.question import HeardAt, Modality
from avlmaps.core.wording import option, place_text, the_room
from avlmaps.language.program.vocabulary import Clip, Picture, Place, Target
from avlmaps.language.said_places import said_storeys
from avlmaps.maps.store.folder import stamp
from avlmaps.maps.storeys import said_storeys as storeys_in_words
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.footprint import Outline
from avlmaps.query.answer import fitting
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import NOWHERE
from avlmaps.query.factors import UNDERSTOOD_ONLY, Factor, NearThings
from avlmaps.query.goals import MOST_GOALS, Goal, as_likely
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.lists import at_storey, storeys_meant
from avlmaps.query.sound_sources import no_sources

if TYPE_CHECKING:
    from avlmaps.maps.sources.candidates import Spread


def text_of(value: object, skill: str) -> str:
    """Return words, or raise ``ProgramError`` where it is something else."""
    if not isinstance(value, str):
        raise ProgramError(f"{skill} takes words, not {kind_of(value)}.")
    return value


def number_of(value: object, skill: str, most: float, unit: str) -> float:
    """Return a number, or raise ``ProgramError`` where it is none, not finite or beyond ``most`` on either side."""
    # NumPy's numbers are real ones too; NaN fails every comparison.
    if isinstance(value, bool) or not isinstance(value, Real) or not abs(cast("float", value)) <= most:
        shown = value if isinstance(value, float) else kind_of(value)
        if isinstance(value, int) and not isinstance(value, bool):
            shown = value if abs(value) < 10**12 else "a larger one"  # an integer may have any number of digits
        raise ProgramError(f"{skill} takes a number of at most {most:g} {unit}, not {shown}.")
    return float(value)


def kind_of(value: object) -> str:
    """Return the kind of a value, for the sentence of an error."""
    return f"a {type(value).__name__.lower()}"


_SIDES = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}  # of the level frame
_INSIDE_M = 0.5  # from the walls of a room, on a round in it
_MOST_LISTED = 9  # things that fit equally, in the sentence that asks which
Heats = dict[tuple[object, ...], Heatmap]
"""The answers of one map, as it was opened, by the query."""


@dataclass(frozen=True, slots=True, eq=False)
class Destination:
    """Something to go to."""

    name: str  # what it was called; "" for a place that a program gives
    outline: Outline  # what it covers of the ground, level frame; a single point where it is not a thing
    place: Float[np.ndarray, "3"]  # of the goal, level frame, metres
    probability: float = 1.0  # that it is what was meant
    solid: bool = False  # whether it is a thing with an extent, rather than a place
    found: bool = True  # whether it is likely enough, by the map's settings
    half: bool = False  # whether a word of the name is not understood, so that each that is found may be meant
    spread: "Spread | None" = None  # how well the place is known, where it is the source of a sound
    area: bool = False  # whether it stands for a room


def describe_query(heat: Heatmap) -> str:
    """Return the query of a heatmap in words: ``'chair' near 'glass breaking'``."""
    lead = heat.lead
    others = [_name(factor) for factor in heat.factors if factor is not lead]
    return _name(lead) + (f" near {' and '.join(others)}" if others else "")


def _name(factor: Factor) -> str:
    return f"{'the source of ' if factor.part.at == 'source' else ''}{factor.part.shown!r}"


def things_in(heat: Heatmap, guess: bool = False) -> list[Destination]:
    """Return the distinct things that a heatmap asks for, best first; at least one, and all of them found.

    With ``guess`` the best guess is taken where nothing is found, however unlikely it is; where nothing comes together
    with what it is near, the thing alone.

    Raises:
        GoalNotFoundError: there is none.
    """
    if heat.found:
        found = [goal for goal in heat.goals(MOST_GOALS) if goal.probability >= heat.found_at]
        return [_thing(heat, heat.lead, goal) for goal in found]
    for tried in _guesses(heat) if guess else ():
        goals = tried.goals(MOST_GOALS)
        if goals:
            return [_thing(tried, tried.lead, goal) for goal in goals]
    raise GoalNotFoundError(explain_absence(heat, guess))


def _guesses(heat: Heatmap) -> Iterator[Heatmap]:
    lead = Heatmap.of(heat.lead, heat.found_at).only(heat.where)
    yield heat
    yield heat.include_uncertain()
    if len(heat.factors) > 1:
        yield lead
        yield lead.include_uncertain()


def nearest(things: Sequence[Destination], xy: Float[np.ndarray, "2"]) -> Destination:
    """Return the thing nearest to a place, of those that are found; the best where none is.

    One that is less than half as likely as the best is no choice: it counts as found only where the limit is low.
    """
    found = [thing for thing in things if thing.found and 2.0 * thing.probability >= things[0].probability]
    return min(found, key=lambda thing: thing.outline.distance_m(xy)) if found else things[0]


def likely(things: Sequence[Destination], one: bool) -> Sequence[Destination]:
    """Return the things that may be meant: the best where one is meant, else those that are found."""
    return things[:1] if one else [thing for thing in things if thing.found] or things[:1]


def fit_equally(things: Sequence[Destination]) -> Sequence[Destination]:
    """Return the things of which no word says that one is meant rather than the likeliest."""
    return likely(things, one=False) if things[0].half else as_likely(things)


def same_thing(a: Destination, b: Destination) -> bool:
    """Return whether two are one and the same thing."""
    return a.solid and b.solid and np.allclose(a.outline.centre, b.outline.centre, atol=1e-6)


def _thing(heat: Heatmap, lead: Factor, goal: Goal) -> Destination:
    position = np.array(goal.position)
    instance = int(lead.instance[np.argmin(np.linalg.norm(lead.anchors - position, axis=1))])
    name, place, found = describe_query(heat), heat.space.level(position), goal.probability >= heat.found_at
    if not isinstance(lead, NearThings):
        area, outline = lead.part.modality is Modality.AREA, Outline.at(place[:2])
        return Destination(name, outline, place, goal.probability, found=found, spread=goal.spread, area=area)
    own = heat.space.level(lead.anchors[lead.instance == instance])
    outline = Outline.round(own[:, :2], heat.space.grid.voxel_size_m)
    return Destination(
        name, outline, place, goal.probability, solid=True, found=found, half=UNDERSTOOD_ONLY in lead.note
    )


def explain_absence(heat: Heatmap, guess: bool = False) -> str:
    """Return one sentence on why there is no goal: which phrase failed, what the best guess is, and what to do."""
    what, missing = describe_query(heat), [factor for factor in heat.factors if not factor.found]
    if missing:
        why = f"is not found in the map: {'; '.join(_absence(factor) for factor in missing)}"
    elif len(heat.factors) == 1:
        why = f"is not found in the map with a probability of {heat.found_at:g}"
    else:
        why = "is not found in the map: each is there, but they do not come together anywhere"
    best = next(iter(heat.goals(1)), None)
    if best is None:
        return f"{what} {why}; say it in other words."
    advice = "say it in other words"
    if not guess:
        advice += f", or let the robot go to the best guess ({option('guess')})"
    place = place_text(best.position)
    return f"{what} {why}. The best guess is at {place} with probability {best.probability:.2f}; {advice}."


def _absence(factor: Factor) -> str:
    note = factor.note or f"its confidence is at best {float(np.max(factor.confidence, initial=0.0)):.2f}"
    return f"{factor.part.modality} {factor.part.query!r}: {note}".rstrip(".")


class Seeker:
    """Finds in a map what a program means.

    ``notes`` are what a person should know: words half understood, guesses; ``choices`` the things that fitted equally
    where the last error asks which is meant; ``numbers`` the answers to such questions that none has asked for yet.
    """

    def __init__(
        self,
        avlmap: AVLMap,
        guess: bool,
        readable: Readable,
        tell: Callable[[str], None],
        storey: int = 0,
        heats: Heats | None = None,
        choose: Sequence[int] | None = (),
    ) -> None:
        """Take a map, a function for each note, the robot's storey, and ``heats``, what the map answered before.

        ``choose`` answers which of several things that fit equally is meant, one number from 1 for each name in the
        order of the program. None: the best or the nearest, without a question.
        """
        self.avlmap, self.guess, self.readable, self._tell = avlmap, guess, readable, tell
        self._asks, self.numbers = choose is not None, list(choose or ())
        self._meant: dict[str, int] = {}
        self.choices: tuple[str, ...] = ()
        self._storey, self.heats = storey, {} if heats is None else heats
        self.notes: list[str] = []
        self._handed_out: dict[Place, Destination] = {}
        self._instances: set[Place] = set()
        self._last_line = ""

    def heat(
        self, skill: str, obj: object, sound: object, img: object, area: object, at: object, *, primary: bool
    ) -> Heatmap:
        """Return the heatmap of the one thing that is given; ``primary`` is what is sought itself.

        Of a sound ``at`` says ``robot`` or ``source``; the map's settings overrule it. ``ProgramError`` says that not
        exactly one is given, or of another kind; ``QueryError`` that the map cannot answer.
        """
        given = {"obj": obj, "sound": sound, "img": img, "area": area}
        named = [name for name, value in given.items() if value is not None]
        if len(named) != 1:
            what = " and ".join(named) or "none of them"
            raise ProgramError(f"{skill} takes exactly one of obj, sound, img and area; it was given {what}.")
        place = self._place(skill, at, sound)
        if img is not None:
            if not isinstance(img, Picture):
                raise ProgramError(f"{skill} takes as img what load_image returns, not {kind_of(img)}.")
            file = self.readable.find(img.path, "picture")
            heat = self._known((img, stamp(file), primary), lambda: self.avlmap.image(file, primary=primary))
        elif isinstance(sound, Clip):
            clip = self.readable.find(sound.path, "clip")
            key = sound, stamp(clip), primary, place
            heat = self._known(key, lambda: self.avlmap.sound_clip(clip, primary=primary, at=place))
        elif sound is not None:
            words = text_of(sound, skill)
            heat = self._named("sound", words, primary, lambda name: self.avlmap.sound(name, primary, at=place), place)
        elif area is not None:
            heat = self._named("area", text_of(area, skill), primary, lambda name: self.avlmap.area(name, primary))
        else:
            heat = self._named("object", text_of(obj, skill), primary, lambda name: self.avlmap.object(name, primary))
        self._note(heat)
        return heat

    def _known(self, key: tuple[object, ...], heat_of: Callable[[], Heatmap]) -> Heatmap:
        if key not in self.heats:
            self.heats[key] = heat_of()
        return self.heats[key]

    def _place(self, skill: str, at: object, sound: object) -> HeardAt | None:
        if at not in ("robot", "source"):
            raise ProgramError(f'{skill} takes at="robot" or at="source", not {at!r}.')
        if at == "robot" or self.avlmap.settings.sounds.at is not None:
            return None
        if sound is None:
            raise ProgramError(f'{skill} takes at="source" with a sound; what is seen has no other place.')
        why = no_sources(self.avlmap)
        self.note(why)
        return None if why else "source"

    def _named(
        self, kind: str, name: str, primary: bool, heat_of: Callable[[str], Heatmap], at: HeardAt | None = None
    ) -> Heatmap:
        said = said_storeys(name)
        if len(said) != 1 or not said[0].said or not said[0].rest:
            return self._known((kind, name, primary, at), lambda: heat_of(name))
        storeys, word = self.avlmap.storeys, said[0]
        numbers, note = storeys_meant(word, 1 if storeys is None else len(storeys))
        self.note(note)
        if not numbers:
            raise GoalNotFoundError(f"{name!r} is not found: the map {storeys_in_words(storeys).removeprefix('it ')}.")
        heat = self._known((kind, word.rest, primary, at), lambda: heat_of(word.rest))
        if storeys is None:
            return heat
        only = heat.only(lambda places: np.isin(storeys.of_places(places), numbers))
        if heat.found and not only.found:
            place = heat.goals(1)[0].position
            name_of = storeys[int(storeys.of_places(np.array([place]))[0])].name
            raise GoalNotFoundError(f"No {word.rest} is found {at_storey(word)}; one is on the {name_of}.")
        return only

    def best(self, target: Target) -> Destination:
        """Return the thing that a target means: the likeliest.

        Like all that finds, it raises ``GoalNotFoundError`` where there is none, and ``SeveralFitError`` where several
        fit equally and none was chosen.
        """
        things, _ = self._candidates(target)
        return self._chosen(self._of_equal(things) if self._asks else things[0], len(things))

    def referent(self, target: Target, here: Float[np.ndarray, "2"]) -> Destination:
        """Return the thing that a target means for a robot: the likeliest; without questions that nearest to it."""
        return self.best(target) if self._asks else self.nearest(target, here)

    def nearest(self, target: Target, here: Float[np.ndarray, "2"]) -> Destination:
        """Return the thing nearest to a robot of those that a target may mean."""
        things, one = self._candidates(target)
        among = things if not one else fit_equally(things) if self._asks else things[:1]
        return self._chosen(nearest(among, here), len(things))

    def _of_equal(self, things: list[Destination]) -> Destination:
        equal = fit_equally(things)
        name = equal[0].name
        if len(equal) > 1 and name not in self._meant and self.numbers:
            self._meant[name] = self.numbers.pop(0)
        number = 1 if len(equal) == 1 else self._meant.get(name, 0)
        if 1 <= number <= len(equal):
            if len(equal) > 1:
                where = self._places_of(equal[number - 1 : number])[0]
                self.note(f"of {len(equal)} places for {name} number {number} is meant: {where}")
            return equal[number - 1]
        self.choices = self._places_of(equal)
        listed = "; ".join(f"{at}: {where}" for at, where in enumerate(self.choices[:_MOST_LISTED], 1))
        more = f"; and {len(equal) - _MOST_LISTED} more" if len(equal) > _MOST_LISTED else ""
        none = f"There is no number {number}. " if number else ""
        several = f"{none}{fitting(len(equal), sum(thing.found for thing in things))} {name} equally: {listed}{more}."
        raise SeveralFitError(
            f"{several} Which one? Say the nearest, or what it is near, or choose one by its number "
            f"({option('choose', '1', python='(1,)', field='[1]')}).",
            self.choices,
        )

    def _places_of(self, things: Sequence[Destination]) -> tuple[str, ...]:
        places = np.array([self.avlmap.space.world(thing.place) for thing in things])
        texts = zip(places, map(self.avlmap.where.name_of, places), strict=True)
        return tuple(f"{place_text(place)}{f' in {the_room(room)}' if room else ''}" for place, room in texts)

    def contour(self, thing: Destination) -> Outline:
        """Return the outline of a thing, or for an area one inside of its room; ``GoalNotFoundError`` without one."""
        if thing.solid:
            return thing.outline
        where, space = self.avlmap.where, self.avlmap.space
        number = where.rooms_of(space.world(thing.place)[None])[0] if thing.area else NOWHERE
        corners = np.zeros((0, 3)) if number == NOWHERE else where.rooms[number].outline
        inside = Outline(space.level(corners)[:, :2]).within(_INSIDE_M) if len(corners) else None
        if inside is None:
            raise GoalNotFoundError(f"The map knows no outline of {thing.name or 'that place'} to go round.")
        return inside

    def pair(self, a: Target, b: Target, here: Float[np.ndarray, "2"]) -> tuple[Destination, Destination]:
        """Return the two things that are meant: of several, those nearest to each other and to the robot."""
        (first, one), (second, other) = self._candidates(a), self._candidates(b)
        first, second = likely(first, one), likely(second, other)
        pairs = [(x, y) for x, y in product(first, second) if not same_thing(x, y)]
        if not pairs:
            raise GoalNotFoundError(
                f"There is only one {first[0].name} in the map, and between a thing and itself there is nothing; name "
                "two different things."
            )

        def far_m(pair: tuple[Destination, Destination]) -> float:
            near, far = pair[0].outline.gap_to(pair[1].outline)
            return float(np.linalg.norm(near - far) + np.linalg.norm((near + far) / 2 - here))

        x, y = min(pairs, key=far_m)
        return self._chosen(x, len(first)), self._chosen(y, len(second))

    def _candidates(self, target: Target) -> tuple[list[Destination], bool]:
        if isinstance(target, Place):
            level = self.avlmap.space.level(np.array([target.x, target.y, target.z]))
            known = self._handed_out.get(target, Destination("", Outline.at(level[:2]), level))
            return [known if target in self._instances else replace(known, outline=Outline.at(level[:2]))], True
        heat = self._heat_of(target, "go to")
        rooms = self._rooms(heat)
        if rooms:
            return self._near_first(rooms, heat.found_at), False
        things = things_in(heat, self.guess)
        if isinstance(target, str):
            self._note(heat)
        things = self._near_first(things, heat.found_at)
        if not heat.found:
            likely_by = f"{things[0].probability:.2f}, below {heat.found_at:.2f}"
            self.note(f"the probability of {things[0].name} is {likely_by}; this is the best guess")
        return things, len(heat.factors) > 1 or not isinstance(heat.lead, NearThings)

    def _rooms(self, heat: Heatmap) -> list[Destination]:
        if [(one.part.modality, one.part.query.removesuffix("s")) for one in heat.factors] != [(Modality.AREA, "room")]:
            return []
        places = [(room.name, self.avlmap.space.level(np.array(room.position))) for room in self.avlmap.where.rooms]
        return [Destination(name, Outline.at(place[:2]), place) for name, place in places]

    def _near_first(self, things: list[Destination], found_at: float) -> list[Destination]:
        storeys = self.avlmap.storeys
        if storeys is None:
            return things
        on = storeys.of(np.array([thing.place[2] for thing in things]))
        own = [thing for thing, number in zip(things, on.tolist(), strict=True) if number == self._storey]
        if not own or len(own) == len(things) or own[0].probability < found_at:
            return things
        name = storeys[self._storey].name
        others = len(things) - len(own)
        self.note(f"{others} of {len(things)} places for {own[0].name} are on other storeys; those of the {name} count")
        return own

    def finds(self, target: Target) -> bool:
        """Return whether the map has something that a target may mean; a guess is nothing."""
        if isinstance(target, Place):
            return True
        try:
            heat = self._heat_of(target, "look for")
        except GoalNotFoundError:
            return False
        return bool(heat.found)

    def _heat_of(self, target: Target, purpose: str) -> Heatmap:
        if isinstance(target, str):
            return self._named("object", target, True, lambda name: self.avlmap.object(name, primary=True))
        if not isinstance(target, Heatmap):
            raise ProgramError(f"A skill takes a phrase, a place or a heatmap to {purpose}, not {kind_of(target)}.")
        return target

    def place_of(self, target: Target) -> Place:
        """Return the place of the thing that a target means; a later skill finds the thing again at that place."""
        return self._handed(self.best(target))

    def place_of_thing(self, thing: Destination) -> Place:
        """Return the place of one thing; a skill that is given this place knows the thing with its outline."""
        place = self._handed(thing)
        self._instances.add(place)
        return place

    def every(self, target: Target, here: Float[np.ndarray, "2"]) -> list[Destination]:
        """Return all things that a target may mean, the nearest first."""
        things, one = self._candidates(target)
        chosen = likely(things, one) if not one else things
        return sorted(chosen, key=lambda thing: float(np.linalg.norm(thing.outline.nearest_to(here) - here)))

    def nth(self, target: Target, here: Float[np.ndarray, "2"], number: int, order: str) -> Destination:
        """Return a thing that a target may mean by its number, from 1, in an order; see `Robot.get_nth_pos`."""
        things = self.every(target, here)
        ahead = np.mean([thing.outline.centre for thing in things], axis=0) - here
        sides = {"left": (-ahead[1], ahead[0]), "right": (ahead[1], -ahead[0])} | _SIDES
        if order in sides:
            things.sort(key=lambda thing: -float(thing.outline.centre @ np.array(sides[order])))
        elif order == "farthest":
            things.reverse()
        elif order != "nearest":
            raise ProgramError(f"get_nth_pos counts from nearest, farthest, {', '.join(sides)}, not {order!r}.")
        if not 1 <= number <= len(things):
            name = things[0].name or "place"
            raise GoalNotFoundError(f"The map has {len(things)} of {name}, so that number {number} is not found.")
        return self._chosen(things[number - 1], len(things))

    def _handed(self, thing: Destination) -> Place:
        x, y, z = (float(value) for value in self.avlmap.space.world(thing.place))
        place = Place(x, y, z)
        self._handed_out[place] = thing
        return place

    def note(self, note: str) -> None:
        """Store a note, once, and report it."""
        if note and note not in self.notes:
            self.notes.append(note)
            self._tell(f"note: {note}")

    def _note(self, heat: Heatmap) -> None:
        self.note(heat.factors[0].note)

    def _chosen(self, thing: Destination, of: int) -> Destination:
        place = place_text(self.avlmap.space.world(thing.place))
        line = f"{thing.name}: at {place}, probability {thing.probability:.2f}"
        if thing.name and not self._last_line.startswith(line):
            spread = "" if thing.spread is None else f", {thing.spread.around('there')}"
            self._last_line = line + spread + (f", one of {of}" if of > 1 else "")
            self._tell(self._last_line)
        return thing
