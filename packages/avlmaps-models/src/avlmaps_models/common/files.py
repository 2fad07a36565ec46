"""Where the files of a published model are: a path, the folder of models, the hub's cache, the hub."""

from collections.abc import Sequence
from pathlib import Path

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import MODELS, install_command
from avlmaps.core.wording import option
from avlmaps.perception.models import model_settings, places_of

# The files of a model's folder that transformers or open_clip need; code and other formats stay where they are.
_WANTED = ("*.json", "*.safetensors", "*.txt", "*.model", "*.jinja")


def model_folder(model: str, wanted: Sequence[str] = _WANTED) -> Path:
    """Return the local folder of a model: where it lies already, else fetched from the hub.

    Args:
        model: a hub's id (``google/tipsv2-b14``) or a local folder.
        wanted: patterns of the files to fetch.

    Raises:
        BackendError: it is not here and cannot be fetched; the sentence says how to get it.
    """
    for place in places_of(model):
        if place.is_dir():
            return place
    return _fetched(model, wanted)


def model_file(name: str, how_to_get: str) -> Path:
    """Return a single checkpoint file that no hub holds under an id.

    Args:
        name: its published name, or a path.
        how_to_get: the command or the page that brings it, for the error.

    Raises:
        BackendError: it is not here.
    """
    for place in places_of(name):
        if place.is_file():
            return place
    folder = model_settings().folder
    looked = f"in {folder}" if folder else f"in no folder: set {option('models', 'DIR')} or AVLMAPS_MODELS"
    raise BackendError(f"The checkpoint {name} is not here (looked {looked}); get it with: {how_to_get}")


def _fetched(model: str, wanted: Sequence[str]) -> Path:
    settings = model_settings()
    get = f"hf download {model}"
    a_folder = f"in a folder of models ({option('models', 'DIR')} sets one), "
    looked = f"in {settings.folder}, " if settings.folder else a_folder
    try:
        from huggingface_hub import snapshot_download
    except ImportError as fault:
        raise BackendError(
            f"The model {model} is not here (looked {looked.rstrip(', ')}), and fetching it needs huggingface_hub; get "
            f"that with: {install_command('foundation', distribution=MODELS.name)}"
        ) from fault
    try:
        return Path(snapshot_download(model, allow_patterns=list(wanted), local_files_only=settings.offline))
    except Exception as fault:
        where = (
            "offline is set"
            if settings.offline
            else f"{type(fault).__name__}: no network, no such id, or a licence to accept"
        )
        raise BackendError(
            f"The model {model} is not here (looked {looked}in the hub's cache and on the hub: {where}); get it on a "
            f"machine with a network with: {get}"
        ) from fault
