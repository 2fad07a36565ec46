"""Where that is stored which follows from nearly all of a large map: its voxels and views, its models, this package.

The digest of all their source text and data is in its key, so that any change of them makes it new.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.registry import Kind
from avlmaps.maps.store.derived import Derivation, is_large

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap

_PACKAGES = ("avlmaps.core", "avlmaps.maps", "avlmaps.perception", "avlmaps.query")
_FILES = (
    "voxels/feature", "voxels/index", "voxels/hits", "keyframes/centre", "keyframes/view",
    "keyframes/world_from_camera",
)  # fmt: skip


def place_of(stored: "StoredMap", name: str, settings: Sequence[Any], given: Any) -> Derivation | None:
    """Return where a derivation of a map is stored; None for a map in memory, or one too small to need it.

    Args:
        stored: the map.
        name: of the derivation, an identifier.
        settings: that it depends on, dataclasses.
        given: all else that it depends on beside the map and its models of things and views.
    """
    if not is_large(stored.info):
        return None
    models: list[Any] = []
    modules: list[str] = [*_PACKAGES]
    for kind in (Kind.PIXELS, Kind.VIEWS):
        try:
            stored.require_model(kind)
        except (BackendError, MapError):  # no features of these, or those of another encoder: they say nothing
            continue
        encoder = stored.encoders.load(kind)
        models.append([kind.value, asdict(encoder.card)])
        modules.append(type(encoder).__module__)
    depends = [stored.info.checksum, [asdict(one) for one in settings], models, given]
    return Derivation.of(stored.path, stored.info, name, _FILES, modules, depends)
