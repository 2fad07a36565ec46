"""Bare nouns: "sofa, then kitchen", "fridge, please".

Without article and verb any word could be a verb that is not known, so only the names that a home or an office is full
of are taken as things to go to; "dance" stays what is not understood.
"""

import json
import re
from functools import cache
from importlib.resources import files

from avlmaps.language.rules import words
from avlmaps.language.rules.sounds import SOUND_NOUNS, SOUND_VERBS
from avlmaps.language.sentence import AREA_WORDS

_THINGS = (
    "armchair", "bag", "ball", "basket", "bath", "bathtub", "bed", "bench", "bicycle", "bike", "bin", "blinds",
    "board", "book", "bookcase", "bookshelf", "bookshelves", "bottle", "bowl", "box", "bucket", "cabinet", "carpet",
    "chair", "chest", "clock", "closet", "coat", "coffee-table", "column", "computer", "cooker", "cot", "couch",
    "counter", "countertop", "cradle", "crib", "cup", "cupboard", "curtain", "curtains", "cushion", "desk",
    "dishwasher", "door", "doorway", "drawer", "dresser", "dryer", "fan", "faucet", "fireplace", "flower", "flowers",
    "freezer", "fridge", "heater", "jacket", "kettle", "keyboard", "ladder", "lamp", "laptop", "mattress",
    "microwave", "mirror", "monitor", "mug", "nightstand", "oven", "painting", "pan", "photocopier", "piano",
    "pillar", "pillow", "plant", "poster", "pot", "printer", "radiator", "rack", "refrigerator", "rug", "screen",
    "shelf", "shelves", "shower", "sideboard", "sink", "sofa", "staircase", "stairs", "stereo", "stool", "stove",
    "suitcase", "table", "tap", "telephone", "television", "toaster", "toilet", "towel", "toy", "trashcan",
    "treadmill", "tv", "umbrella", "vase", "wardrobe", "washbasin", "washer", "whiteboard", "window",
)  # fmt: skip
_PAIRS = (
    "trash can", "garbage can", "coffee machine", "coffee maker", "washing machine", "vending machine",
    "potted plant", "filing cabinet", "chest of drawers", "bedside table", "coffee table", "dining table",
    "kitchen table", "front door", "back door", "kitchen island", "water cooler", "fire extinguisher",
    "charging station", "living room", "dining room", "meeting room", "waiting room", "bath tub", "tv stand",
    "book shelf",
)  # fmt: skip
_KINDS = (
    "red", "green", "blue", "yellow", "black", "white", "brown", "grey", "gray", "orange", "purple", "pink", "beige",
    "big", "small", "large", "little", "tall", "low", "long", "round", "square", "wooden", "leather", "glass",
    "metal", "plastic", "old", "new", "left", "right", "front", "back", "double", "single", "empty", "open",
    "nearest", "closest",
)  # fmt: skip
_AREAS = sorted(AREA_WORDS - {"area", "zone", "room", "shop"})
_PLACES = r"(?= (?:near|next to|by|beside|close to|in|inside|on|at|under|where|behind|between)\b|$)"


@cache
def _forms() -> tuple[re.Pattern[str], re.Pattern[str], re.Pattern[str]]:
    name = _name()
    listed = rf"{name}(?:(?:\s*,\s*(?:and )?| and ){name})+"
    patterns = (
        rf"(?:and )?((?:{words.GO}) )?({name}){_PLACES}(.*)",
        rf"((?:{words.MOVE})(?: (?:over )?to)? |to )?({listed})",
        r"\s*,\s*(?:and )?| and ",
    )
    alone, several, comma = (re.compile(pattern, re.IGNORECASE) for pattern in patterns)
    return alone, several, comma


def with_articles(clause: str) -> str:
    """Return a clause with the articles that bare nouns lack."""
    alone, several, comma = _forms()
    found = several.fullmatch(clause)
    if found:
        return (found[1] or "") + ", ".join(f"the {name}" for name in comma.split(found[2]))
    found = alone.fullmatch(clause)
    if found:
        return f"{found[1]}to the {found[2]}{found[3]}" if found[1] else f"the {found[2]}{found[3]}"
    found = _sounds().fullmatch(clause)
    return f"the {clause}" if found else clause


def is_bare_name(text: str) -> bool:
    """Return whether a text ends in the name of a thing or a room that is known without article."""
    return re.search(rf"(?:^|\s){_name()}$", text, re.IGNORECASE) is not None


def is_name_alone(text: str) -> bool:
    """Return whether a text is such a name and nothing else."""
    return re.fullmatch(_name(), text, re.IGNORECASE) is not None


@cache
def _name() -> str:
    """Return the pattern of a known name, with what may stand before it."""
    names = sorted({*_THINGS, *_PAIRS, *_AREAS, *_seen()}, key=lambda name: (-len(name), name))
    return rf"(?:(?:{'|'.join([*_KINDS, *_AREAS])}) )*(?:{'|'.join(map(re.escape, names))})"


@cache
def _seen() -> frozenset[str]:
    """Return the names of things and rooms that the pixel encoder which ships knows, from its notes alone."""
    weights = files("avlmaps.perception.embedded") / "weights"
    notes = json.loads((weights / "scene_encoder.json").read_text(encoding="utf-8"))
    called = [name for other in notes["called"].values() for name in other]
    return frozenset({*notes["categories"], *notes["rooms"], *called, *notes["kinds"]} - {"other", "picture", "light"})


@cache
def _sounds() -> re.Pattern[str]:
    """Return the pattern of a sound without article: "sound of rain", "dog barking", "footsteps"."""
    heard = "|".join([rf"(?:{'|'.join(SOUND_VERBS)})[a-z]?ing", *sorted(SOUND_NOUNS)])
    alone = "applause|footsteps|laughter|music|thunder|siren|explosion|conversation|doorbell"
    return re.compile(
        rf"(?:sounds?|noises?) (?:of|like|made by) .+|{alone}|(?!(?:{words.MOVE}|{words.TURN}|{words.FACE}|"
        rf"{words.DETERMINER}|"
        rf"{words.MANIPULATE}|where|i|you|we|it)\b)[\w'-]+ (?:[\w'-]+ )?(?:{heard})(?: sound| noise)?",
        re.IGNORECASE,
    )
