"""The functions of the package's face that join several rooms: from a recording to a map that answers queries."""

from pathlib import Path
from typing import TYPE_CHECKING

from avlmaps.core.errors import RecordingError
from avlmaps.core.files import lasting_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from avlmaps.maps.settings import BuildSettings
    from avlmaps.maps.store.map_data import MapData
    from avlmaps.perception.encoders import Encoders
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.types import Recording


def build_map(
    recording: "Recording | str | Path",
    path: str | Path,
    profile: "str | Encoders" = "embedded",
    settings: "BuildSettings | None" = None,
    *,
    encoders: "Encoders | None" = None,
    allow: "Sequence[str]" = (),
    resume: bool = True,
    overwrite: bool = False,
    progress: bool = True,
) -> "AVLMap":
    """Build a map of a recording and open it.

    A build that was stopped resumes where it stopped when it is called again. A map that is finished already,
    from the same recording with the same settings, is opened without work.

    Args:
        recording: folder or file of a recording in any known format, or one from ``open_recording``.
        path: folder of the map, by custom ``NAME.avlmap``.
        profile: which models perceive: ``embedded``, ``foundation``, ``paper`` or one of your own.
        settings: everything else about the build; the defaults if None.
        encoders: the models that perceive, instead of a profile: objects or names.
        allow: names of reasons for which a recording that contradicts itself is not refused (``--allow``).
        resume: continue with what a stopped build had finished; otherwise begin again.
        overwrite: replace a finished map there that came from another recording, or with other settings.
        progress: show progress bars on standard error.

    Raises:
        RecordingError: the recording cannot be opened, contradicts itself, or too many frames cannot be read.
        MapError: the folder is not a place for a map, holds another map, or cannot be written.
        BackendError: the profile is not known, or a package for it is missing.
    """
    from avlmaps.maps.build import build_map as build
    from avlmaps.maps.settings import DEFAULTS, BuildSettings
    from avlmaps.query.avlmap import AVLMap, with_findings
    from avlmaps.query.voxel_map import require_kinds
    from avlmaps.recordings.open import open_recording
    from avlmaps.recordings.types import Recording

    require_kinds(("settings", settings, BuildSettings))
    opened = open_recording(recording) if isinstance(recording, str | Path) else recording
    if not isinstance(opened, Recording):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RecordingError(
            f"A map is built of the path of a recording or of one from open_recording, not of {type(opened).__name__}; "
            "add frames of your own to a VoxelMap."
        )
    folder = lasting_path(path)
    data = build(
        opened,
        folder,
        encoders or profile,
        settings or DEFAULTS,
        allow=[allow] if isinstance(allow, str) else allow,
        resume=resume,
        overwrite=overwrite,
        progress=progress,
        finds=with_findings,
    )
    return AVLMap(data, _asked_with(data, encoders), path=folder)


def open_map(path: str | Path, *, encoders: "Encoders | None" = None) -> "AVLMap":
    """Open a map's folder; its large arrays stay on disk until they are used.

    ``encoders`` are the models to ask with, where the map was made with objects; by default, and for modules that are
    left out, those that the map names. Points, colours and places of sounds need none. ``MapError``: it is not a map,
    or damaged, or of another schema.
    """
    from avlmaps.maps.store.folder import read
    from avlmaps.query.avlmap import AVLMap

    folder = lasting_path(path)
    data = read(folder)
    return AVLMap(data, _asked_with(data, encoders), path=folder)


def _asked_with(data: "MapData", encoders: "Encoders | None") -> "Encoders":
    from avlmaps.maps.store.map_data import encoders_of_map

    named = encoders_of_map(data.info)
    return named if encoders is None else encoders.over(named)
