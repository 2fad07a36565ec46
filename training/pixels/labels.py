"""What the network tells apart. The order is that of its outputs, so new names go to the end."""

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
)  # fmt: skip

ROOMS = (
    "kitchen", "bathroom", "bedroom", "living room", "dining room", "office", "hallway", "laundry room",
    "children's room", "gym", "storage room", "entrance hall", "open-plan office", "meeting room", "reception",
    "copy room",
)  # fmt: skip

# What homes and offices call their areas, where it is not the name above.
ROOM_OF_AREA = {
    "study": "office", "storage": "storage room", "corridor": "hallway", "toilet": "bathroom", "toilets": "bathroom",
    "kitchenette": "kitchen", "copy corner": "copy room", "lounge": "living room",
}  # fmt: skip

UNLABELLED = 255
