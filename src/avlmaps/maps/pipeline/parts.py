"""Parts of a map: sums over some frames, stored on disk, that add up to the whole in any order.

A stopped build continues from the parts that it had finished, and machines that share the work bring theirs:
``build_part`` on each of them, then ``build_map(..., parts=[...])`` on one.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.arrays import Float32, Float64, Int64
from avlmaps.core.columns import concat
from avlmaps.core.errors import MapError
from avlmaps.maps.fusion.accumulator import VoxelAccumulator, VoxelSums
from avlmaps.maps.fusion.free_space import FreeViews
from avlmaps.maps.fusion.submaps import submap_of
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.plan import Span
from avlmaps.maps.store.checkpoints import find_checkpoint, load_checkpoint, save_checkpoint
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.maps.types import Submaps
from avlmaps.recordings.types import Recording


class PartInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The description of a part beside its sums.

    Attributes:
        recording: the recording's name, for people.
        spans: the frames that it covers: (first, last + 1, step) of each stretch, rising.
        fused: how many frames were fused.
        bad_frames: those that could not be read.
        elapsed_s: seconds of work.
    """

    recording: str
    spans: tuple[Span, ...]
    fused: int
    bad_frames: tuple[BadFrame, ...]
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class MapPart:
    """A finished part.

    Attributes:
        folder: where it lies.
        info: which frames it covers.
        key: hash of all that its sums depend on.
    """

    folder: Path
    info: PartInfo
    key: str

    def sums(self) -> VoxelSums:
        """Return the sums over its frames, memory-mapped again, so that memory is let go with them."""
        return VoxelSums(**self._arrays(VoxelSums))

    def views(self) -> FreeViews:
        """Return where its frames saw freely, memory-mapped likewise."""
        return FreeViews(**self._arrays(FreeViews))

    def submap(self) -> Submaps:
        """Return the part as a submap, of a build that stores them."""
        about = SubmapFrames(**self._arrays(SubmapFrames))
        return submap_of(self.sums(), about.spread, about.stamps_s, about.poses, self.views().clear_mm)

    def _arrays(self, of: "type[VoxelSums] | type[FreeViews] | type[SubmapFrames]") -> dict[str, np.ndarray]:
        arrays = load_checkpoint(self.folder, PartInfo, self.key).arrays
        return {field.name: arrays[field.name] for field in dataclasses.fields(of)}


@dataclass(frozen=True, slots=True)
class SubmapFrames:
    """What a part stores beside its sums where it is to follow corrected poses.

    Attributes:
        spread: how the points lie within each voxel; see ``Submaps``.
        stamps_s: of its frames.
        poses: world_from_camera of each.
    """

    spread: Float32[np.ndarray, "n 10"]
    stamps_s: Float64[np.ndarray, " f"]
    poses: Float64[np.ndarray, "f 4 4"]

    @classmethod
    def of(cls, total: VoxelAccumulator, recording: Recording, frames: Int64[np.ndarray, " f"]) -> "SubmapFrames":
        """Return that of the frames that were added up."""
        return cls(total.spread(), recording.stamps_s[frames], recording.world_from_camera[frames])


def merge_parts(folders: Sequence[Path | str], out: Path | str) -> MapPart:
    """Add parts up to one part, in the order of their frames, for any order of the folders.

    Args:
        folders: of ``build_part`` or of this, all of one recording and the same settings.
        out: the folder of the sum.

    Raises:
        MapError: there is none, one is damaged or made otherwise than the first, or two cover the same frame.
    """
    if not folders:
        raise MapError(f"There are no parts to merge into {out}; name the folders that build_part wrote.")
    key = load_part(Path(folders[0])).key
    parts = sorted((load_part(Path(folder), key) for folder in folders), key=lambda part: part.info.spans)
    check_disjoint(parts)
    info = PartInfo(
        recording=parts[0].info.recording,
        spans=tuple(sorted(span for part in parts for span in part.info.spans)),
        fused=sum(part.info.fused for part in parts),
        bad_frames=tuple(bad for part in parts for bad in part.info.bad_frames),
        elapsed_s=sum(part.info.elapsed_s for part in parts),
    )
    # The grid only turns metres into voxels, and merging meets none.
    views = concat([part.views() for part in parts])
    save_part(Path(out), key, info, sum_parts(parts, GridSpec()).sums(), views)
    return load_part(Path(out), key)


def sum_parts(parts: Sequence[MapPart], grid: GridSpec) -> VoxelAccumulator:
    """Add the sums of parts, in the order given; only the total is in memory."""
    total = VoxelAccumulator(grid, parts[0].sums().feature_sum.shape[1])
    for part in parts:
        total.merge(part.sums())
    return total


def save_part(
    folder: Path, key: str, info: PartInfo, sums: VoxelSums, views: FreeViews, submap: SubmapFrames | None = None
) -> None:
    """Store a part; a kill at any instant leaves all of it or none."""
    stored = (sums, views) if submap is None else (sums, views, submap)
    arrays = {field.name: getattr(of, field.name) for of in stored for field in dataclasses.fields(of)}
    save_checkpoint(folder, key, info, arrays)


def load_part(folder: Path, key: str | None = None) -> MapPart:
    """Read a part back; see ``load_checkpoint`` for the arguments and errors."""
    found = load_checkpoint(folder, PartInfo, key)
    return MapPart(folder, found.facts, found.key)


def find_part(folder: Path, key: str, span: Span) -> MapPart | None:
    """Return the finished part of this stretch, None where there is none; what is left of a broken one is removed."""
    found = find_checkpoint(folder, PartInfo, key)
    return MapPart(folder, found.facts, key) if found is not None and found.facts.spans == (span,) else None


def check_disjoint(parts: Sequence[MapPart]) -> None:
    """Raise ``MapError`` if two parts cover the same frame: it would count twice."""
    frames = max((span[1] for part in parts for span in part.info.spans), default=0)
    owner = np.full(frames, -1)
    for number, part in enumerate(parts):
        for start, stop, step in part.info.spans:
            taken = np.flatnonzero(owner[start:stop:step] >= 0)
            if len(taken):
                frame = start + step * int(taken[0])
                other = parts[int(owner[frame])]
                raise MapError(f"{other.folder} and {part.folder} both cover frame {frame}; leave one of them out.")
            owner[start:stop:step] = number
