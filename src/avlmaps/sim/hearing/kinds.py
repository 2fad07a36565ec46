"""Which things make which sounds: tables of household sounds, by the names that collections and our rules give them."""

from dataclasses import dataclass

ANYWHERE = ("*",)


@dataclass(frozen=True, slots=True)
class SoundKind:
    """A kind of sound and where a home has it.

    Attributes:
        names: what clips of it are called; the first is ours.
        objects: categories of objects that make it, the likeliest first.
        floor: kinds of rooms in which it is also heard where nothing that makes it stands; ``("*",)``: in any.
        height_m: height over the floor there.
        level_db: loudness at 1 m against other kinds.
        indoors: whether homes make it; sounds from outdoors come in by the windows and only when asked for.
    """

    names: tuple[str, ...]
    objects: tuple[str, ...] = ()
    floor: tuple[str, ...] = ()
    height_m: float = 1.0
    level_db: float = 0.0
    indoors: bool = True


_WET = ("bathroom", "kitchen", "kitchenette", "laundry room")
_DESKS = ("office", "open-plan office", "copy room")
_CHILD = ("children's room", "bedroom")
_SCREEN = ("tv", "loudspeaker", "computer", "laptop")
_CALLS = ("hallway", "reception")
_OUTSIDE = ("window",)

KINDS: tuple[SoundKind, ...] = (
    SoundKind(("running water", "water tap", "tap"), ("sink", "bathtub", "shower"), _WET, 1.0),
    SoundKind(("water drops", "dripping water"), ("sink", "bathtub", "shower"), _WET, 0.9, -6.0),
    SoundKind(("pouring water",), ("sink", "kitchen counter", "dining table"), ("kitchen",), 1.0, -3.0),
    SoundKind(("brushing teeth",), ("sink",), ("bathroom",), 1.3, -4.0),
    SoundKind(("toilet flush",), ("toilet",), ("bathroom", "toilet"), 0.7),
    SoundKind(("hair dryer",), ("mirror", "sink"), ("bathroom",), 1.3, 2.0),
    SoundKind(("microwave beep", "microwave"), ("microwave",), ("kitchen",), 1.2),
    SoundKind(("kettle boiling", "kettle", "kettle whistle"), ("kettle", "stove"), ("kitchen",), 1.0),
    SoundKind(("frying", "frying food"), ("stove",), ("kitchen",), 1.0, -3.0),
    SoundKind(("blender",), ("kitchen counter", "kitchen island"), ("kitchen",), 1.0, 4.0),
    SoundKind(("dishes clattering", "dishes"), ("dishwasher", "kitchen counter", "dining table"), ("kitchen",), 1.0),
    SoundKind(("can opening",), ("refrigerator", "kitchen counter", "dining table"), ("kitchen",), 1.0, -2.0),
    SoundKind(("drinking or sipping", "drinking sipping"), ("dining table", "coffee table"), ("kitchen",), 1.1, -6.0),
    SoundKind(("washing machine",), ("washing machine",), ("laundry room", "bathroom"), 0.5),
    SoundKind(("vacuum cleaner",), ("vacuum cleaner",), ANYWHERE, 0.3, 4.0),
    SoundKind(("fan or air conditioner", "fan", "air conditioner"), ("fan", "air conditioner"), (), 1.5, -4.0),
    SoundKind(("crackling fire",), ("fireplace",), (), 0.5, -2.0),
    SoundKind(("door knock", "door wood knock", "knock"), ("door", "folding door"), (), 1.3),
    SoundKind(("door opening or closing", "door open close"), ("door", "folding door"), (), 1.0, 2.0),
    SoundKind(("creaking door", "door wood creaks"), ("door", "folding door", "wardrobe"), (), 1.0, -3.0),
    SoundKind(("doorbell",), ("door",), (), 1.8, 2.0),
    SoundKind(("chest open close",), ("chest of drawers", "wardrobe", "cabinet"), (), 0.8, -2.0),
    SoundKind(("clock tick", "ticking clock"), ("clock",), (), 1.6, -8.0),
    SoundKind(("alarm clock", "clock alarm"), ("clock", "nightstand", "bed"), ("bedroom",), 0.6, 2.0),
    SoundKind(("smoke alarm",), (), ("hallway", "kitchen"), 2.3, 4.0),
    SoundKind(("phone ringing", "telephone", "telephone ring"), ("telephone", "desk", "side table"), _CALLS, 0.9),
    SoundKind(("keyboard typing", "typing"), ("keyboard", "computer", "laptop", "desk"), _DESKS, 0.8, -5.0),
    SoundKind(("mouse click", "mouse clicking"), ("computer", "laptop", "desk"), _DESKS, 0.8, -8.0),
    SoundKind(("television or music", "television", "music"), _SCREEN, ("living room",), 1.0),
    SoundKind(("piano",), ("piano",), (), 1.0, 2.0),
    SoundKind(("guitar",), ("guitar",), ("living room",), 0.8),
    SoundKind(("crying baby", "baby crying"), ("crib", "baby stroller"), _CHILD, 0.6, 4.0),
    SoundKind(("snoring",), ("bed", "bunk bed", "sofa"), ("bedroom",), 0.6, -3.0),
    SoundKind(("breathing",), ("bed", "sofa"), ("bedroom",), 0.6, -8.0),
    SoundKind(("dog bark", "dog", "dog barking"), ("pet bed",), ANYWHERE, 0.4, 4.0),
    SoundKind(("cat meowing", "cat"), ("pet bed", "sofa"), ANYWHERE, 0.3),
    SoundKind(("mouse squeaking",), (), ("kitchen", "storage"), 0.1, -6.0),
    SoundKind(("buzzing insects", "insects"), ("plant", "lamp"), ANYWHERE, 1.5, -6.0),
    SoundKind(("glass breaking",), ("dining table", "kitchen counter", "window"), ANYWHERE, 0.2, 3.0),
    SoundKind(("footsteps", "footsteps hard", "footsteps wood", "footsteps metal"), (), ANYWHERE, 0.1, -3.0),
    SoundKind(("coughing",), ("bed", "sofa", "armchair"), ANYWHERE, 1.4),
    SoundKind(("sneezing",), ("bed", "sofa", "armchair"), ANYWHERE, 1.4, 2.0),
    SoundKind(("laughing",), ("sofa", "dining table"), ANYWHERE, 1.4),
    SoundKind(("talking", "speech"), ("sofa", "dining table"), ANYWHERE, 1.4),
    SoundKind(("whistling",), (), ANYWHERE, 1.5),
    SoundKind(("clapping", "applause"), ("tv",), ANYWHERE, 1.2),
    SoundKind(("children playing",), ("toy", "play tent", "bunk bed"), _CHILD, 0.7, 2.0),
    SoundKind(("electric drill",), (), ("garage", "storage", "laundry room"), 1.2, 4.0),
    SoundKind(("hammering",), ("picture",), ("garage", "storage", "gym"), 1.5, 3.0),
    SoundKind(("hand saw",), (), ("garage", "storage", "gym"), 0.8, 2.0),
    SoundKind(("bicycle bell",), ("bicycle",), ("garage", "hallway", "storage"), 1.0),
    SoundKind(("crowd cheering",), _SCREEN, ("living room",), 1.0, indoors=False),
    SoundKind(("rain",), _OUTSIDE, ANYWHERE, 1.5, indoors=False),
)

_BY_NAME = {name: kind for kind in KINDS for name in kind.names}
_OUTDOORS = SoundKind(("",), _OUTSIDE, ANYWHERE, 1.5, indoors=False)


def kind_of(name: str) -> SoundKind:
    """Return the kind of a sound by its name; one that no home makes comes in by the windows, or from anywhere."""
    return _BY_NAME.get(" ".join(name.replace("_", " ").lower().split()), _OUTDOORS)
