"""From the words of a command to calls of the library, and back to plain values. Heavy imports stay inside."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from avlmaps.cli.output import UsageError
from avlmaps.core.errors import AvlmapsError
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from avlmaps.cli.verbs import Build, Info, Query, Record
    from avlmaps.core.camera import Pinhole
    from avlmaps.core.question import Part
    from avlmaps.maps.store.reader import StoredMap
    from avlmaps.perception.cache.feature_store import CacheSettings
    from avlmaps.perception.profiles import Profile
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.question import Answer
    from avlmaps.recordings.types import Recording

MAP_MANIFEST = "map.json"
# `info` opens so many pictures of a recording, spread evenly; `info --verify` opens them all.
DECODED_BY_INFO = 100


def record(verb: "Record") -> dict[str, Any]:
    """Record a simulated walk and tell what was heard."""
    from avlmaps.sim.recorder import RecordSettings, record_scene
    from avlmaps.sim.scenes import open_scene
    from avlmaps.sim.sensor_settings import OdometryFaults

    begin = perf_counter()
    if verb.seed < 0:
        raise UsageError(f"--seed takes a number of 0 or more, not {verb.seed}.")
    settings = RecordSettings(
        size=_size(verb.size),
        fov_deg=verb.fov_deg,
        fps=verb.fps,
        sensor=verb.sensor,
        hearing=verb.hearing,
        sounds=verb.sounds,
        categories=verb.category,
        sources=verb.sources,
        ambiguous=verb.ambiguous,
        drift=OdometryFaults() if verb.drift else None,
        max_frames=verb.max_frames,
        semantic=verb.semantic,
        colour=verb.colour,
        workers=verb.workers,
    )
    scene = open_scene(verb.scene)
    made = record_scene(scene, verb.out, settings, verb.seed)
    names = [*(thing.name for thing in scene.objects), None]  # an instance of -1 is no object
    events = [
        {
            "onset_s": round(s.onset_s, 4),
            "offset_s": round(s.offset_s, 4),
            "category": s.source.category,
            "clip": s.source.clip,
            "position": [round(value, 4) for value in s.robot],
            "source": [round(value, 4) for value in s.source.position],
            "object": names[s.source.instance],
        }
        for s in made.heard
    ]
    return {
        "recording": str(verb.out),
        "scene": scene.name,
        "frames": made.frames,
        "duration_s": round(made.duration_s, 3),
        "hearing": verb.hearing,
        "sounds": len(events),
        "events": events,
        "floor": made.floor.to_json(),
        "elapsed_s": round(perf_counter() - begin, 3),
    }


def _size(words: str) -> tuple[int, int]:
    width, _, height = words.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise UsageError(f"--size takes columns and rows such as 320x240, not {words!r}.")
    return int(width), int(height)


def build(verb: "Build") -> dict[str, Any]:
    """Build a map and describe it."""
    from avlmaps.maps.build import build_map
    from avlmaps.maps.settings import BuildSettings, FrameSettings, FusionSettings, GravitySettings
    from avlmaps.query.rules import build_settings
    from avlmaps.recordings.open import open_recording

    begin = perf_counter()
    if verb.resume and verb.fresh:
        raise UsageError("--resume goes on with a stopped build and --fresh begins anew; choose one of them.")
    if verb.rules == "paper" and verb.sensor not in ("auto", "none"):
        raise UsageError(
            f"The paper's rules use every depth as it is; leave out --sensor {verb.sensor} or --rules paper."
        )
    used, cache = (
        _chosen_profile(verb.profile, [word for words in verb.model for word in words]),
        _cache(verb.feature_cache, verb.feature_cache_gb),
    )
    recording = open_recording(verb.recording, format=verb.format, audio=verb.audio, topics=_topics(verb.topics))
    for notice in recording.notices:
        say(f"note: {notice}")
    settings = BuildSettings(
        voxel_size_m=verb.voxel_size_m,
        frames=FrameSettings(step=verb.frame_step, max_bad_share=verb.max_bad_share),
        fusion=FusionSettings(max_depth_m=verb.max_depth_m, sensor=verb.sensor),
        gravity=GravitySettings(camera_height_m=verb.camera_height_m),
        seed=verb.seed,
    )
    stored = build_map(
        recording,
        verb.out,
        used,
        build_settings(verb.rules, settings),
        cache=cache,
        resume=not verb.fresh,
        overwrite=verb.overwrite,
    )
    return {**described(stored), "elapsed_s": round(perf_counter() - begin, 3)}


def _chosen_profile(name: str, words: "Sequence[str]") -> "Profile":
    """Return the profile with the backends and models that were chosen instead of its own."""
    from avlmaps.core.registry import Kind
    from avlmaps.perception.profiles import profile

    perceived = {kind.value: kind for kind in Kind if kind is not Kind.WORDS}
    choices: dict[Kind, str] = {}
    for word in words:
        module, _, backend = word.partition("=")
        if module not in perceived or not backend.partition("@")[0]:
            raise UsageError(
                f"--model takes words like pixels=clip-patches@openai/clip-vit-large-patch14, not {word!r}; the "
                f"modules are {', '.join(perceived)}."
            )
        if perceived[module] in choices:
            raise UsageError(f"--model names {module} twice; choose one.")
        choices[perceived[module]] = backend
    return profile(name).choosing(choices)


def _cache(place: str, limit_gb: float) -> "CacheSettings":
    from avlmaps.perception.cache.feature_store import CacheSettings

    if place in ("auto", "off"):
        return CacheSettings(place, limit_gb)
    return CacheSettings(Path(place).expanduser(), limit_gb)


def _topics(words: tuple[str, ...]) -> dict[str, str]:
    for word in words:
        if not all(word.partition("=")):
            raise UsageError(f"--topics takes words like rgb=/camera/color/image_raw, not {word!r}.")
    return dict(word.split("=", 1) for word in words)


def describe_path(path: Path, format: str, verify: bool, plot: Path | None) -> dict[str, Any]:
    """Describe a map or a recording."""
    if (path / MAP_MANIFEST).exists() or path.suffix == ".avlmap":
        return _describe_map(path, verify, plot)
    if plot is not None:
        raise UsageError(f"--plot draws a map, and {path} is a recording; build one first.")
    from avlmaps.recordings.open import find_format, open_recording
    from avlmaps.recordings.validate import validate

    find_format(path, format)  # a place that holds no recording has no faults to list
    faults = [str(fault) for fault in validate(path, format, None if verify else DECODED_BY_INFO)]
    try:
        recording = open_recording(path, format=format)
    except AvlmapsError:
        for fault in faults:
            say(f"fault: {fault}")
        raise
    return {**_describe_recording(recording), "faults": faults}


def repair(verb: "Info") -> dict[str, Any]:
    """Build the damaged files of a map again and name them."""
    from avlmaps.maps.repair import repair_map
    from avlmaps.recordings.open import open_recording

    recording = None
    if verb.recording is not None:
        recording = open_recording(verb.recording, format=verb.format, audio=verb.audio)
    done = repair_map(verb.path, recording)
    if not done.files:
        say(f"every file of {verb.path} is whole; there is nothing to repair.")
    elif done.rebuilt:
        say(f"note: the whole map was built again: {verb.path} now differs in last bits from what it was.")
    return {"repaired": list(done.files)}


def _describe_map(path: Path, verify: bool, plot: Path | None) -> dict[str, Any]:
    from avlmaps.maps.store.reader import open_stored

    stored = open_stored(path, verify=verify)
    told = described(stored)
    if plot is not None:
        from avlmaps.query.plots import plot_map

        told["plot"] = str(plot_map(stored, plot))
    return told


def described(stored: "StoredMap") -> dict[str, Any]:
    """Describe a map, the names of its sounds, and the rules that it was built by."""
    from avlmaps.maps.store.reader import describe
    from avlmaps.query.rules import rules_of

    return {**with_sound_names(describe(stored), stored), "rules": rules_of(stored.info.settings)}


def with_sound_names(told: dict[str, Any], stored: "StoredMap") -> dict[str, Any]:
    """Return what is told of a map, each sound with the names that fit it best, where its sound model is here."""
    from avlmaps.query.avlmap import AVLMap

    if not told["sounds"]:
        return told
    try:
        heard = AVLMap(stored).sounds()
    except AvlmapsError as error:
        say(f"note: the sounds have no names here. {error}")
        return told
    sounds = [
        {**sound, "names": list(event.names), "confidences": list(event.confidences)}
        for sound, event in zip(told["sounds"], heard, strict=True)
    ]
    return {**told, "sounds": sounds}


def _describe_recording(recording: "Recording") -> dict[str, Any]:
    rig, audio = recording.rig, recording.audio
    up = recording.up_in_world
    return {
        "path": str(recording.path),
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
        "audio": None
        if audio is None
        else {
            "file": audio.path.name,
            "rate_hz": audio.rate_hz,
            "duration_s": audio.duration_s,
            "start_s": audio.start_s,
        },
        "notices": list(recording.notices),
        "fingerprint": recording.fingerprint,
    }


def ask(verb: "Query") -> dict[str, Any]:
    """Query a map with a sentence or with parts."""
    from avlmaps.core.question import Modality, Question
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.rules import query_settings

    parts = _parts(verb)
    only_files = all(part.is_file for part in parts)
    if (not verb.sentence.strip() and not parts) or (verb.sentence.strip() and not only_files):
        raise UsageError(
            "query takes a sentence, or parts (--object, --sound, --sound-clip, --area, --image), and not both: "
            'avlmaps query MAP "the red cabinet near the sound of a dog"'
        )
    if verb.top < 1:
        raise UsageError(f"--top is {verb.top}; it must be 1 or more.")
    asked = AVLMap.open(verb.map, query_settings(verb.rules))
    if verb.sentence.strip():
        return _asked_in_words(verb, asked)
    question = Question.of(parts, Modality(verb.primary) if verb.primary else None)
    camera = _camera_for(verb.image or _first_image(question.parts), verb.intrinsics)
    return _plotted(verb, asked.ask(question, top=verb.top, intrinsics=camera))


_MOST_COUNTED, _AS_LIKELY = 200, 0.5  # instances count that score at least half of the best one


def _asked_in_words(verb: "Query", asked: "AVLMap") -> dict[str, Any]:
    """Answer a sentence; several questions in it are alternatives, and the best answer counts."""
    from avlmaps.core.question import Modality, Question
    from avlmaps.language.commands import Given
    from avlmaps.language.intents import Ask
    from avlmaps.language.questions import read_question

    files = (None if path is None else str(path) for path in (verb.image, verb.sound_clip))
    sentence = read_question(verb.sentence, Given(*files, knows=lambda _: True))
    counted = sentence.inquiry.ask is Ask.HOW_MANY
    answers: list[Answer] = []
    for question in sentence.questions:
        if verb.primary:
            question = Question.of(question.parts, Modality(verb.primary))
        used = {part.query for part in question.parts}
        if any(path is not None and str(path) not in used for path in (verb.image, verb.sound_clip)):
            raise UsageError("The sentence does not speak of the file; say 'this photo' or 'this recording' in it.")
        camera = _camera_for(verb.image or _first_image(question.parts), verb.intrinsics)
        answers.append(asked.ask(question, top=_MOST_COUNTED if counted else verb.top, intrinsics=camera))
    answer = max(answers, key=lambda one: (one.found, one.goals[0].score if one.goals else 0.0))
    told = _plotted(verb, answer)
    if counted:
        likely = [goal for goal in answer.goals if goal.score >= _AS_LIKELY * answer.goals[0].score]
        told = {**told, "goals": told["goals"][: verb.top], "count": len(likely) if answer.found else 0}
    notes = {"notes": list(sentence.notes)} if sentence.notes else {}
    return {**told, **notes}


def _plotted(verb: "Query", answer: "Answer") -> dict[str, Any]:
    told = answer.to_json()
    if verb.plot is not None and answer.heat is not None:
        told["plot"] = str(answer.heat.plot(verb.plot, top=verb.top))
    return told


def _parts(verb: "Query") -> list["Part"]:
    from avlmaps.core.question import Modality, Part

    named = (
        (Modality.OBJECT, verb.object, False),
        (Modality.IMAGE, verb.image, True),
        (Modality.SOUND, verb.sound, False),
        (Modality.SOUND, verb.sound_clip, True),
        (Modality.AREA, verb.area, False),
    )
    return [Part(modality, str(query), is_file=is_file) for modality, query, is_file in named if query is not None]


def _first_image(parts: "tuple[Part, ...]") -> Path | None:
    from avlmaps.core.question import Modality

    return next((Path(part.query) for part in parts if part.modality is Modality.IMAGE), None)


def _camera_for(picture: Path | None, intrinsics: str | None) -> "Pinhole | None":
    """Read ``fx,fy,cx,cy`` for a picture; None stays None."""
    if intrinsics is None:
        return None
    if picture is None:
        raise UsageError("--intrinsics belongs to a photo (--image); there is none.")
    from avlmaps.query.modalities.image import read_picture

    height, width = read_picture(picture).shape[:2]
    return _camera_of(intrinsics, width, height)


def _camera_of(intrinsics: str, width: int, height: int) -> "Pinhole":
    from avlmaps.core.camera import Pinhole

    try:
        fx, fy, cx, cy = (float(word) for word in intrinsics.split(","))
        return Pinhole(fx, fy, cx, cy, width=width, height=height)
    except ValueError:
        raise UsageError(
            f"--intrinsics takes fx,fy,cx,cy in pixels, such as 525,525,320,240; not {intrinsics!r}."
        ) from None


def locate_photo(map_path: Path, picture: Path, intrinsics: str | None) -> dict[str, Any]:
    """Locate a photo."""
    from avlmaps.core.poses import FRAME
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.modalities.image import read_picture

    rgb = read_picture(picture)
    given = None if intrinsics is None else _camera_of(intrinsics, rgb.shape[1], rgb.shape[0])
    found = AVLMap.open(map_path).locate(rgb, given)
    pose, camera = found.world_from_camera, found.camera
    if pose is not None and given is not None and camera != given:
        say(f"note: the focal length {given.fx:g} does not fit the photo; {camera.fx:.1f} was used.")
    return {
        "world_from_camera": None if pose is None else [[float(value) for value in row] for row in pose],
        "inliers": int(found.inliers),
        "reference": found.reference_stamp_s,
        "frame": FRAME,
        "score": found.score,
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "elapsed_ms": found.elapsed_ms,
    }


def teach(name: str, clips: tuple[Path, ...]) -> dict[str, Any]:
    """Teach a kind of sound from clips, or forget it where there are none."""
    from avlmaps.perception.enrolment import forget_sound, taught_sounds, teach_sound

    if clips:
        teach_sound(name, list(clips))
    else:
        forget_sound(name)
    return {"name": name, "clips": len(clips), "taught": [sound.name for sound in taught_sounds()]}
