"""Small things on the tops of furniture and on the floor."""

from collections.abc import Sequence

import numpy as np

from avlmaps_sim.furniture import Piece, Support
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.furnish import Among, Furnisher, PlacedPiece, floor_standing, footprint
from avlmaps_sim.homes.plan import corners_of, overlapping

# Things found on the tops of furniture.
ON_TOP: dict[str, tuple[str, ...]] = {
    "kitchen counter": ("kettle", "toaster", "coffee machine", "microwave", "bottle", "bowl", "pot", "cup", "tableware",
                        "basket", "bottle", "plant"),
    "kitchen island": ("bowl", "tableware", "bottle", "vase", "cup", "pot", "plant"),
    "dining table": ("tableware", "vase", "bowl", "candle", "cup", "bottle", "tableware", "laptop", "book"),
    "coffee table": ("book", "cup", "vase", "candle", "bowl", "laptop", "plant", "tableware"),
    "side table": ("lamp", "book", "cup", "vase", "plant", "telephone", "candle"),
    "console table": ("lamp", "vase", "picture", "bowl", "plant", "telephone", "candle"),
    "desk": ("book", "cup", "lamp", "laptop", "box", "telephone", "plant", "printer", "book"),
    "nightstand": ("lamp", "book", "clock", "cup", "telephone", "candle", "bottle"),
    "bookshelf": ("book", "book", "book", "vase", "box", "basket", "picture", "clock", "toy", "plant", "loudspeaker"),
    "wall shelf": ("book", "vase", "picture", "plant", "candle", "toy", "clock", "bottle"),
    "cabinet": ("vase", "lamp", "picture", "bowl", "plant", "clock", "book", "tableware", "loudspeaker"),
    "chest of drawers": ("lamp", "picture", "vase", "mirror", "box", "toy", "plant", "clock", "book", "basket"),
    "tv cabinet": ("vase", "loudspeaker", "book", "plant", "picture", "box"),
    "washing machine": ("basket", "bottle", "box"),
    "filing cabinet": ("plant", "box", "printer", "book"),
    "refrigerator": ("box", "basket", "plant"),
    "bed": ("cushion", "cushion", "bag", "book", "toy", "laptop"),
    "sofa": ("cushion", "cushion", "book", "bag", "toy"),
    "armchair": ("cushion",), "bench": ("cushion", "bag", "box"), "piano": ("book", "vase", "picture", "lamp",
    "candle"),
    "sink": ("cup", "bottle"), "shoe rack": ("shoes", "shoes", "bag"), "stove": ("pot", "pot", "kettle"),
    "bathtub": ("bottle",), "ottoman": ("book", "tableware"), "fireplace": ("vase", "candle", "picture", "clock"),
    "wardrobe": ("box", "basket", "bag"), "locker": ("box", "bag"), "microwave": ("bowl", "box"),
    "printer": ("paper",), "aquarium": (), "chair": ("bag", "cushion", "book"),
}  # fmt: skip
_DENSITY = {"bookshelf": 1.6, "wall shelf": 1.3, "kitchen counter": 1.4, "dining table": 0.9, "sofa": 0.7, "bed": 0.5,
            "chair": 0.06, "wardrobe": 0.25, "refrigerator": 0.2, "armchair": 0.3}  # fmt: skip
_NEVER_ON_TOPS = ("shade on pole", "tripod", "arc", "torchiere", "paper column", "many heads", "palm", "tree",
                  "big leaves",
                  "leaning", "standing in a frame", "leaning on a wall", "floor standing", "on a stand", "suitcase",
                  "on a rolling stand", "rear projection", "office copier", "server in a rack")  # fmt: skip
_LYING = (
    "box",
    "bag",
    "toy",
    "shoes",
    "ball",
    "basket",
    "book",
    "cushion",
    "laundry basket",
    "dumbbell",
    "towel",
    "bottle",
)


def things_on(f: Furnisher, anchor: PlacedPiece, wanted: Sequence[str]) -> int:
    """Stand small things on the tops of a piece, meeting nothing there; return how many found a place."""
    tops = [top for top in anchor.piece.supports if min(np.subtract(top.high, top.low)) > 0.06]
    done = 0
    for category in wanted if tops else ():
        number = int(f.rng.integers(len(tops)))
        piece = _small_enough(f, category, tops[number])
        if piece is None:
            continue
        heading = f.rng.uniform(-np.pi, np.pi, 5) if chance(f.rng, 0.6) else f.rng.normal(0.0, 0.05, 5)
        centre = f.rng.uniform(tops[number].low, tops[number].high, (5, 2))
        done += _set(f, anchor, tops[number], piece, centre, heading)
    return done


def _for_tops(family: str) -> bool:
    return not family.startswith(("wall", "grandfather", "with pendulum")) and family not in _NEVER_ON_TOPS


def _small_enough(f: Furnisher, category: str, top: Support) -> Piece | None:
    room = sorted(np.subtract(top.high, top.low).tolist())
    for _ in range(2):
        piece = f.new(category, _for_tops)
        if piece is None:
            return None
        size = piece.mesh.size
        across = sorted(size[:2].tolist())
        low_enough = size[2] < min(top.clearance_m - 0.01, 0.75)
        if low_enough and across[0] < room[0] and across[1] < room[1] and across[1] < 0.9:
            return piece
    return None


def _set(
    f: Furnisher,
    anchor: PlacedPiece,
    top: Support,
    piece: Piece,
    centre: np.ndarray,
    heading: np.ndarray,
    over_m: float = 0.0,
) -> bool:
    """Stand a thing at the first of several places on a top where it meets nothing, within the given overhang."""
    taken = f.laid.setdefault((id(anchor), round(100 * top.z)), [])
    foot = footprint(piece.mesh)
    corner = corners_of(centre, np.broadcast_to(foot.half, centre.shape), heading)
    inside = (corner >= np.array(top.low) - over_m) & (corner <= np.array(top.high) + over_m)
    good = np.all(inside, axis=(1, 2))
    if taken and good.any():
        good[good] = ~overlapping(corner[good], np.array(taken), 0.002).any(axis=1)
    z = anchor.place.z + top.z + 0.001
    for k in np.flatnonzero(good)[:2].tolist():
        way = anchor.place.heading_rad + float(heading[k])
        at = anchor.to_world(centre[k])[None]
        if not f.ground.fits(foot, at, np.array([way]), z, zones=False, except_for=anchor.number)[0]:
            continue  # under a cabinet that hangs too low, say
        taken.append(corner[k])
        f.put(piece, foot.place(at[0], way, z))
        return True
    return False


def set_at(
    f: Furnisher,
    anchor: PlacedPiece,
    category: str,
    depth: float,
    across: float,
    turn_rad: float = 0.0,
    among: Among | None = None,
) -> bool:
    """Stand a thing on the largest top of a piece, at shares of its depth (from the back) and width.

    It is turned by ``turn_rad`` out of the piece's own direction.
    """
    if not anchor.piece.supports or (piece := f.new(category, among or _for_tops)) is None:
        return False
    top = max(anchor.piece.supports, key=lambda s: float(np.prod(np.subtract(s.high, s.low))))
    foot = footprint(piece.mesh)
    if foot.high_m > top.clearance_m:
        return False
    low, high = np.array(top.low) + foot.half, np.array(top.high) - foot.half
    low, high = np.minimum(low, (low + high) / 2), np.maximum(high, (low + high) / 2)
    nudge = np.array([(0.0, 0.0), (0.15, 0.0), (-0.1, 0.15), (-0.1, -0.15), (0.3, 0.0), (0.0, 0.4), (0.0, -0.4)])
    centre = low + (high - low) * np.clip(np.array([depth, across]) + nudge, 0.0, 1.0)
    return _set(f, anchor, top, piece, centre, np.full(len(centre), turn_rad), over_m=0.06)


def dress(f: Furnisher) -> None:
    """Put clutter on all that stands in a room."""
    for stood in list(f.stood):
        category = stood.piece.category
        if category not in ON_TOP or not stood.piece.supports or not ON_TOP[category]:
            continue
        size = sum(float(np.prod(np.subtract(s.high, s.low))) for s in stood.piece.supports)
        mean = _DENSITY.get(category, 1.0) * (0.6 + 2.2 * f.mess) * min(1.0 + 2.5 * size, 4.0) * 0.7
        number = min(int(f.rng.poisson(mean)), 9)
        things_on(f, stood, [pick(f.rng, ON_TOP[category]) for _ in range(number)])


def litter(f: Furnisher) -> None:
    """Let things lie about on the floor, more in a messy room."""
    for _ in range(min(int(f.rng.poisson(0.5 + 6.0 * f.mess**2)), 12)):
        piece = f.new(pick(f.rng, _LYING), floor_standing)
        if piece is None or float(piece.mesh.size[:2].max()) > 0.9:
            continue
        if chance(f.rng, 0.6):
            f.along(piece, front_m=0.0, gap_m=draw(f.rng, 0.0, 0.25), tries=5)
        else:
            f.somewhere(piece, square=0.0, tries=count(f.rng, 3, 8))
