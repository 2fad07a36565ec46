"""The names that the network distinguishes. The order is that of its outputs, so new names go to the end."""

from avlmaps.core.lexicon import EntryKind, lexicon

CATEGORIES = (
    "wall", "floor", "ceiling", "column", "stairs", "railing",
    "chair", "armchair", "office chair", "stool", "bench", "sofa", "ottoman",
    "dining table", "coffee table", "desk", "side table", "console table",
    "bed", "crib", "bunk bed", "nightstand",
    "wardrobe", "chest of drawers", "bookshelf", "cabinet", "tv cabinet", "shoe rack", "wall shelf", "filing cabinet",
    "coat rack",
    "kitchen counter", "kitchen cabinet", "kitchen island", "refrigerator", "stove", "microwave", "dishwasher",
    "range hood", "kettle", "toaster", "coffee machine",
    "sink", "toilet", "bathtub", "shower", "mirror", "towel",
    "washing machine", "radiator", "air conditioner", "fan", "vacuum cleaner", "fireplace", "ironing board",
    "water heater",
    "tv", "monitor", "laptop", "computer", "printer", "loudspeaker", "keyboard", "telephone", "clock",
    "picture", "lamp", "chandelier", "curtain", "carpet", "plant", "vase", "cushion", "blinds", "candle",
    "door", "window", "folding door",
    "book", "bottle", "cup", "bowl", "pot", "box", "basket", "trash can", "bag", "toy", "shoes", "laundry basket",
    "tableware",
    "piano", "guitar", "fitness equipment", "dumbbell", "ball", "bicycle", "pool table", "rocking horse",
    "baby stroller", "mat", "play tent", "aquarium", "pet bed",
    "whiteboard", "partition", "locker", "water dispenser",
    "other",
    # Homes hold none of these; training worlds add them (``sim/homes/lived_in.py``).
    "clothing", "paper", "person", "shower curtain",
    # Small things by other hands (``things.py``).
    "plate", "drinking glass", "can", "food", "fruit", "cutlery", "pan", "jug", "chopping board", "knife block",
    "mobile phone", "remote control", "tablet", "headphones", "camera", "games console", "backpack", "suitcase",
    "umbrella", "hat", "key", "eyeglasses", "scissors", "tool", "flashlight", "medicine", "soap", "toilet paper",
    "brush", "broom", "fire extinguisher", "power socket", "light switch", "smoke detector", "racket", "stapler",
    "pen", "blender", "computer mouse",
)  # fmt: skip

ROOMS = (
    "kitchen", "bathroom", "bedroom", "living room", "dining room", "office", "hallway", "laundry room",
    "children's room", "gym", "storage room", "entrance hall", "open-plan office", "meeting room", "reception",
    "copy room",
)  # fmt: skip

UNLABELLED = 255
# Labels of real frames from here on are coarse: class c of ``avlmaps_sim.bench.frames.CLASSES`` is FIRST_COARSE + c.
FIRST_COARSE = 160


def room_of(area: str) -> str:
    """Return the room of ``ROOMS`` that an area is, or ``""``: what homes call a study is an office."""
    known = lexicon()
    for entry in known.senses(area, EntryKind.ROOM):
        for name in (entry.name, *(wide.name for wide in known.wider(entry.name, EntryKind.ROOM))):
            if name in ROOMS:
                return name
    return ""
