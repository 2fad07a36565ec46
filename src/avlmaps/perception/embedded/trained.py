"""Networks that you trained yourself (``python -m training.pixels --out MODELS/eyes``), from a folder of models.

They take the places of the two that ship. A folder with one of the two is used with what the profiles ``embedded``
and ``synthetic`` would have beside it: a first network with the second one that ships, a second network alone.
"""

from pathlib import Path

from avlmaps.core.errors import BackendError
from avlmaps.perception.embedded.paired_networks import PairedNetworks
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.perception.embedded.scene_network import (
    DEFAULT_WEIGHTS,
    SYNTHETIC_WEIGHTS,
    SceneNetwork,
    load_network,
    read_network,
)
from avlmaps.perception.embedded.views import EmbeddedViews
from avlmaps.perception.models.files import local_model
from avlmaps.perception.models.published_models import PUBLISHED

# The name under which a folder of models holds them, unless another is chosen.
MODEL = "eyes"
_HOW_TO_GET = PUBLISHED[MODEL].get
_REMEDY = f"train them again with {_HOW_TO_GET}"
# Whose the weights are: nobody but who trained them knows under which terms the frames came.
_LICENCE = "your own"


def trained_pixels(model: str = MODEL) -> EmbeddedPixels:
    """Return the pixel encoder of your own networks; see ``open_trained``."""
    return EmbeddedPixels(open_trained(model), licence=_LICENCE)


def trained_views(model: str = MODEL) -> EmbeddedViews:
    """Return the view encoder of your own networks; see ``open_trained``."""
    return EmbeddedViews(open_trained(model), licence=_LICENCE)


def open_trained(model: str = MODEL) -> SceneNetwork | PairedNetworks:
    """Return networks from a folder, or the one of a file ``NAME.onnx`` with ``NAME.json`` beside it.

    Args:
        model: the name of the folder or file in the folder of models, or a path.

    Raises:
        BackendError: they are not here, cannot be read, or do not go together.
    """
    place = local_model(model, _HOW_TO_GET)
    if place.is_file():
        return _read(place.parent, place.stem)
    has_first, has_second = ((place / f"{name}.onnx").is_file() for name in (DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS))
    if not has_first and not has_second:
        raise BackendError(
            f"{place} holds neither {DEFAULT_WEIGHTS}.onnx nor {SYNTHETIC_WEIGHTS}.onnx; get them with: {_HOW_TO_GET}"
        )
    if not has_first:
        return _read(place, SYNTHETIC_WEIGHTS)
    first = _read(place, DEFAULT_WEIGHTS)
    second = _read(place, SYNTHETIC_WEIGHTS) if has_second else load_network(SYNTHETIC_WEIGHTS)
    try:
        return PairedNetworks(first, second)
    except ValueError as fault:
        beside = "beside it" if has_second else "that ships"
        raise BackendError(
            f"{place / DEFAULT_WEIGHTS}.onnx and the second network {beside} do not go together ({fault}) Give the "
            "file itself as the model, to use it alone."
        ) from fault


def _read(folder: Path, name: str) -> SceneNetwork:
    return read_network(folder, name, _REMEDY)
