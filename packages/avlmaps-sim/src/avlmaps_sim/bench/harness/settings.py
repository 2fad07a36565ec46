"""Which scenes a suite runs on, how they are recorded and mapped, and the checksums that name the models."""

import csv
import io
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from avlmaps.core.errors import AudioError, AvlmapsError, BackendError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.perception.encoders import Encoders, encoders_of, profile, read_choices
from avlmaps.query.settings import Rules
from avlmaps_sim.mixing.clips import INDEX, find_clips, index_rows

_SOURCE = re.compile(r"\d-(\d+)-[A-Z]")


@cache
def trained_sources() -> frozenset[int]:
    """Return freesound's numbers of the recordings that trained the shipped weights, where their notes name them."""
    notes = files("avlmaps.perception.embedded") / "weights" / "sounds.json"
    return frozenset(json.loads(notes.read_text(encoding="utf-8")).get("sources", ()))


def unheard_rows(folder: Path) -> list[dict[str, str]]:
    """Return the rows of a folder's index that the shipped weights were not trained on.

    ``AudioError``: there is no index, or no such row.
    """
    rows = index_rows(folder)
    if rows is None:
        raise AudioError(
            f"{folder} has no {INDEX} and is not ESC-50, so it is not known which clips the sound encoder was trained "
            f"on; add an {INDEX} with the columns path, category and fold (empty for a clip of no training), or choose "
            f"{option('sound-clips', 'all')}."
        )
    unheard = [row for row in rows if not _trained(row)]
    if not unheard:
        raise AudioError(
            f"The sound encoder was trained on all {len(rows)} clips that the index of {folder} names; add some "
            "without a fold."
        )
    return unheard


def _trained(row: dict[str, str]) -> bool:
    source = _SOURCE.search(Path(row["path"]).name)
    return bool(row.get("fold")) or (source is not None and int(source[1]) in trained_sources())


def unheard_folder(folder: Path, work: Path) -> Path:
    """Return a folder whose index lists the unheard clips of another one, which stay where they are.

    ``AudioError``: see ``unheard_rows``.
    """
    rows = unheard_rows(folder)
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("path", "category"))
    table.writerows((str((folder / row["path"]).resolve()), row["category"]) for row in rows)
    content = text.getvalue().encode()
    made = work / f"clips-{sha256(content).hexdigest()[:12]}"
    made.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(made / INDEX, content)
    return made


def models_of(name: str, words: Sequence[str] = ()) -> Encoders:
    """Return a profile's encoders, with the backends or models that ``module=backend[@model]`` say instead of some.

    ``BackendError``: a word is not of that form, or there is no such profile or backend.
    """
    try:
        choices = read_choices(words)
    except ValueError as problem:
        raise BackendError(f"A choice of models {problem}") from None
    return encoders_of(profile(name).choosing(choices))


def checksums(used: Encoders) -> dict[str, str]:
    """Return the checksum of every model of some encoders, by module. Loads the models: one that is missing raises.

    ``BackendError``: a model's package or files are missing.
    """
    return {kind.value: card.checksum for kind, card in used.cards().items()}


@cache
def shipped_checksums() -> dict[str, str]:
    """Return the checksums of the models that ship with this package (the profile ``embedded``, and its words)."""
    from avlmaps.core.registry import load

    words = load(Kind.WORDS, "embedded")
    return {**checksums(Encoders.named("embedded")), "words": words.card.checksum}  # pyright: ignore[reportAttributeAccessIssue]


Clips = Literal["unheard", "all"]


T = TypeVar("T")


class TaskError(AvlmapsError):
    """Tasks cannot be read, or do not fit the suite."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """How the scenes of a set of tasks were recorded: the same tasks need the same recordings."""

    hearing: str  # ``overlay`` or ``acoustic``
    frames: int  # limit of frames in a scene
    sources: int  # limit of sounds in a scene
    ambiguous: int  # how many kinds of sound play in several places
    sensor: str  # whose faults colour and depth have
    sounds: str  # name of the folder of clips; ``""`` for sounds made by rule
    seed: int  # of walks, sounds and tasks
    clips: str = "all"  # which clips of the folder; see ``SceneSettings``
    places: int = 2  # in how many


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSettings:
    """Which scenes a benchmark runs on, and how they are recorded and mapped."""

    scenes: tuple[str, ...]  # names of scenes
    profile: str = "embedded"  # the models that map them
    models: tuple[str, ...] = ()  # other backends than the profile's, ``module=backend[@model]``
    rules: Rules = "ours"  # how they are mapped and queried: ``ours``, or the ``paper``'s (``avlmaps.query.settings``)
    # How sounds reach the microphone; a sound's place is the robot's (``overlay``) or its source's.
    hearing: Literal["overlay", "acoustic"] = "overlay"
    sounds: Path | None = None  # folder of clips; made by rule if None
    # ``unheard``: those of the folder that the shipped sound encoder was not trained on; ``all``.
    clips: Clips = "unheard"
    sensor: Literal["clean", "kinect", "realsense"] = "clean"  # whose faults colour and depth have
    frames: int = 600  # limit of frames a scene
    sources: int = 14  # limit of sounds a scene
    ambiguous: int = 2  # how many kinds of sound play in several places
    places: int = 3  # in how many
    jobs: int = 0  # scenes side by side; 0 takes as many as there are cores
    seed: int = 0  # of walks, sounds and all queries
    # Tasks to use instead of making new ones; how the scenes were recorded comes from the file.
    load: Path | None = None
    save: Path | None = None  # where to write the tasks

    @property
    def recorded(self) -> Recorded:
        """How the scenes are recorded."""
        sounds = "" if self.sounds is None else self.sounds.resolve().name
        clips = "all" if self.sounds is None else self.clips
        return Recorded(
            self.hearing, self.frames, self.sources, self.ambiguous, self.sensor, sounds, self.seed, clips, self.places
        )  # fmt: skip

    @property
    def used(self) -> Encoders:
        """The encoders of the profile, with the models that were chosen.

        ``BackendError``: there is no such profile or backend.
        """
        return models_of(self.profile, self.models)

    def given(self, kind: type[T], schema_version: int) -> T | None:
        """Return the tasks that are to be loaded. ``TaskError``: they cannot be, or were made with other sounds."""
        if self.load is None:
            return None
        read: Any = load_versioned(self.load, kind, schema_version)
        if (sounds := read.recorded.sounds) != self.recorded.sounds:
            wanted = f"name the folder {sounds!r} with" if sounds else "leave out"
            raise TaskError(f"The tasks {self.load} were made with other sounds; {wanted} {option('sounds')}.")
        return read

    def checked(self) -> dict[str, str]:
        """Check everything that is given before anything is recorded; return the models' checksums by module.

        ``BackendError``: a model is not known, or missing. ``AudioError``: the folder of clips cannot be used.
        """
        weights = checksums(self.used)
        if self.sounds is not None:
            find_clips(self.sounds)
            if self.clips == "unheard":
                unheard_rows(self.sounds)
        return weights


def save_versioned(tasks: object, path: Path) -> None:
    """Write a dataclass that has a ``schema_version`` as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(path, msgspec.json.format(msgspec.json.encode(tasks), indent=1) + b"\n")


def load_versioned(path: Path, kind: type[T], schema_version: int) -> T:
    """Read what ``save_versioned`` wrote. ``TaskError``: there is nothing, it is of another schema, or damaged."""
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise TaskError(f"The tasks {path} cannot be read ({fault.strerror}); check the name.") from fault
    try:
        version = msgspec.json.decode(content).get("schema_version")
        if version == schema_version:
            return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, msgspec.ValidationError, AttributeError) as fault:
        raise TaskError(
            f"The tasks {path} are damaged ({fault}); save them again with {option('save-tasks')}."
        ) from fault
    raise TaskError(f"The tasks {path} are of schema {version}, this avlmaps reads {schema_version}; save them again.")


def in_turn(made: Sequence[Sequence[T]], most: int | None) -> list[T]:
    """Take up to ``most`` from scenes in turn (the first of each, then the second of each), in the order of scenes."""
    turns = sorted((number, scene) for scene, own in enumerate(made) for number in range(len(own)))
    return [made[scene][number] for scene, number in sorted((scene, number) for number, scene in turns[:most])]
