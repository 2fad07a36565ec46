"""The three ranges of sounds that goals are drawn from, each wider than the one before, as in the paper's Table I."""

from avlmaps_sim.hearing.kinds import kind_of

# Sounds of people and of animals, by the names of our rules and of ESC-50. All others are of the house itself.
HUMAN = frozenset({
    "breathing", "brushing teeth", "children playing", "clapping", "coughing", "crowd cheering", "crying baby",
    "drinking or sipping", "footsteps", "laughing", "sneezing", "snoring", "talking", "whistling",
})  # fmt: skip
ANIMAL = frozenset({"buzzing insects", "cat meowing", "dog bark", "mouse squeaking"})
WIDEST = 3


def range_of(sound: str) -> int:
    """Return the narrowest range with a sound: 1 domestic, 2 human as well, 3 animals and the outdoors as well."""
    kind = kind_of(sound)
    names = {sound, *kind.names}
    if names & HUMAN:
        return 2
    return WIDEST if names & ANIMAL or not kind.indoors else 1
