"""`avlmaps info`: describe a map or a recording, and verify it."""

import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit, ground_lines, size_of
from avlmaps.cli.verb import OfRecording, Verb
from avlmaps.core.errors import AvlmapsError, MapError
from avlmaps.core.progress import say
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.types import Recording

MAP_MANIFEST = "map.json"
# `info` opens this many pictures of a recording, spread evenly; `info --verify` opens them all.
DECODED_BY_INFO = 100
# Further names of a sound are shown from this score on.
_LIKELY = 0.1
_MOST_NAMED = 6  # sounds, without --verbose
_MOST_ALIKE = 3  # faults of one kind
_PARTICULARS = re.compile(r"'[^']*'|\S*[\d/]\S*")


@dataclass(frozen=True, kw_only=True)
class Info(OfRecording, Verb):
    """List the contents of a recording or a map, and every fault in it.

    Example: avlmaps info home.avlmap --plot map.png
    """

    path: Annotated[Positional[Path], arg(metavar="REC|MAP")]
    """Recording or map folder."""
    more: Annotated[Positional[tuple[Path, ...]], arg(metavar="[BAG ...]")] = ()
    """Further files of a bag that was split."""
    verify: bool = False
    """Check every file of a map against its checksum, or every picture of a recording."""
    verbose: bool = False
    """Print every detail."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw a top-down view with the path, the sounds, and the names of things and rooms into this picture."""

    def run(self) -> None:
        words = self.opening_words()
        if words and is_map(self.path):
            given = " and ".join(word for word in words if word.startswith("--"))
            say(f"note: {given} has no effect: this is a map.")
        answer = describe_path(self.path, verify=self.verify, plot=self.plot, more=self.more, **self.opening())
        if words:
            answer["options"] = words
        emit(answer, info_lines(answer, verbose=self.verbose), self.json)


def is_map(path: Path) -> bool:
    """Return whether a path is, or should be, a map's folder."""
    return (path / MAP_MANIFEST).exists() or path.suffix == ".avlmap"


def describe_path(
    path: Path,
    format: str = "auto",
    *,
    verify: bool = False,
    plot: Path | None = None,
    more: Sequence[Path] = (),
    **given: Any,
) -> dict[str, Any]:
    """Describe a map or a recording; what is given further says how ``open_recording`` reads it."""
    if is_map(path):
        return _describe_map(path, verify, plot)
    if plot is not None:
        raise UsageError(f"--plot draws a map, and {path} is a recording; build one first.")
    from avlmaps.recordings.open import find_format, open_recording, validate

    find_format(path, format)  # a place that holds no recording has no faults to list
    faults = [str(fault) for fault in validate(path, format, None if verify else DECODED_BY_INFO, more, **given)]
    try:
        recording = open_recording([path, *more], format, **given)
    except AvlmapsError as error:
        for fault in counted([fault for fault in faults if fault != str(error)]):
            say(f"fault: {fault}")
        raise
    parts = {"more": [str(one) for one in more]} if more else {}
    own = _describe_recording(recording)
    return {"path": str(path), **own, **parts, "consistency": _consistency(recording), "faults": faults}


def counted(sentences: Sequence[str]) -> list[str]:
    """Return the first sentences of each kind, which differ in names and numbers alone, and count the others."""
    kinds: dict[str, list[str]] = {}
    for sentence in sentences:
        kinds.setdefault(_PARTICULARS.sub("", sentence), []).append(sentence)
    shown = _MOST_ALIKE
    others = {kind: [f"and {len(of) - shown:,} more like it"] if len(of) > shown else [] for kind, of in kinds.items()}
    return [line for kind, of in kinds.items() for line in (*of[:shown], *others[kind])]


def _consistency(recording: "Recording") -> dict[str, Any] | None:
    from avlmaps.maps.estimate import judge

    try:
        verdict = judge(recording, closely=True)
    except AvlmapsError:
        return None
    numbers = {name: getattr(verdict, name) for name in ("agreeing", "seen_through", "likeness", "median_depth_m")}
    return {
        "verdict": verdict.grade.value,
        "frames": verdict.frames,
        "pairs": verdict.pairs,
        **{name: round(value, 4) if isfinite(value) else None for name, value in numbers.items()},
        "findings": [
            {"reason": finding.reason.value, "verdict": finding.grade.value, "sentence": str(finding)}
            for finding in verdict.findings
        ],
        "unchecked": list(verdict.unchecked),
    }


def _consistency_lines(found: dict[str, Any]) -> list[str]:
    numbers = [f"{found['pairs']} pairs of frames see the same place"]
    numbers += [] if found["agreeing"] is None else [f"{found['agreeing']:.1%} of their points agree"]
    numbers += [] if found["likeness"] is None else [f"brightness correlates by {found['likeness']:.2f}"]
    lines = [f"consistency: {found['verdict']} ({', '.join(numbers)})"]
    lines += [f"  {one['verdict']} ({one['reason']}): {one['sentence']}" for one in found["findings"]]
    return lines + [f"  {sentence}" for sentence in found["unchecked"]]


def _describe_map(path: Path, verify: bool, plot: Path | None) -> dict[str, Any]:
    from avlmaps.maps.store.folder import damaged_files
    from avlmaps.query.avlmap import AVLMap

    if verify and (faults := damaged_files(path)):
        for fault in faults:
            say(f"damaged: {fault}")
        raise MapError(
            f"{len(faults)} of the files of {path} are not what was written; restore it from a copy, or build it again."
        )
    avlmap = AVLMap.open(path)
    answer = describe_map(avlmap)
    if plot is not None:
        answer["plot"] = str(plot_named(avlmap, plot))
    return answer


def plot_named(avlmap: "AVLMap", plot: Path) -> Path:
    """Draw a map with the names of its things and rooms, as far as its models are here."""
    from avlmaps.query.plots import draw_map, save

    models = avlmap.data.info.models
    things, rooms = [], []
    try:
        things = avlmap.things() if "pixels" in models else []
        rooms = avlmap.rooms() if "views" in models else []
    except AvlmapsError as error:  # a map can be looked at without the models that made it
        say(f"note: the picture has no names: {error}")
    return save(draw_map(avlmap, things, rooms), plot)


def describe_map(avlmap: "AVLMap") -> dict[str, Any]:
    """Describe a map: its counts and models, its sounds with names, the rules that it was built by."""
    from avlmaps.query.selection import map_answer

    return map_answer(avlmap, note=lambda error: say(f"note: the sounds have no names here. {error}"))


def _describe_recording(recording: "Recording") -> dict[str, Any]:
    rig, audio, up = recording.rig, recording.audio, recording.up_in_world
    heard = audio and {
        "file": audio.label or audio.path.name,
        "rate_hz": audio.rate_hz,
        "duration_s": audio.duration_s,
        "start_s": audio.start_s,
    }
    return {
        "format": recording.format,
        "frames": len(recording),
        "duration_s": round(recording.duration_s, 3),
        "rgb": f"{rig.rgb.width}x{rig.rgb.height}",
        "depth": f"{rig.depth.width}x{rig.depth.height}",
        "intrinsics": {
            name: {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
            for name, camera in (("rgb", rig.rgb), ("depth", rig.depth))
        },
        "up_in_world": None if up is None else [float(value) for value in up],
        "topics": dict(recording.topics),
        "audio": heard,
        "notices": list(recording.notices),
        "fingerprint": recording.fingerprint,
    }


def info_lines(answer: dict[str, Any], *, verbose: bool) -> list[str]:
    """Lay out what `build` and `info` report: every entry, or what a person decides by, and what to do next."""
    shown = {key: value for key, value in answer.items() if key != "plot" and (verbose or key in _BRIEF)}
    lines = _entry_lines(shown, _LAYOUTS if verbose else _LAYOUTS | _BRIEF_LAYOUTS)
    drawn = [f"wrote {answer['plot']}"] if "plot" in answer else []
    return [*lines, *([] if verbose else next_lines(answer)), *drawn]


def next_lines(answer: dict[str, Any]) -> list[str]:
    """Return what to do next with a map or a recording; one that contradicts itself is not to be built."""
    path = shlex.join([str(answer["path"]), *answer.get("more", ()), *answer.get("options", ())])
    if "voxels" in answer:
        words = "something red" if answer.get("profile") == "colours" else "where is the chair?"
        query = [f'avlmaps query {path} "{words}"'] if "pixels" in answer["models"] else []
        others = [f"avlmaps view {path}", f"avlmaps info {path} --verbose   (every detail)"]
        return [f"{'     ' if number else 'next:'} {line}" for number, line in enumerate([*query, *others])]
    out = shlex.quote(f"{Path(answer['path']).stem or 'home'}.avlmap")
    is_impossible = (answer.get("consistency") or {}).get("verdict") == "impossible"
    first = "correct what is impossible, as said above" if is_impossible else f"avlmaps build {path} --out {out}"
    return [
        f"next: {first}",
        f"      avlmaps info {path} --verify    (decodes every picture)",
        f"      avlmaps info {path} --verbose   (every detail)",
    ]


def _entry_lines(entries: dict[str, Any], layouts: dict[str, Callable[[Any], list[str]]]) -> list[str]:
    lines: list[str] = []
    for key, value in entries.items():
        if value in (None, [], {}) and key != "sounds":
            continue
        if key in layouts:
            lines += layouts[key](value)
        elif isinstance(value, list) and isinstance(value[0], str):
            lines += [f"{key}:", *[f"  {line}" for line in value]]
        else:
            lines.append(f"{key.replace('_', ' ')}: {f'{value:.6g}' if isinstance(value, float) else value}")
    return lines


def _sound_lines(sounds: list[dict[str, Any]]) -> list[str]:
    lines = [f"sounds: {len(sounds)}"]
    for sound in sounds:
        names = list(zip(sound.get("names", []), sound.get("confidences", []), strict=True))
        shown = [pair for pair in names if pair[1] >= _LIKELY] or names[:1]  # an unlikely name only as the best one
        named = ": " + ", ".join(f"{name} {confidence:.2f}" for name, confidence in shown) if shown else ""
        begin_s, end_s = max(sound["onset_s"], 0.0), sound["offset_s"]
        lines.append(f"  {begin_s:8.2f} - {end_s:.2f} s at {place_text(sound['position'])}{named}")
    return lines


def _sound_line(sounds: list[dict[str, Any]]) -> list[str]:
    names = list(dict.fromkeys(sound["names"][0] for sound in sounds if sound.get("names")))
    more = ", ..." if len(names) > _MOST_NAMED else ""
    return [f"sounds: {len(sounds)}" + (f" ({', '.join(names[:_MOST_NAMED])}{more})" if names else "")]


# What `build` and `info` print without --verbose: what there is, and what may be wrong with it.
_BRIEF = frozenset({
    "path", "format", "frames", "bad_frames", "keyframes", "voxels", "sounds", "profile", "bytes", "ground",
    "elapsed_s", "duration_s", "rgb", "depth", "audio", "topics", "consistency", "notices", "faults",
})  # fmt: skip
_BRIEF_LAYOUTS: dict[str, Callable[[Any], list[str]]] = {
    "sounds": _sound_line,
    "bad_frames": lambda count: [f"bad frames: {count}"] if count else [],
    "ground": lambda ground: ground_lines(ground)[:1],
    "audio": lambda audio: [f"audio: {audio['file']}, {audio['duration_s']:.1f} s"],
    "voxels": lambda count: [f"voxels: {count:,}"],
    "faults": lambda faults: ["faults:", *[f"  {line}" for line in counted(faults)]],
}
# How the entries of `info` are laid out, where a plain line would not do.
_LAYOUTS: dict[str, Callable[[Any], list[str]]] = {
    "sounds": _sound_lines,
    "consistency": _consistency_lines,
    "topics": lambda topics: ["topics:", *[f"  {use}: {topic}" for use, topic in topics.items()]],
    "ground": ground_lines,
    "bytes": lambda count: [f"size: {size_of(count)}"],
    "voxels_removed": lambda removed: [
        "voxels removed: " + ", ".join(f"{count} {why.replace('_', ' ')}" for why, count in removed.items())
    ],
    "level_from_recording": lambda rows: [
        "level from recording:", *["  " + " ".join(f"{value:7.4f}" for value in row) for row in rows]
    ],
}  # fmt: skip
