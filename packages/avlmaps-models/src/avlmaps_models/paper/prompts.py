"""The sentences that the published system puts a thing's name into, and the names that it distinguishes.

A name is encoded in each of 63 sentences and the mean is its feature, as the code of VLMaps and AVLMaps does it
(``multiple_templates`` there). The sentences are the well-known ones that were published with CLIP and ViLD; they are
put together here from their parts. "A picture of of" is what the published list says, and so what parity needs.
"""

_BARE_AND_THE = ("", "the ")
_A_AND_THE = ("a ", "the ")
_SEEN_BADLY_OR_WELL = ("good", "bad", "bright", "dark", "low resolution", "cropped", "close-up", "jpeg corrupted")
_LIKE = ("nice", "cool", "weird", "small", "large", "clean", "dirty", "hard to see")
_MADE_AS = (("a", "plastic"), ("a", "toy"), ("a", "plushie"), ("a", "cartoon"), ("an", "embroidered"))


def _published() -> tuple[str, ...]:
    in_scene = [f"There is {article}{{}} in the scene." for article in _BARE_AND_THE]
    in_scene += [f"a photo of {which}{{}} in the scene." for which in ("", "the ", "one ")]
    taken = [f"I took a picture of of {whose}{{}}." for whose in ("", "my ", "the ")]
    plain = [f"a photo of {which}{{}}." for which in ("", "my ", "the ", "one ", "many ")]
    like = [f"a photo of {article}{how} {{}}." for how in _LIKE for article in _A_AND_THE]
    kinds = (*_SEEN_BADLY_OR_WELL, "blurry", "pixelated", "black and white")
    seen = [f"a {how} photo of {article}{{}}." for how in kinds for article in _BARE_AND_THE]
    made = [f"{article} {how} {{}}." for first, how in _MADE_AS for article in (first, "the")]
    painted = [f"a painting of {article}{{}}." for article in ("the ", "a ")]
    return (*in_scene, *taken, *plain, *like, *seen, *made, *painted)


THING_PROMPTS = _published()
"""The 63 sentences for things."""

AREA_PROMPTS = ("{}",)
"""The published code queries areas by their bare name."""

THINGS = tuple(
    """wall floor chair door table picture cabinet cushion window sofa bed curtain chest_of_drawers plant sink stairs
    ceiling toilet stool towel mirror tv_monitor shower column bathtub counter fireplace lighting beam railing shelving
    blinds gym_equipment seating board_panel furniture appliances clothes""".replace("\n", " ").split()
)
"""The competitors for a voxel in the published maps: Matterport3D's classes, without ``void`` and ``objects``."""

VOCABULARY = tuple(name.replace("_", " ") for name in THINGS)
"""The same as people write them; the published code encodes the underscores of five of them, too."""
