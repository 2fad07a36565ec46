"""`avlmaps record`: record a simulated walk."""

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import arg

from avlmaps.cli.output import UsageError, emit, table_lines
from avlmaps.cli.verb import Verb
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from avlmaps_sim.scene import Scene
    from avlmaps_sim.walk import WalkSettings


@dataclass(frozen=True, kw_only=True)
class Record(Verb):
    """Record the camera and microphone of a simulated robot that drives through a building, with the truth beside it.

    The same scene, settings and seed give the same bytes.

    Example: avlmaps record --scene house:7 --out REC --hearing acoustic
    """

    compiles: ClassVar[bool] = True

    scene: Annotated[str, arg(metavar="SCENE")]
    """house:SEED or office:SEED, also :held-out or :lived-in; or a .glb, alone or with Matterport3D's _semantic.ply."""
    out: Annotated[Path, arg(metavar="REC")]
    """Recording folder to write (our format)."""
    rearranged: Annotated[int | None, arg(metavar="DAYS")] = None
    """Record the building this many days later: chairs and bags moved, things taken away and brought, doors swung."""
    sounds: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of sound files, as `avlmaps add-sounds` reads it. Default: sounds made by rule."""
    category: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """Use sounds of these categories only. Default: all that homes make."""
    sources: Annotated[int | None, arg(metavar="N")] = None
    """Number of sounds. Default: one for every 12 s of the walk, or fewer if there is no room."""
    ambiguous: Annotated[int, arg(metavar="N")] = 0
    """Number of kinds of sound that play in two places."""
    hearing: Literal["overlay", "acoustic", "none"] = "overlay"
    """overlay: dry clips, as the paper mixed them; acoustic: distance, walls and reverberation follow the building."""
    microphones: Annotated[str, arg(metavar="NAME|FILE")] = "mono"
    """Microphones on the robot, of acoustic hearing: mono, stereo (0.2 m apart), square4 (0.2 m), or a JSON file with
    positions_m."""
    directions: bool = False
    """Record also what a device says of where sounds come from: azimuths in directions.csv, ten a second."""
    directions_offset_deg: Annotated[float, arg(metavar="DEGREES")] = 0.0
    """Offset of those azimuths, as of a device that is mounted turned, degrees."""
    directions_outliers: Annotated[float, arg(metavar="SHARE")] = 0.1
    """Share of those azimuths that are anything."""
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    """Camera whose faults colour and depth have."""
    drift: bool = False
    """Let the poses stray as odometry does; true_poses.csv stores the true ones."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of the path and the sounds."""
    size: Annotated[str, arg(metavar="WxH")] = "320x240"
    """Columns and rows of the pictures, pixels."""
    fov_deg: Annotated[float, arg(metavar="DEGREES")] = 63.0
    """Horizontal field of view, degrees."""
    fps: Annotated[float, arg(metavar="HZ")] = 10.0
    """Frames per second."""
    max_frames: Annotated[int | None, arg(metavar="N")] = None
    """Use this many frames of a longer walk, spread evenly."""
    floor: Annotated[int | None, arg(metavar="N")] = None
    """Walk this floor only, counted from 0, the lowest. Default: every floor that stairs join."""
    semantic: bool = False
    """Write the object of each pixel into semantic/ as well (16-bit PNG: instance + 1, 0 for none)."""
    colour: Literal["png", "jpg"] = "png"
    """File type of the colour pictures; jpg takes a tenth of the space."""
    workers: Annotated[int, arg(metavar="N")] = 0
    """Number of processes that draw. Default: one for each core."""

    def run(self) -> None:
        """Record."""
        answer = record(self)
        rows = [
            (f"{e['onset_s']:.2f}", f"{e['offset_s']:.2f}", e["category"], place_text(e["source"]), e["object"] or "-")
            for e in answer["events"]
        ]
        lines = table_lines(("onset_s", "offset_s", "category", "sounds at", "made by"), rows) if rows else []
        said = f"wrote {self.out}: {answer['frames']} frames, {answer['duration_s']:.1f} s"
        floor = answer["floor"]
        shares = ", ".join(f"{floor[f'{name}_share']:.0%} {name}" for name in ("reached", "driven", "seen"))
        lines.append(f"of {floor['walkable_m2']:.1f} m² of walkable floor: {shares}")
        emit(answer, [*lines, f"{said}, in {answer['elapsed_s']:.1f} s"], self.json)


def record(verb: "Record") -> dict[str, Any]:
    """Record a simulated walk and return what was recorded."""
    from avlmaps_sim.recorder import RecordSettings, record_scene
    from avlmaps_sim.scenes import on_day, open_changed
    from avlmaps_sim.sensor_settings import OdometryFaults

    begin = perf_counter()
    if verb.seed < 0:
        raise UsageError(f"--seed takes a number of 0 or more, not {verb.seed}.")
    settings = RecordSettings(
        size=_size(verb.size),
        fov_deg=verb.fov_deg,
        fps=verb.fps,
        sensor=verb.sensor,
        hearing=verb.hearing,
        microphones=verb.microphones,
        directions=verb.directions,
        directions_offset_deg=verb.directions_offset_deg,
        directions_outliers=verb.directions_outliers,
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
    scene, changes = open_changed(on_day(verb.scene, verb.rearranged) if verb.rearranged is not None else verb.scene)
    settings = replace(settings, walk=_walk(verb.floor, scene))
    made = record_scene(scene, verb.out, settings, verb.seed, changes)
    names = [*(thing.name for thing in scene.objects), None]  # an instance of -1 is not an object
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
        "microphones": verb.microphones,
        "sounds": len(events),
        "events": events,
        "floor": made.floor.to_json(),
        "elapsed_s": round(perf_counter() - begin, 3),
    }


def _walk(floor: int | None, scene: "Scene") -> "WalkSettings":
    from avlmaps_sim.free_space import floor_heights
    from avlmaps_sim.walk import WalkSettings

    if floor is None:
        return WalkSettings(every_floor=True)
    heights = floor_heights(scene)
    if not 0 <= floor < len(heights):
        has = ", ".join(f"{number} at {height:.2f} m" for number, height in enumerate(heights))
        raise UsageError(f"{scene.name} has no floor {floor}; its floors are: {has}.")
    return WalkSettings(floor=floor)


def _size(words: str) -> tuple[int, int]:
    width, _, height = words.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise UsageError(f"--size takes columns and rows such as 320x240, not {words!r}.")
    return int(width), int(height)
