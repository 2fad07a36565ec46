"""Every kind of sound the encoder learns, and what else it is called, from the project's lexicon.

The order is that of the network's outputs, so new names go to the end. The first name of a kind is the one that
answers give. The others stand beside it when a question is compared with the known kinds; the paraphrases by which the
encoder is tested (``avlmaps/bench/data/sounds_paraphrases.csv``) are none of them.
"""

from avlmaps.core.lexicon import Kind, lexicon

_RECORDED = (
    "chainsaw", "clock tick", "crackling fire", "crying baby", "dog bark", "helicopter", "rain", "rooster",
    "sea waves", "sneezing",
)  # fmt: skip
_SYNTHESISED = (
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
    entry = lexicon().named(name, Kind.SOUND)
    return entry.learnt if name in _UNSPOKEN else (name, *entry.learnt)


RECORDED: dict[str, tuple[str, ...]] = {name: _called(name) for name in _RECORDED}
SYNTHESISED: dict[str, tuple[str, ...]] = {name: _called(name) for name in _SYNTHESISED}

TEMPLATES = ("{}", "the sound of {}", "a recording of {}", "{} sound", "the noise of {}")
KINDS: dict[str, tuple[str, ...]] = RECORDED | SYNTHESISED
NAMES = tuple(KINDS)
CALLED = tuple(called[0] for called in KINDS.values())
