"""What can be chosen about a query, and the paper's rules (docs/paper-models.md): where our choices differ."""

from dataclasses import dataclass, field, replace
from typing import Literal

from avlmaps.core.errors import QueryError
from avlmaps.core.numbers import hold_numbers
from avlmaps.core.question import HeardAt, Role
from avlmaps.maps.fusion.sensor import PAPERS_VARIANCE_M2
from avlmaps.maps.settings import DEFAULTS, BuildSettings, HearingSettings, SegmentationSettings

# From this probability on a query is found (``QuerySettings.found_at``), and a part of it by itself: an instance, a
# sound, a view, the place of a photo.
FOUND_AT = 0.5
FEWEST_VIEWS = 2
"""A room is listed where at least this many keyframes show it."""
LEAST_PART = 0.2
"""A kind of room is a part of an open plan from this share of its floor on."""


@dataclass(frozen=True, slots=True)
class HeatSettings:
    """How fast heat falls with distance (the paper's 0.1 and 0.01 a voxel of 5 cm)."""

    primary_falloff_per_m: float = 2.0  # for what is sought: reaches 0.5 m
    context_falloff_per_m: float = 0.2  # for what says where it is: reaches 5 m

    def falloff_per_m(self, role: Role) -> float:
        """Return ε for a role."""
        return self.primary_falloff_per_m if role is Role.PRIMARY else self.context_falloff_per_m


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """From a word to instances."""

    same_word_cosine: float = 0.95
    """A vocabulary word at least this close to the queried one names the same thing and does not compete with it."""
    least_score: float = 0.5  # for an encoder that has no feature for "other": a voxel must score at least this
    margin_yes: float = 0.1  # an instance that wins its voxels by this much on average is as likely right as wrong
    margin_yes_logits: float = 1.0
    """The same for an encoder with a scale for its cosines: the margin times its ``logit_scale``."""
    area_yes_m2: float = 0.01  # surface below which an instance is probably noise; a mug shows about 0.02 m²
    least_confidence: float = 0.3
    """Instances below this are noise (one or two voxels of 5 cm) and give no heat; 0 admits all, as the paper does."""
    # The least where the query has context: then a weak instance there is likelier than a confident one elsewhere.
    least_in_company: float = 0.02
    score_in_company: float = 0.5
    """And there a voxel counts that scores at least this part of its best rival's score, for an encoder of names."""
    least_score_in_company: float = 0.0  # and at least this, a score of its own
    guess_below: float = 0.05
    """Where the best of these is less confident, weaker voxels give the guess, for an encoder of names."""
    score_for_guess: float = 0.2
    """Then a voxel counts that scores at least this part of its best rival's score, and ``least_for_guess``."""
    least_for_guess: float = 0.1  # a score, √p: 0.1 is a probability of 1 %
    room_weight: float = 0.75
    """How much the kind of room that a thing stands in counts, for an encoder of names: the thing's log-odds rise by
    this times ln of how many times as common it is in such rooms. 0: not at all. It and the next were chosen on eight
    development homes."""
    room_cost: float = 0.4  # nats that the log-odds lose with that: most things stand where things of their name do
    too_long: float = 1.5
    """An instance this many times as long as the largest thing of its name is cut where its voxels score least, and
    is less likely to be what it is called, for an encoder of names; 0: never."""
    link_m: float = 0.1  # voxels of an object no farther apart than this along every axis belong to one instance
    join_m: float = 0.3
    """Pieces over one another with no larger gap in height are one thing (the legs and the back of a chair)."""


@dataclass(frozen=True, slots=True)
class RoomSettings:
    """From views and things to kinds of room. Chosen on six development homes."""

    views_m: float = 0.8  # standard deviation of how far a view's vote spreads from the middle of what it saw, metres
    view_weight: float = 1.5
    """Exponent of the views' mean where two or more of them vote; an average is less confident than views that agree
    should be. A lone view counts once."""
    things_m: float = 1.6  # standard deviation of how far the vote of a thing spreads from it, metres
    thing_weight: float = 2.0
    """Weight of the things' votes, in nats a square metre of their surface; 0 lets views vote alone."""
    most_nats: float = 6.0
    """All things at a place speak for one kind of room before another by less: voxels side by side are one thing."""


@dataclass(frozen=True, slots=True)
class AreaSettings:
    """From views to heat."""

    anchor: Literal["camera", "centre"] = "centre"
    """Where a keyframe's heat falls from: the camera (the paper), or the middle of what the camera saw (things are
    found in the right place for 45 % of 191 tasks, with the camera's place for 35 %)."""
    extent: Literal["rooms", "cones"] = "rooms"
    """How far an area's heat reaches. ``rooms``: views and things vote on the kind of room of every place, up to the
    walls (``rooms.py``). ``cones`` (the paper): heat falls off round every keyframe, through walls."""
    score: Literal["posterior", "min-max"] = "posterior"
    """``posterior`` asks how likely the name is among all area names; ``min-max`` stretches the cosines (the paper)."""
    temperature: float | None = None
    """Of the posterior: a cosine higher by this makes a name e times as likely. By default what the encoder learnt
    (1 / ``logit_scale``), and 0.05 for one without such a scale."""
    same_word_cosine: float = 0.95
    """Another name at least this close to the queried one names the same and does not compete with it. For an encoder
    with a scale it is measured from the middle of all names: its phrases lie in a cone, kitchen beside garage."""
    link_m: float = 1.0  # keyframes closer than this to a better one belong to its area
    rooms: RoomSettings = field(default_factory=RoomSettings)
    """Of ``rooms``: the weights of views and things, and how far they reach."""


@dataclass(frozen=True, slots=True)
class SoundSettings:
    """From scores to heat."""

    normalise: Literal["none", "min-max"] = "none"
    """``none`` takes the encoder's calibrated scores; ``min-max`` stretches them over the heard sounds (the paper)."""
    at: HeardAt | None = None
    """Where the heat of every sound is: where the robot was when it heard it (the paper), or where it came from. None:
    where a query says, else where the robot was."""
    prior: Literal["lexicon", "none"] = "lexicon"
    """Whether things that usually make a sound count as its source, besides what the microphones say."""


@dataclass(frozen=True, slots=True)
class QuerySettings:
    """Everything about a query that can be chosen."""

    heat: HeatSettings = field(default_factory=HeatSettings)  # how fast heat falls
    objects: ObjectSettings = field(default_factory=ObjectSettings)  # from a word to instances
    sounds: SoundSettings = field(default_factory=SoundSettings)  # from a sound's scores to heat
    areas: AreaSettings = field(default_factory=AreaSettings)  # from views to heat
    found_at: float = FOUND_AT
    """A query is found where its first goal is right with at least this probability, all parts together; in [0, 1]."""
    seed: int = 0  # seed of what is drawn at random when a picture is located

    def __post_init__(self) -> None:
        hold_numbers(self, QueryError)
        if not 0.0 <= self.found_at <= 1.0:
            raise QueryError(f"A query cannot be found at a probability of {self.found_at:g}; it lies between 0 and 1.")


Rules = Literal["ours", "paper"]


# A sample beyond a fixed threshold is sound, a pause of a second divides two sounds, nothing is widened or cleaned.
# The published code's threshold is 0: its tracks are silent between the clips. No microphone's track is, nor ours, and
# with 0 such a track is one sound. The noise of our rooms peaks at 0.018 of full scale.
PAPER_HEARING = HearingSettings(
    segmentation=SegmentationSettings(
        method="silence", silence_threshold=0.02, silence_s=1.0, min_length_s=0.0, max_length_s=86_400.0, padding_s=0.0
    ),
    noise_reduction_db=0.0,
    cut="energy",
)


# Heat falls from the camera, through walls; cosines are stretched; each view speaks for itself, and things do not.
PAPER_AREAS = AreaSettings(anchor="camera", extent="cones", score="min-max")


# Scores are stretched over the sounds of the map; no words change that each is where the robot was.
PAPER_SOUNDS = SoundSettings(normalise="min-max", at="robot")


# A voxel is the object where its word is the closest of all; no instance is left out for its confidence; its room
# and its size have no say.
PAPER_OBJECTS = ObjectSettings(
    least_confidence=0.0, least_in_company=0.0, score_in_company=1.0, guess_below=0.0, room_weight=0.0, too_long=0.0
)


def build_settings(rules: Rules, settings: BuildSettings = DEFAULTS) -> BuildSettings:
    """Return the settings of a build with the parts replaced that the rules decide."""
    if rules == "ours":
        return settings
    fusion = replace(settings.fusion, weight_variance_m2=PAPERS_VARIANCE_M2, sensor="none")
    frames = replace(settings.frames, look_m=0.0, look_deg=0.0)
    return replace(settings, frames=frames, fusion=fusion, hearing=PAPER_HEARING)


def query_settings(rules: Rules, settings: QuerySettings | None = None) -> QuerySettings:
    """Return the settings of a query with the parts replaced that the rules decide."""
    settings = settings or QuerySettings()
    if rules == "ours":
        return settings
    return replace(settings, objects=PAPER_OBJECTS, sounds=PAPER_SOUNDS, areas=PAPER_AREAS)


def rules_of(built_with: BuildSettings) -> Rules:
    """Return the rules that a map was built by, from the settings in its manifest; old ones say nothing of looks."""
    return "paper" if replace(build_settings("paper", built_with), frames=built_with.frames) == built_with else "ours"
