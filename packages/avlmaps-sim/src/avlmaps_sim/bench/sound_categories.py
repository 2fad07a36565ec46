"""The categories of clip collections, and the kind of the embedded sound encoder for each one.

A category that is not a key here is looked up among the kinds' own names; else it is unknown to the encoder.
"""

# The categories of ESC-50 (Piczak 2015) that our kinds name otherwise.
_OTHERWISE = {
    "cat": "cat meowing", "chirping birds": "birds chirping", "clock alarm": "alarm clock", "cow": "cow mooing",
    "crow": "crow cawing", "door wood creaks": "creaking door", "door wood knock": "door knock",
    "drinking sipping": "drinking or sipping", "engine": "car engine", "frog": "frog croaking", "hen": "hen clucking",
    "insects": "buzzing insects", "pig": "pig grunting", "sheep": "sheep bleating", "thunderstorm": "thunder",
}  # fmt: skip
# With those that are named alike they are the forty that are not in ESC-10.
ESC50 = _OTHERWISE | {name: name for name in (
    "airplane", "breathing", "brushing teeth", "can opening", "car horn", "church bells", "clapping", "coughing",
    "crickets", "fireworks", "footsteps", "glass breaking", "hand saw", "keyboard typing", "laughing", "mouse click",
    "pouring water", "siren", "snoring", "toilet flush", "train", "vacuum cleaner", "washing machine", "water drops",
    "wind",
)}  # fmt: skip
# The categories of other collections.
CATEGORIES = ESC50 | {
    "applause": "clapping", "car engine": "car engine", "crowd cheering": "crowd cheering",
    "door open close": "door opening or closing", "footsteps gravel": "footsteps", "footsteps hard": "footsteps",
    "footsteps metal": "footsteps", "footsteps wood": "footsteps", "piano": "piano", "running water": "running water",
    "thunder": "thunder", "wood chop": "chopping wood",
}  # fmt: skip
ESC10 = (
    "chainsaw", "clock tick", "crackling fire", "crying baby", "dog bark", "helicopter", "rain", "rooster", "sea waves",
    "sneezing",
)  # fmt: skip
