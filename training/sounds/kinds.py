"""Every kind of sound the encoder learns, and what else it is called, from the project's lexicon.

The first name of a kind is the one that answers give. The others stand beside it when a question is compared with the
known kinds; the paraphrases by which the encoder is tested (``avlmaps_sim/bench/data/sounds_paraphrases.csv``) are
none of them.
"""

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.bench import sound_clips
from avlmaps_sim.bench.sound_clips import CATEGORIES, ESC50

# Every kind that ``avlmaps_sim.synthesis`` makes; most of them have one to eight real clips as well.
_MADE = (
    "door knock", "door opening or closing", "creaking door", "glass breaking", "dishes clattering", "can opening",
    "vacuum cleaner", "hair dryer", "fan or air conditioner", "washing machine", "blender", "electric drill",
    "alarm clock", "smoke alarm", "microwave beep", "doorbell", "phone ringing", "keyboard typing", "mouse click",
    "footsteps", "running water", "water drops", "pouring water", "toilet flush", "kettle boiling", "frying",
    "brushing teeth", "piano", "television or music", "cat meowing", "cow mooing", "sheep bleating", "pig grunting",
    "hen clucking", "crow cawing", "frog croaking", "birds chirping", "crickets", "buzzing insects",
    "owl or pigeon", "mouse squeaking", "laughing", "talking", "coughing", "breathing", "snoring", "clapping",
    "crowd cheering", "drinking or sipping", "whistling", "children playing", "thunder", "wind", "siren",
    "car horn", "car engine", "train", "airplane", "church bells", "fireworks", "hand saw", "chopping wood",
    "hammering", "bicycle bell",
)  # fmt: skip
# Names of two sounds in one that nobody says: the other names stand for them.
_UNSPOKEN = frozenset({"fan or air conditioner", "television or music", "drinking or sipping", "owl or pigeon"})


def _called(name: str) -> tuple[str, ...]:
    entry = lexicon().named(name, EntryKind.SOUND)
    return entry.learnt if name in _UNSPOKEN else (name, *entry.learnt)


ESC10: dict[str, tuple[str, ...]] = {name: _called(name) for name in sound_clips.ESC10}  # about 32 clips each
MADE: dict[str, tuple[str, ...]] = {name: _called(name) for name in _MADE}

TEMPLATES = ("{}", "the sound of {}", "a recording of {}", "{} sound", "the noise of {}")
HOUSEHOLD = {name: called for name, called in MADE.items() if name in ESC50.values()}  # kinds with a few real clips
SYNTHESISED = {name: called for name, called in MADE.items() if name not in HOUSEHOLD}  # kinds without any
RECORDED: dict[str, tuple[str, ...]] = ESC10 | HOUSEHOLD
KINDS: dict[str, tuple[str, ...]] = RECORDED | SYNTHESISED
NAMES = tuple(KINDS)
CALLED = tuple(called[0] for called in KINDS.values())


def kind_of(category: str) -> int:
    """Return the index in ``NAMES`` of a category of the index of clips, or -1 for one that is not learnt."""
    name = CATEGORIES.get(category, category)
    return NAMES.index(name) if name in KINDS else -1
