"""The sources of one import, and the new map's notes on them."""

from collections.abc import Iterator
from dataclasses import dataclass

from avlmaps.core.registry import Kind, find
from avlmaps.core.wording import option
from avlmaps.maps.store.manifest import ModelInfo, RecordingInfo
from avlmaps.perception.encoders import Encoders
from avlmaps_models.import_reference import areas_h5, voxels_h5
from avlmaps_models.import_reference.frames import Walk
from avlmaps_models.import_reference.scene import SceneFiles
from avlmaps_models.import_reference.tracks import Ears
from avlmaps_models.import_reference.voxels_h5 import ReferenceVoxels

PROFILE = "paper"


@dataclass(frozen=True, slots=True)
class Source:
    """The parts of a map of the reference code.

    Attributes:
        scene: where its files are.
        voxels: open, unread.
        walk: poses and views.
        ears: encodes the sounds again.
    """

    scene: SceneFiles
    voxels: ReferenceVoxels
    walk: Walk
    ears: Ears

    def models(self) -> dict[str, ModelInfo]:
        """Return the known models: the names of the reference's own, without their weights."""
        dims = {Kind.PIXELS: voxels_h5.DIM} | ({Kind.VIEWS: areas_h5.DIM} if self.walk.has_views else {})
        models = {kind.value: _unweighed(kind, dim) for kind, dim in dims.items()}
        return models if self.ears.model is None else {**models, Kind.SOUNDS.value: self.ears.model}

    def recording(self) -> RecordingInfo:
        """Return the map's notes on its source."""
        return RecordingInfo(
            name=self.scene.folder.resolve().name,
            format=self.voxels.path.name,
            fingerprint=self.voxels.fingerprint,
            frames=self.voxels.frames,
            duration_s=self.walk.duration_s,
            notices=(self.walk.notice,) if self.walk.notice else (),
        )

    def notices(self, kept: int, left_out: int) -> Iterator[str]:
        """Yield a sentence for each thing worth knowing.

        Args:
            kept: voxels of the new map.
            left_out: voxels of the file that were not usable.
        """
        used = [model.id for model in self.models().values() if not model.checksum]
        total = len(self.voxels)
        yield (
            f"Imported from {self.voxels.path.name}: from which weights its features are is not recorded there; they "
            f"are taken for those of {' and '.join(used)}."
        )
        yield f"{total - left_out} cells of the reference's grid fill {kept} voxels of this one's."
        if left_out:
            yield f"{left_out} of {total} voxels held NaN or infinity and were left out."
        if not self.voxels.has_colours:
            yield "The file has no colours (grid_rgb), so that all voxels are black."
        if self.voxels.corner is None:
            yield "The reference stores nothing above the camera's height nor below the first pose's floor."
        if not self.walk.has_views:
            yield "There is no area map (area_map/clip_sparse_map.h5df), so that areas cannot be queried."
        yield from self._of_sounds_and_pictures()

    def _of_sounds_and_pictures(self) -> Iterator[str]:
        if self.ears.walks:
            yield (
                f"The sounds come from {len(self.ears.walks)} walks of their own; their times continue from the "
                "end of the scene's walk."
            )
        elif self.scene.has_sound_map:
            yield (
                "The sound map (audio_data*.pkl) was not imported: a pickle can run any code when it is read, and this "
                "one holds neither the time of a sound nor the sound itself; encode the tracks again with "
                f"{option('sounds')}."
            )
        if self.scene.has_visual_map:
            yield (
                "The visual map (*_features.h5df) was not imported: it names its pictures by their path on the machine "
                "that wrote it, and stores no keypoints."
            )
        yield "There are no keypoints, so that photos cannot be located in this map."


def _unweighed(kind: Kind, dim: int) -> ModelInfo:
    backend = find(kind, Encoders.named(PROFILE).name_of(kind))
    return ModelInfo(
        backend=f"{backend.name}@{backend.model}",
        id=backend.model,
        dim=dim,
        licence=backend.licence,
        checksum="",
        prompts=(),
        note="the reference code does not record from which weights its features are",
    )
