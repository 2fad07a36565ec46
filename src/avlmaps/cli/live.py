"""`avlmaps live`: a map that grows while a recording is played, as it would on a robot."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal
from urllib.parse import quote

from msgspec import Meta
from tyro.conf import Positional, arg

from avlmaps.cli.info import describe_map, info_lines
from avlmaps.cli.output import UsageError, emit
from avlmaps.cli.verb import PORT, SIZE, Building, Reading, idle
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from avlmaps.live.live_map import LiveMap
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.microphones import Microphones
    from avlmaps.serve.shelf import MapSource


@dataclass(frozen=True, kw_only=True)
class Live(Building):
    """Map a recording while it is played, or a robot while it drives; the map is saved all along.

    Example:
    avlmaps live REC --out home.avlmap --rate 1
    """

    recording: Annotated[Positional[Path | None], arg(metavar="REC")] = None
    """Recording, of any format that build reads (a bag, a folder); or one of ours that is being written: it is followed
    until it is finished. None with --source ros2."""
    source: Annotated[Literal["recording", "ros2"], arg(metavar="recording|ros2")] = "recording"
    """Source of frames and sound: REC, or what a running robot publishes in ROS 2 (by rclpy, in the Python that ROS 2
    was built for), until Ctrl-C."""
    rate: Annotated[float, Meta(gt=0.0, le=1e6), arg(metavar="FACTOR")] = 1.0
    """Speed of the replay: 1 as it was recorded, 2 twice as fast."""
    give_up_s: Annotated[float, SIZE, arg(metavar="SECONDS")] = 60.0
    """Of a recording that is being written, and of ROS 2: end when nothing came for this long, seconds."""
    as_fast_as_possible: bool = False
    """Wait for the map instead of the clock; no frame is late."""
    every_frame: bool = False
    """Fuse and encode every frame that is not late, also where nothing moved and nothing new is in view; the end is
    that of a build, bit by bit where frames are 5 cm or 3.5 degrees apart: a build encodes no nearer ones."""
    serve: bool = False
    """Answer HTTP on this machine while the map grows, and afterwards until Ctrl-C, as `avlmaps serve` does; agents are
    served by `avlmaps serve MAP` beside it, which takes each save."""
    view: bool = False
    """The same, and open the map's page in a browser."""
    port: Annotated[int, PORT, arg(metavar="NUMBER")] = 8750
    """Port of --serve and --view; 0 takes a free one."""
    into: Annotated[Path | None, arg(metavar="MAP")] = None
    """Map folder that this drive updates when it is over: it finds itself there by its pictures, as `avlmaps merge`
    does. Where it is not seen to be the same place, that map stays as it is, and --out has the drive."""
    day: Annotated[str | None, arg(metavar="DAY")] = None
    """Day of the drive for --into, such as 2026-11-24. Default: by its stamps, if those are of a clock."""

    def run(self) -> None:
        answer = _live(self)
        lines = [*info_lines(answer, verbose=False), f"live: {answer['live']['summary']}"]
        if "into" in answer:
            from avlmaps.cli.edit import merge_lines

            lines += merge_lines(answer["into"])
        emit(answer, lines, self.json)


def _live(verb: Live) -> dict[str, Any]:
    from avlmaps.live.live_map import SPARSE, LiveMap
    from avlmaps.live.replay import end_drive
    from avlmaps.live.status import LiveSettings
    from avlmaps.maps.settings import BuildSettings

    begin_s = perf_counter()
    if verb.as_fast_as_possible and verb.rate != 1.0:
        raise UsageError("--rate and --as-fast-as-possible do not go together; choose one of them.")
    for note in [] if verb.serve or verb.view else idle(verb, ["port"], "neither --serve nor --view is given"):
        say(f"note: {note}")
    first = _days_before(verb)
    used = verb.encoders()
    source = _robot(verb) if verb.source == "ros2" else _recording(verb)
    settings = replace(BuildSettings() if verb.every_frame else SPARSE, voxel_size_m=verb.voxel_size_m)
    with LiveMap(
        verb.out, used, up_in_world=source.up_in_world, settings=settings, overwrite=verb.overwrite,
        live=LiveSettings(gates=not verb.every_frame), begins_s=source.begins_s, microphones=source.microphones,
        same_device=verb.same_device,
    ) as live:  # fmt: skip
        if verb.serve or verb.view:
            serve_while(live, lambda over: source.play(live, over), verb.port, browse=verb.view)
        else:
            try:
                source.play(live, lambda: False)
            except KeyboardInterrupt:
                say("note: Stopped by Ctrl-C; the map is finished.")
            end_drive(live)
    status, made = live.status(), live.map
    told = {**describe_map(made), "path": str(verb.out), "live": {**status.to_dict(), "summary": str(status)}}
    if first is not None:
        told["into"] = _joined(first, made, verb.day or "")
    return {**told, "elapsed_s": round(perf_counter() - begin_s, 3)}


@dataclass(frozen=True)
class _Source:
    """Where frames and sound come from; ``begins_s`` is what its clock said at time 0, 0 where stamps are dates."""

    up_in_world: Any
    begins_s: float
    microphones: "Microphones | Path | None"
    play: Callable[["LiveMap", Callable[[], bool]], None]


def _recording(verb: Live) -> _Source:
    from avlmaps.live.growing_folder import is_being_written
    from avlmaps.live.replay import follow, replay
    from avlmaps.maps.hearing import take_device
    from avlmaps.recordings.layout import UNFINISHED, decode_description
    from avlmaps.recordings.open import open_recording

    path, microphones = verb.recording, verb.microphones
    if path is None:
        raise UsageError("live needs a recording, REC, or --source ros2.")
    if is_being_written(path):
        if verb.reading != Reading():
            raise UsageError(
                "--depth-unit, --intrinsics and the like are of a finished recording, and this one is being written; "
                "leave them out, or play it when it is finished."
            )
        for note in idle(
            verb, ["rate", "as_fast_as_possible", "format", "topics", "audio"], "the recording is being written"
        ):
            say(f"note: {note}")

        def following(live: "LiveMap", over: Callable[[], bool]) -> None:
            follow(path, live, verb.give_up_s, over=over, microphones=microphones)

        return _Source(decode_description(path / UNFINISHED).up_in_world, 0.0, microphones, following)
    for note in idle(verb, ["give_up_s"], "the recording is finished"):
        say(f"note: {note}")
    recording = open_recording(path, **verb.opening())
    if verb.same_device is not None:
        take_device(recording, verb.same_device)
    for notice in recording.notices:
        say(f"note: {notice}")
    rate = None if verb.as_fast_as_possible else verb.rate
    heard_by = None if recording.audio is None else recording.audio.microphones

    def playing(live: "LiveMap", over: Callable[[], bool]) -> None:
        replay(recording, live, rate, over=over)

    return _Source(recording.up_in_world, recording.begins_s, heard_by, playing)


def _robot(verb: Live) -> _Source:
    from avlmaps.live.replay import join_source

    given = verb.recording, verb.as_fast_as_possible, verb.audio, verb.rate != 1.0, verb.format != "auto"
    if any(given) or verb.reading != Reading():
        raise UsageError(
            "--source ros2 takes what a robot publishes now: leave out REC, --rate, --format, --audio, --depth-unit, "
            "--intrinsics and the like."
        )
    topics = verb.named_topics()
    if verb.same_device is not None and "directions" not in topics:
        raise UsageError(
            "--same-device is of a device that says directions; name its topic (--topics directions=TOPIC)."
        )
    source = join_source(verb.source, topics)  # before the map's folder is made
    # Z is up in ROS's world (REP 103), and its stamps are dates.
    return _Source((0.0, 0.0, 1.0), 0.0, verb.microphones, lambda live, over: source.play(live, verb.give_up_s, over))


def _days_before(verb: Live) -> "AVLMap | None":
    from avlmaps.query.avlmap import AVLMap

    if verb.into is None:
        if verb.day is not None:
            raise UsageError("--day is of a drive that goes --into a map; name the map as well.")
        return None
    if verb.into.resolve() == verb.out.resolve():
        raise UsageError("--into is the map of the days before, and --out that of this drive; name two folders.")
    return AVLMap.open(verb.into)


def _joined(first: "AVLMap", today: "AVLMap", day: str) -> dict[str, Any]:
    from avlmaps.cli.edit import merged_answer
    from avlmaps.days.merge import merge_maps

    return merged_answer(merge_maps(first, today, first.path, day=day, overwrite=True))


_NAME = "live"
_LOOK_S = 0.1


def live_source(live: "LiveMap") -> "MapSource":
    """Return a live map as the server takes it: its last snapshot; none before the first."""
    from avlmaps.serve.shelf import MapSource

    return MapSource(live.path, lambda: live.generation or None, lambda: live.map, tells=False)


def serve_while(live: "LiveMap", drive: Callable[[Callable[[], bool]], None], port: int, *, browse: bool) -> None:
    """Serve a live map on this machine until Ctrl-C, while a drive gives it frames in a thread, and close it."""
    from avlmaps.cli.view import open_browser, run_page
    from avlmaps.live.replay import end_drive
    from avlmaps.serve.service import Service, listening_socket, url_of
    from avlmaps.serve.settings import ServeSettings

    over = threading.Event()

    def driven() -> None:
        try:
            drive(over.is_set)
            end_drive(live)
            say("The drive is over; its map is answered on until Ctrl-C.")
        except BaseException as fault:
            if live.generation:  # else the command ends with it at once
                say(f"note: The drive ended, and no frame comes any more; stop with Ctrl-C. {fault}")
            raise

    settings = ServeSettings(host="127.0.0.1", port=port)
    with listening_socket(settings) as opened, ThreadPoolExecutor(1, "avlmaps-drive") as threads:
        running = threads.submit(driven)
        try:
            while not live.generation and not running.done():
                time.sleep(_LOOK_S)
            if live.generation:  # else it ended without a map, or by a fault
                service = Service.open({_NAME: live_source(live)}, settings, say)
                url = f"{url_of(settings, opened)}/maps/{quote(_NAME)}/view"

                def told() -> None:
                    say(f"The map is at {url}; the page grows with it. Stop with Ctrl-C.")
                    if browse:
                        open_browser(url)

                run_page(service, opened, told)
        finally:  # after the frame that it has; what went wrong is raised
            over.set()
            running.result()
