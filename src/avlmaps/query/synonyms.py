"""What an encoder of an open vocabulary needs of a query: by how much its cosines count, and which words are rivals.

Such an encoder gives every word a vector, and words of one sense lie close but not at one place: asked for a couch, a
sofa would win half of its voxels. So that words which name the asked thing, or a kind of it, do not compete, they are
listed here; compounds tell their kind by their last word (an office chair is a chair).
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder

if TYPE_CHECKING:
    from avlmaps.query.modalities.object import ObjectSettings

_SAME = (
    ("sofa", "couch", "settee"),
    ("tv", "television", "telly", "tv screen"),
    ("carpet", "rug"),
    ("picture", "painting", "picture frame", "poster", "photo on the wall"),
    ("refrigerator", "fridge"),
    ("stove", "oven", "cooker", "hob"),
    ("kitchen counter", "countertop", "worktop", "counter"),
    ("chandelier", "ceiling lamp", "pendant lamp", "ceiling light"),
    ("lamp", "floor lamp", "table lamp", "desk lamp"),
    ("plant", "potted plant", "houseplant"),
    ("trash can", "waste bin", "rubbish bin", "garbage can", "wastebasket", "bin"),
    ("nightstand", "bedside table", "night table"),
    ("chest of drawers", "dresser", "drawers"),
    ("tv cabinet", "tv stand", "media console"),
    ("wardrobe", "closet"),
    ("bookshelf", "bookcase", "shelf with books"),
    ("fitness equipment", "treadmill", "exercise bike", "exercise machine", "gym equipment"),
    ("mat", "doormat", "exercise mat"),
    ("loudspeaker", "speaker"),
    ("computer", "computer tower", "pc"),
    ("air conditioner", "air conditioning"),
    ("bag", "backpack", "handbag", "suitcase"),
    ("sink", "washbasin", "wash basin"),
    ("toilet", "lavatory", "loo", "wc"),
    ("curtain", "drapes"),
    ("cushion", "pillow"),
    ("cup", "mug"),
    ("monitor", "computer screen", "computer monitor"),
    ("telephone", "phone"),
    ("bicycle", "bike"),
    ("stairs", "staircase", "steps"),
    ("locker", "lockers"),
    ("kitchen cabinet", "wall cabinet", "kitchen cupboard"),
    ("cabinet", "sideboard", "display cabinet"),
)
_SEATS = ("chair", "armchair", "office chair", "stool", "bench", "sofa", "ottoman")
_TABLES = ("dining table", "coffee table", "side table", "console table", "desk")
_STORAGE = ("nightstand", "wardrobe", "chest of drawers", "bookshelf", "cabinet", "tv cabinet")
_KINDS = {
    "table": _TABLES,
    "seat": _SEATS,
    "place to sit": _SEATS,
    "place to sleep": ("bed", "bunk bed", "crib", "sofa"),
    "chair": ("armchair",),
    "cupboard": ("cabinet", "kitchen cabinet", "wardrobe"),
    "light": ("lamp", "chandelier"),
    "lamp": ("chandelier",),
    "screen": ("tv", "monitor", "laptop"),
    "shelf": ("bookshelf", "wall shelf", "shoe rack"),
    "counter": ("kitchen counter", "kitchen island"),
    "furniture": (*_SEATS, *_TABLES, *_STORAGE, "bed", "crib", "bunk bed"),
}


def is_a(other: str, asked: str) -> bool:
    """Return whether what one phrase names is what another asks for, as far as the words tell it.

    Args:
        other: ``office chair``.
        asked: ``chair``, ``chairs`` or ``seat``; a chair is no office chair.
    """
    other, asked = _plain(other), _plain(asked)
    if not other or not asked:
        return False
    names = {other, *(name for names in _SAME if other in names for name in names)}
    kinds = _KINDS.get(asked, ())
    return any(name == asked or name in kinds or name.endswith(f" {asked}") for name in names)


def is_open(encoder: PixelEncoder) -> bool:
    """Return whether an encoder takes any word and tells by how much its cosines count."""
    return isinstance(encoder, ScaledEncoder) and not isinstance(encoder, NamedPixelEncoder)


def fitting(settings: "ObjectSettings", encoder: PixelEncoder) -> "ObjectSettings":
    """Return the settings with the margin that an encoder is sure at, in its own cosines."""
    if isinstance(encoder, ScaledEncoder) and is_open(encoder):
        return replace(settings, margin_yes=settings.margin_yes_logits / encoder.logit_scale)
    return settings


def _plain(phrase: str) -> str:
    """Return a phrase in small letters and, as far as an s tells it, in the singular."""
    plain = " ".join(phrase.lower().split())
    known = plain in _KINDS or any(plain in names for names in _SAME)
    return plain if known or not plain.endswith("s") or plain.endswith("ss") else plain[:-1]
