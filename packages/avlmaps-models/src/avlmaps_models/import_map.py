"""`avlmaps import-map`: a map of the published AVLMaps/VLMaps code becomes one of ours."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from avlmaps.cli.info import describe_map, info_lines
from avlmaps.cli.output import emit
from avlmaps.cli.verb import ModelVerb


@dataclass(frozen=True, kw_only=True)
class ImportMap(ModelVerb):
    """Convert a map of the published AVLMaps/VLMaps code; the result lies in the frame of the scene's recording.

    Voxels (vlmaps.h5df and its relatives) and areas (clip_sparse_map.h5df) are read. The sound map, a pickle, is not;
    --sounds encodes the tracks that it was made from again. Needs pip install 'avlmaps-models[paper]'.

    Example: avlmaps import-map avlmaps_dataset/5LpN3gDmAk7_1 --out 5LpN3gDmAk7_1.avlmap --sounds output_level_1.wav
    """

    source: Annotated[Positional[Path], arg(metavar="SCENE")]
    """Scene folder with vlmap/vlmaps.h5df, area_map/ and poses.txt, or the .h5df file of the voxels."""
    out: Annotated[Path, arg(metavar="MAP")]
    """Map folder to write, by custom NAME.avlmap."""
    cell_size_m: Annotated[float, arg(name="cell-size", metavar="METRES")] = 0.05
    """Edge of a cell of the reference's grid, metres; multi-floor and camera maps hold theirs."""
    poses: Annotated[Path | None, arg(metavar="FILE")] = None
    """File poses.txt, whose first pose is the centre of the grid. Default: the scene's."""
    areas: Annotated[Path | None, arg(metavar="FILE")] = None
    """File clip_sparse_map.h5df. Default: the scene's."""
    sounds: Annotated[str, arg(metavar="FILE")] = ""
    """Name of the track in each walk below audio_video/, such as output_level_1.wav. Default: no sounds."""
    hear_with: Annotated[str, arg(metavar="BACKEND")] = "audioclip"
    """Sound model that encodes the tracks (see `avlmaps profiles`)."""
    max_bad_share: Annotated[float, arg(metavar="SHARE")] = 0.0
    """Stop when more than this share of the voxels holds NaN; fewer are left out and reported."""
    overwrite: bool = False
    """Replace a finished map at --out that came from another source."""

    def run(self) -> None:
        """Convert it."""
        answer = _imported(self)
        emit(answer, info_lines(answer, verbose=False), self.json)


def _imported(verb: ImportMap) -> dict[str, Any]:
    from avlmaps_models.import_reference.convert import ImportSettings, import_reference_map

    settings = ImportSettings(verb.cell_size_m, verb.max_bad_share, verb.sounds, verb.hear_with)
    imported = import_reference_map(
        verb.source, verb.out, settings, areas=verb.areas, poses=verb.poses, overwrite=verb.overwrite
    )
    return describe_map(imported)
