"""What a page can ask: one or two maps, the files that its user gave it, and a robot. No HTTP here."""

import shutil
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.modalities.image import read_picture
from avlmaps.query.modalities.sound import read_clip
from avlmaps.query.naming import VoxelNamer, keyframes_that_saw
from avlmaps.recordings.containers import self_contained_suffix
from avlmaps.view.labels import Labels, palettes
from avlmaps.view.layout import Layout, as_bytes
from avlmaps.view.route import Guide, MakeRobot
from avlmaps.view.uploads import Upload, without_paths

if TYPE_CHECKING:
    from avlmaps.core.question import Question
    from avlmaps.query.contents import Thing

TOP = 5  # goals on a page
MOST_UPLOAD_BYTES = 32_000_000
_MOST_UPLOADS = 12  # the oldest file is forgotten then
_MOST_VIEWS = 12  # keyframes that are named of those which saw a voxel
_PHOTO_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")


class MapOnPage:
    """One map on the page: how it is drawn, and what is written on it, which is computed in the background.

    Attributes:
        avlmap: the map.
        layout: how it is drawn.
    """

    def __init__(self, avlmap: AVLMap, most: int | None = None) -> None:
        self.avlmap = avlmap
        self.layout = Layout(avlmap, most)
        self._is_file = most is not None
        self._labels: Labels | None = None
        self._namer: VoxelNamer | None = None
        self._lock = threading.Lock()

    @property
    def labels(self) -> Labels:
        """Its contents; the first call computes them, others wait for it."""
        with self._lock:
            if self._labels is None:
                # A map object of its own, so that questions need not wait for it; for a file they come later.
                own = self.avlmap if self._is_file else AVLMap(self.avlmap.stored, self.avlmap.settings)
                self._labels = Labels.of(self.layout.with_map(own))
            return self._labels

    def describe_contents(self) -> dict[str, Any]:
        """Return things, sounds and rooms with the colours of the page."""
        labels = self.labels
        return labels.describe(self.layout) | {"palettes": palettes(labels)}

    def describe_voxel(self, drawn: int) -> dict[str, Any]:
        """Return what a voxel is taken for, by its number in the order of drawing."""
        if not 0 <= drawn < len(self.layout):
            raise QueryError(f"There is no voxel {drawn}; the map has {len(self.layout):,}.")
        row, avlmap = int(self.layout.order[drawn]), self.avlmap
        names: list[tuple[str, float]] = []
        note, calibrated = "", True
        try:
            self._namer = self._namer or VoxelNamer(avlmap.stored)
            names, calibrated = self._namer.likeliest(row), self._namer.calibrated
        except AvlmapsError as fault:
            note = str(fault)
        views = keyframes_that_saw(avlmap.stored, avlmap.space, row)
        voxels = avlmap.stored.voxels
        thing = self._thing_at(row)
        return {
            "position": [round(float(value), 4) for value in avlmap.points[row]],
            "color": [int(value) for value in voxels.rgb[row]],
            "names": [{"name": name, "confidence": round(share, 4)} for name, share in names],
            "calibrated": calibrated,
            "thing": None if thing is None else {"name": thing.name, "confidence": thing.confidence},
            "last_seen_s": round(float(voxels.last_seen_s[row]), 3),
            "pixels": int(voxels.hits[row]),
            "views": len(views),
            "seen_by": [int(number) for number in views[:_MOST_VIEWS]],
            "note": note,
        }

    def _thing_at(self, row: int) -> "Thing | None":
        if self._labels is None:  # not computed yet: nothing waits for it here
            return None
        return next((thing for thing in self._labels.things if (thing.rows == row).any()), None)


class ViewSession:
    """Everything behind one page. Safe to use from several threads.

    Attributes:
        maps: one, or two that are compared.
        guide: plans commands on the first map.
    """

    def __init__(self, maps: Sequence[AVLMap], robot: MakeRobot | None = None, most: int | None = None) -> None:
        """Lay out the maps, for a file each with up to ``most`` voxels, and make what plans commands."""
        self.maps = [MapOnPage(avlmap, most) for avlmap in maps]
        self.guide = Guide(maps[0], robot)
        self._asking = threading.Lock()
        self._uploads: OrderedDict[str, Upload] = OrderedDict()
        self._folder: Path | None = None
        self._counted = 0

    def prepare(self) -> None:
        """Compute in the background what pages need soon: the contents."""

        def work() -> None:
            for one in self.maps:
                _ = one.labels

        threading.Thread(target=work, name="avlmaps view: contents", daemon=True).start()

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to begin."""
        return {
            "maps": [one.layout.describe() for one in self.maps],
            "palettes": palettes(),
            "robot": self.guide.has_robot,
        }

    def ask(
        self, sentence: str, photo: str | None = None, clip: str | None = None, *, question: "Question | None" = None
    ) -> tuple[dict[str, Any], bytes]:
        """Ask all maps.

        Args:
            sentence: the words.
            photo: number of an uploaded photo, as `upload` returned it.
            clip: of an uploaded clip.
            question: the query itself, where the sentence is only its title.

        Returns:
            The answers, and after one another the heat of each map's voxels in the order of drawing, a byte each.

        Raises:
            QueryError: the query is empty, or not understood.
        """
        files = self._upload(photo), self._upload(clip)
        image, recording = (None if upload is None else upload.path for upload in files)
        answers, heats = [], []
        with self._asking:
            for one in self.maps:
                try:
                    answer = one.avlmap.ask(question or sentence, TOP, image=image, clip=recording)
                except AvlmapsError as fault:
                    raise QueryError(without_paths(str(fault), *files)) from fault
                heat = answer.heat
                answers.append(_cleaned(answer.to_dict(), *files))
                layout = one.layout
                heats.append(as_bytes(heat.shown_at(layout.order)) if heat is not None else bytes(len(layout)))
        return {"question": sentence, "answers": answers}, b"".join(heats)

    def obey(
        self, command: str, photo: str | None = None, clip: str | None = None, *, again: bool = False
    ) -> dict[str, Any]:
        """Plan a command on the first map, and drive it where there is a robot.

        Raises:
            LanguageError: it is not understood.
        """
        files = self._upload(photo), self._upload(clip)
        with self._asking:
            return _cleaned(self.guide.obey(command, *files, again=again), *files)

    def upload(self, kind: str, name: str, content: bytes) -> str:
        """Keep a photo or a clip to ask with; return its number.

        Args:
            kind: ``photo`` or ``clip``.
            name: what its owner calls it.
            content: the file.

        Raises:
            QueryError: it is neither, too large, or cannot be read.
        """
        if kind not in ("photo", "clip"):
            raise QueryError(f"A page takes a photo or a clip, not {kind[:40]!r}.")
        name = PurePath(name.replace("\\", "/")).name[:100] or kind
        if not content or len(content) > MOST_UPLOAD_BYTES:
            raise QueryError(
                f"The {kind} {name} has {len(content):,} bytes; give one of up to {MOST_UPLOAD_BYTES:,} bytes."
            )
        suffix = PurePath(name).suffix.lower()
        if kind == "photo":
            suffix = suffix if suffix in _PHOTO_SUFFIXES else ""
        elif (suffix := self_contained_suffix(content)) is None:
            raise QueryError(f"The clip {name} cannot be read as sound: give a wav, flac, ogg, mp3, m4a or mkv sound.")
        with self._asking:
            self._folder = self._folder or Path(tempfile.mkdtemp(prefix="avlmaps-view-"))
            self._counted += 1
            number = str(self._counted)
            path = self._folder / f"{number}{suffix}"
            kept = Upload(path, name)
            path.write_bytes(content)
            try:
                _ = read_picture(path) if kind == "photo" else read_clip(path)
            except AvlmapsError as fault:
                path.unlink()
                raise QueryError(without_paths(str(fault), kept)) from fault
            self._uploads[number] = kept
            while len(self._uploads) > _MOST_UPLOADS:
                _, oldest = self._uploads.popitem(last=False)
                oldest.path.unlink(missing_ok=True)
        return number

    def close(self) -> None:
        """Remove the files that were given."""
        self._uploads.clear()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    def _upload(self, number: str | None) -> Upload | None:
        if not number:
            return None
        kept = self._uploads.get(number)
        if kept is None:
            raise QueryError("The file is not stored any more; choose it again.")
        return kept


def _cleaned(answer: Any, *uploads: Upload | None) -> Any:
    """Return JSON whose texts name no file of this machine."""
    if isinstance(answer, str):
        return without_paths(answer, *uploads)
    if isinstance(answer, dict):
        return {key: _cleaned(value, *uploads) for key, value in answer.items()}
    return [_cleaned(value, *uploads) for value in answer] if isinstance(answer, list | tuple) else answer
