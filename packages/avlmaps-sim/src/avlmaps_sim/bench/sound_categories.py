"""The categories of clip collections, and the kind of the embedded sound encoder for each one.

A category that is not a key here is looked up among the kinds' own names; else it is unknown to the encoder.
"""

# The forty categories of ESC-50 (Piczak 2015) that are not in ESC-10.
ESC50 = {
    "cat": "cat meowing",
    "chirping birds": "birds chirping",
    "clock alarm": "alarm clock",
    "cow": "cow mooing",
    "crow": "crow cawing",
    "door wood creaks": "creaking door",
    "door wood knock": "door knock",
    "drinking sipping": "drinking or sipping",
    "engine": "car engine",
    "frog": "frog croaking",
    "hen": "hen clucking",
    "insects": "buzzing insects",
    "pig": "pig grunting",
    "sheep": "sheep bleating",
    "thunderstorm": "thunder",
    "airplane": "airplane",
    "breathing": "breathing",
    "brushing teeth": "brushing teeth",
    "can opening": "can opening",
    "car horn": "car horn",
    "church bells": "church bells",
    "clapping": "clapping",
    "coughing": "coughing",
    "crickets": "crickets",
    "fireworks": "fireworks",
    "footsteps": "footsteps",
    "glass breaking": "glass breaking",
    "hand saw": "hand saw",
    "keyboard typing": "keyboard typing",
    "laughing": "laughing",
    "mouse click": "mouse click",
    "pouring water": "pouring water",
    "siren": "siren",
    "snoring": "snoring",
    "toilet flush": "toilet flush",
    "train": "train",
    "vacuum cleaner": "vacuum cleaner",
    "washing machine": "washing machine",
    "water drops": "water drops",
    "wind": "wind",
}
# The categories of other collections.
CATEGORIES = ESC50 | {
    "applause": "clapping",
    "car engine": "car engine",
    "crowd cheering": "crowd cheering",
    "door open close": "door opening or closing",
    "footsteps gravel": "footsteps",
    "footsteps hard": "footsteps",
    "footsteps metal": "footsteps",
    "footsteps wood": "footsteps",
    "piano": "piano",
    "running water": "running water",
    "thunder": "thunder",
    "wood chop": "chopping wood",
}
ESC10 = (
    "chainsaw", "clock tick", "crackling fire", "crying baby", "dog bark", "helicopter", "rain", "rooster", "sea waves",
    "sneezing",
)  # fmt: skip
