"""Homes furnished by other hands: models of artists take the places of half of the pieces made by rule.

A folder holds the models, named as their artists named them; ``_MODELS`` says which of them are which category. A model
is stretched to the box of the piece whose place it takes, with its front where that of the piece is.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import patch
from zlib import crc32

import numpy as np

from avlmaps_sim.files.gltf import read_parts
from avlmaps_sim.furniture import catalogue
from avlmaps_sim.furniture.catalogue import Families, Piece
from avlmaps_sim.homes import furnish
from avlmaps_sim.mesh import Mesh, joined

# Of the pieces of a category with models this part is replaced.
SHARE = 0.6
# Space for what stands on top of a piece stays where the top of a model is flat, which that of these is.
_FLAT_TOPS = frozenset({
    "dining table", "coffee table", "desk", "side table", "nightstand", "chest of drawers", "tv cabinet", "cabinet",
})  # fmt: skip
_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_MODELS = {
    "chair": "chair chairCushion chairModernCushion chairModernFrameCushion "
    "chairRounded Chair_1 Chair_2 Chair_3 Chair_4",
    "office chair": "chairDesk",
    "armchair": "loungeChair loungeChairRelax loungeDesignChair Couch_Small1 Couch_Small2",
    "sofa": "loungeSofa loungeSofaLong loungeDesignSofa Couch_Large1 "
    "Couch_Large2 Couch_Large3 Couch_Medium1 Couch_Medium2",
    "ottoman": "loungeSofaOttoman",
    "stool": "stoolBar stoolBarSquare Stool",
    "bench": "bench benchCushion benchCushionLow",
    "dining table": "table tableCross tableGlass tableRound tableCloth tableCrossCloth Table_RoundLarge",
    "coffee table": "tableCoffee tableCoffeeGlass tableCoffeeGlassSquare tableCoffeeSquare",
    "side table": "sideTable sideTableDrawers Table_RoundSmall Table_RoundSmall2",
    "desk": "desk",
    "bed": "bedDouble bedSingle Bed_King Bed_Single",
    "bunk bed": "bedBunk Bed_Bunk",
    "nightstand": "cabinetBedDrawer cabinetBedDrawerTable cabinetBed NightStand_1 NightStand_2 NightStand_3",
    "chest of drawers": "Drawer_1 Drawer_2 Drawer_3 Drawer_4 Drawer_5",
    "bookshelf": "bookcaseOpen bookcaseOpenLow bookcaseClosed bookcaseClosedWide Bookshelf Shelf_Large",
    "tv cabinet": "cabinetTelevision cabinetTelevisionDoors",
    "cabinet": "bookcaseClosedDoors bathroomCabinet bathroomCabinetDrawer",
    "wall shelf": "Shelf_Small1 Shelf_Small2 Shelf_Small3",
    "coat rack": "coatRackStanding coatRack",
    "refrigerator": "kitchenFridge kitchenFridgeLarge kitchenFridgeBuiltIn Kitchen_Fridge",
    "stove": "kitchenStove kitchenStoveElectric Kitchen_Oven Kitchen_Oven_Large",
    "microwave": "kitchenMicrowave",
    "range hood": "hoodLarge hoodModern",
    "toaster": "toaster",
    "coffee machine": "kitchenCoffeeMachine",
    "toilet": "toilet toiletSquare Bathroom_Toilet Bathroom_Toilet2",
    "bathtub": "bathtub Bathroom_Bathtub",
    "shower": "shower showerRound",
    "mirror": "bathroomMirror Bathroom_Mirror1 Bathroom_Mirror2",
    "washing machine": "washer dryer Bathroom_WashingMachine",
    "tv": "televisionModern",
    "speaker": "speaker speakerSmall",
    "monitor": "computerScreen",
    "keyboard": "computerKeyboard",
    "laptop": "laptop",
    "lamp": "lampRoundFloor lampSquareFloor Light_Floor1 Light_Floor2 "
    "Light_Floor3 Light_Floor4 Light_Stand1 Light_Stand2",
    "plant": "pottedPlant Houseplant_1 Houseplant_2 Houseplant_3 Houseplant_4 Houseplant_5 Houseplant_6 Houseplant_8",
    "trash can": "trashcan Trashcan_Cylindric Trashcan_Green Trashcan_Small1 Trashcan_Small2",
    "fireplace": "Fireplace",
    "box": "cardboardBoxClosed cardboardBoxOpen",
    "pillow": "pillow pillowBlue pillowLong pillowBlueLong",
    "towel": "Bathroom_Towel",
}


@cache
def _model(path: Path) -> Mesh:
    """Return a model standing as recipes make pieces: its front looks along +x."""
    parts = [part.mesh.mapped(_Z_UP) for part in read_parts(path)]
    return joined(parts).turned(np.pi / 2).standing()


def is_held_out(model: str) -> bool:
    """Return whether the network never sees this model: a quarter of them, by their names."""
    return crc32(model.encode()) % 4 == 0


@contextmanager
def borrowed_furniture(folder: Path, which: Families = "all") -> Iterator[None]:
    """Let homes that are made meanwhile take models of a folder (searched with the folders in it).

    Args:
        folder: the models.
        which: those that the network learns from, those that it never sees, or all.

    Raises:
        FileNotFoundError: none of the models is there.
    """
    found = {path.stem: path for path in sorted(folder.rglob("*.glb"))}
    if which != "all":
        found = {name: path for name, path in found.items() if is_held_out(name) == (which == "held-out")}
    models = {category: [found[n] for n in names.split() if n in found] for category, names in _MODELS.items()}
    if not any(models.values()):
        raise FileNotFoundError(f"{folder} holds none of the models that are known; give the folder of the .glb files")
    made = catalogue.make

    def make(category: str, rng: np.random.Generator, which: Families = "all", name: str | None = None) -> Piece:
        piece = made(category, rng, which, name)
        choice = models.get(category, [])
        if not choice or rng.random() >= SHARE:
            return piece
        path = choice[int(rng.integers(len(choice)))]
        mesh, low = _model(path), piece.mesh.low
        stretch = np.maximum(piece.mesh.size, 0.01) / np.maximum(mesh.size, 1e-6)
        mesh = mesh.scaled(*(float(s) for s in stretch))
        x, y, z = (float(v) for v in low - mesh.low)
        supports = piece.supports if category in _FLAT_TOPS else ()
        top = max((s.z for s in supports), default=0.0)
        return replace(
            piece, mesh=mesh.moved(x, y, z), supports=tuple(s for s in supports if s.z >= top), family=path.stem
        )

    with patch.object(furnish, "make", make):
        yield
