"""The walk behind a map of the reference code: its poses, and the views of its area map."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Float64

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import MapError, RecordingError
from avlmaps.core.progress import progress
from avlmaps.core.wording import option
from avlmaps.maps.types import Keyframes
from avlmaps.recordings.faults import noted
from avlmaps.recordings.formats.file_recording import list_names
from avlmaps.recordings.formats.layouts import CameraFile, camera_poses, read_camera_file, read_habitat_poses
from avlmaps.recordings.images import first_picture_size
from avlmaps_models.import_reference.areas_h5 import read_areas
from avlmaps_models.import_reference.scene import AREAS, SceneFiles
from avlmaps_models.import_reference.views import middles_of_view, thinned

PUBLISHED_SIZE = (1080, 720)  # pixels of the data set's pictures


@dataclass(frozen=True, slots=True)
class Walk:
    """Where the camera was, and what the area map says of what it saw.

    Attributes:
        first_habitat_from_base: first pose of all, which the reference's grid lies round.
        world_from_camera: pose of each frame, our world.
        view: feature of each frame; no columns where there is no area map.
        stamp_s: counted at the frame rate, since the files have none.
        rig: the camera, as for a recording of the scene.
        notice: what the poses were taken for.
    """

    first_habitat_from_base: Float[np.ndarray, "4 4"]
    world_from_camera: Float64[np.ndarray, "f 4 4"]
    view: Float32[np.ndarray, "f dv"]
    stamp_s: Float64[np.ndarray, " f"]
    rig: Rig
    notice: str

    @property
    def has_views(self) -> bool:
        """Whether there is an area map."""
        return self.view.shape[1] > 0

    @property
    def duration_s(self) -> float:
        """From the first frame to the last."""
        return float(self.stamp_s[-1]) if len(self.stamp_s) else 0.0

    def fingerprint(self) -> str:
        """Return a hash of all that goes into the map."""
        digest = hashlib.sha256()
        for array in (self.first_habitat_from_base, self.world_from_camera, self.view, self.stamp_s):
            digest.update(f"{array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    def keyframes(self, places: Float[np.ndarray, "n 3"]) -> Keyframes:
        """Return every frame as a keyframe without a picture.

        Args:
            places: middles of the map's voxels, which show the part that each frame saw.
        """
        count = len(self.stamp_s)
        each = progress(self.world_from_camera, "looking", total=count) if count else ()
        return Keyframes(
            stamp_s=self.stamp_s,
            world_from_camera=self.world_from_camera,
            centre=middles_of_view(thinned(places), each, self.rig.depth),
            view=self.view,
            place=np.zeros((count, 0), np.float32),
            offsets=np.zeros(count + 1, np.int64),
            xy=np.zeros((0, 2), np.float32),
            descriptors=np.zeros((0, 0), np.float16),
            points_world=np.zeros((0, 3), np.float32),
            thumbnail_offsets=np.zeros(count + 1, np.int64),
            thumbnails=np.zeros(0, np.uint8),
        )


def read_walk(scene: SceneFiles, needs_first_pose: bool) -> Walk:
    """Read the poses, from ``poses.txt`` or the area map, and the views.

    Args:
        scene: where the files are.
        needs_first_pose: whether the map cannot be placed without the first base pose.

    Raises:
        MapError: there are no poses and they are needed, or a file is damaged.
    """
    given, listed, camera = _listed(scene)
    areas = read_areas(scene.areas) if scene.areas else None
    if areas is not None and len(listed) and not np.allclose(areas.habitat_from_body[:1], listed[:1], atol=1e-4):
        raise MapError(
            f"{scene.areas} begins with another pose than {scene.poses}: they are of different walks; give those that "
            f"belong together ({option('areas')}, {option('poses', argument='poses')})."
        )
    body = areas.habitat_from_body if areas is not None else listed
    first = listed if len(listed) else body
    if needs_first_pose and not len(first):
        raise MapError(
            f"{scene.voxels} does not say where its grid lies in the world: that is the first pose of the scene's "
            f"poses.txt, and neither that nor {AREAS} is in {scene.folder}; give it with "
            f"{option('poses', 'FILE', argument='poses')}."
        )
    with noted() as notices:
        world_from_camera = camera_poses(body, given)
    view = areas.view if areas is not None else np.zeros((len(body), 0), np.float32)
    return Walk(
        first_habitat_from_base=first[0] if len(first) else np.eye(4),
        world_from_camera=world_from_camera,
        view=view,
        stamp_s=np.arange(len(body)) / given.rate_hz,
        rig=Rig(camera, camera),
        notice=notices[0] if len(body) else "",
    )


def _listed(scene: SceneFiles) -> tuple[CameraFile, Float64[np.ndarray, "n 4 4"], Pinhole]:
    """Return the content of ``camera.json``, the poses of ``poses.txt``, and the camera."""
    try:
        given = read_camera_file(scene.camera)
        listed = np.zeros((0, 4, 4))
        if scene.poses is not None:
            listed = read_habitat_poses(scene.poses)
            names = [f"{scene.poses}, pose {number}" for number in range(len(listed))]
            listed = poses.orthonormalize_all(listed, names)
        return given, listed, _camera(given, scene.camera.parent)
    except (RecordingError, ValueError) as fault:
        raise MapError(str(fault)) from None


def _camera(given: CameraFile, folder: Path) -> Pinhole:
    """Return the camera as ``recordings.formats.layouts`` makes it; of the published size where there is no picture."""
    there = (folder / "rgb").is_dir()
    pictures = [f"rgb/{name}" for name in list_names(folder / "rgb", (".png", ".jpg"))] if there else []
    width, height = first_picture_size(folder, pictures[:1]) if pictures else PUBLISHED_SIZE
    fx = width / 2 if given.fx is None else given.fx
    fy = fx if given.fy is None else given.fy
    cx = width / 2 if given.cx is None else given.cx
    cy = height / 2 if given.cy is None else given.cy
    return Pinhole(fx, fy, cx, cy, width, height)
