"""Where the files of models are: a path, the folder of models, the user's own folder; errors say how to get them."""

from pathlib import Path

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.wording import option
from avlmaps.perception.models.settings import model_settings
from avlmaps.perception.user_folder import user_folder


def local_model(model: str, how_to_get: str) -> Path:
    """Return the folder or file of a model that is never fetched.

    Args:
        model: its name in the folder of models, or a path.
        how_to_get: the command that makes or brings it, for the error.

    Raises:
        BackendError: it is not here.
    """
    for place in places_of(model):
        if place.exists():
            return place
    folder = model_settings().folder
    looked = f"in {folder} and " if folder else f"in no folder of models, {option('models', 'DIR')} sets one, and "
    raise BackendError(f"The model {model} is not here (looked {looked}for that path); get it with: {how_to_get}")


def places_of(model: str) -> list[Path]:
    """Return where a model may lie, the likeliest first."""
    folder = model_settings().folder
    inside = [folder / model, folder / model.replace("/", "--"), folder / Path(model).name] if folder else []
    return [*inside, user_path(model)]


def folders_of(model: str) -> list[Path]:
    """Return where the folder of a model that no hub holds may lie, the likeliest first; the last is the user's own."""
    return [*places_of(model), fetched_folder() / model]


def fetched_folder() -> Path:
    """Return the folder of models that avlmaps fetched itself where the settings name none; it need not exist yet."""
    return user_folder() / "models"
