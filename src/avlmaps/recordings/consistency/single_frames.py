"""What one frame after the other shows by itself: intrinsics, depth, colour and pace that no usual recording has."""

from collections.abc import Iterator

import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.core.wording import option
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.consistency.agreement import Agreement
from avlmaps.recordings.consistency.sample import Sample, Surfaces, steps_between_all
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.types import Recording

# A camera in a building sees this far, in the middle.
SUSPICIOUS_DEPTH_M = (0.3, 9.0)
IMPOSSIBLE_DEPTH_M = (0.04, 60.0)
LEAST_DEPTH_SHARE = 0.05
MOST_EMPTY_FRAMES = 0.25
# Share of pixels whose neighbours lie on one surface with them: less, or hardly any, is noise.
LEAST_SMOOTH, IMPOSSIBLE_SMOOTH = 0.3, 0.1
# In a coarser picture the pixels around one look at other surfaces, which differ as noise does.
FEWEST_COLUMNS = 64
LEAST_COLOURED = 0.6
IMPOSSIBLE_COLOURED = 0.05
# Of a camera that sees nothing; dark to the eye, of 255; and nothing at all.
BLACK, DARK, FLAT = 8.0, 20.0, 1.5
# Of right frames: the means of 3 that follow one another in NYU Depth V2 are over -0.05 (265 of 265) and over 0.12
# (255); those of the kitchen over 0.13, of 6 drawn rooms over 0.4, of 12 rendered homes over 0.08.
LEAST_WARMTH, _FEWEST_FOR_WARMTH = 0.12, 3
# More frames than this that are black are no camera that begins.
MOST_BLACK = 0.1
# Share of the depths that are exactly the largest one, in the middle of the frames: those of a wall differ.
MOST_CUT_OFF = 0.05
FARTHEST_FUSED_M = 10.0
# Depth that begins again at 0 beyond its largest number: of two neighbours one is nearly that far, and one nearer than
# any camera measures, at 5 places of a frame, in a quarter of the frames.
_NEARLY_MOST, _MEASURED_BY_NONE_M, _FEWEST_WRAPPED, _WRAPPED_FRAMES = 0.92, 0.1, 5, 0.25
# Share of pairs with one depth picture although the camera moved.
MOST_FROZEN = 0.08
# Faster than anybody walks, frame after frame.
MOST_SPEED_M_S = 4.0
# Beyond that pace by as much, one step alone is a jump.
LEAST_JUMP_M = 0.5
_NEAR_IN_TIME_S = 1.0
# With poses of fewer frames, or on several clocks, much of the drive is not in the map.
LEAST_POSED = 0.75
# Share of the drive that its sound lasts, and rates of sound that are written for one another.
LEAST_HEARD = 0.5
_RATES_HZ = (8_000, 11_025, 16_000, 22_050, 24_000, 32_000, 44_100, 48_000, 96_000)
# How far a ratio of lengths may be off one of rates; lengths within a fifth say nothing of it.
_AS_LONG, _LIKE_ONE = 0.02, 0.8
_SHORTEST_DRIVE_S = 1.0
# Frames that skip at least 5 s, and the sound that does not: how nearly it ends earlier by as much.
_SKIP_S, _ALIKE_S, _MOST_TURN_RAD = 5.0, 1.0, np.radians(30.0)
_CENTRE_MARGIN = 0.2
_FOCAL_RANGE = (0.25, 4.0)
_MOST_ASPECT = 1.15
_AS_IF_EXCHANGED = 0.04


def of_intrinsics(recording: Recording, of_program: bool) -> Iterator[Finding]:
    """Find cameras that cannot be those of the pictures; of a program's frames the program has to give others."""
    rig = recording.rig
    for what, camera in (("colour", rig.rgb), ("depth", rig.depth)):
        if what == "depth" and rig.registered:
            continue
        where = f"of the {what} camera" if not rig.registered else "of the cameras"
        yield from _of_camera(camera, where, of_program)


def _of_camera(camera: Pinhole, where: str, of_program: bool) -> Iterator[Finding]:
    size = f"{camera.width}x{camera.height}"
    off = (abs(camera.cx / camera.width - 0.5), abs(camera.cy / camera.height - 0.5))
    given = option("intrinsics", "fx,fy,cx,cy")
    fit = f"give those of a {size} picture with {given}, or of another size as fx,fy,cx,cy@WxH."
    fit = f"give the camera of a {size} picture." if of_program else fit
    if max(off) > 0.5 - _CENTRE_MARGIN:
        grade = Grade.IMPOSSIBLE if max(off) > 0.5 else Grade.SUSPICIOUS
        middle = "outside" if max(off) > 0.5 else "near the edge of"
        sentence = f"The principal point {where} ({camera.cx:.6g}, {camera.cy:.6g}) lies {middle} the {size} picture."
        looks = ""
        if max(off) > 0.5 and min(camera.cx, camera.cy) > 0.0:
            looks = f"They look like those of a {2 * camera.cx:.0f}x{2 * camera.cy:.0f} picture: "
        yield Finding(Reason.INTRINSICS, grade, sentence, f"{looks}{fit if looks else fit[:1].upper() + fit[1:]}")
    w, h = camera.width, camera.height
    if abs(w - h) > 0.1 * w and max(abs(camera.cx - h / 2), abs(camera.cy - w / 2)) < _AS_IF_EXCHANGED * w:
        sentence = f"The principal point {where} ({camera.cx:.6g}, {camera.cy:.6g}) is the middle of a {h}x{w} picture."
        remedy = f"cx and cy look exchanged, or the picture was turned; {fit}"
        yield Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, remedy)
    wide = camera.fx / camera.width
    if not _FOCAL_RANGE[0] <= wide <= _FOCAL_RANGE[1]:
        sentence = (
            f"The focal length {where} ({camera.fx:.4g} pixels) gives the {size} picture a view of "
            f"{2 * np.degrees(np.arctan(0.5 / wide)):.0f} degrees, which no usual depth camera has."
        )
        yield Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, f"Check the intrinsics: {fit}")
    aspect = max(camera.fx / camera.fy, camera.fy / camera.fx)
    if aspect > _MOST_ASPECT:
        sentence = f"The focal lengths {where} differ by {aspect:.2f} times (fx {camera.fx:.4g}, fy {camera.fy:.4g})."
        yield Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, f"Pixels are square in usual cameras; {fit}")


def of_depth(sample: Sample, surfaces: Surfaces, median_m: float, of_program: bool) -> Iterator[Finding]:
    """Find depth that is missing, of another unit, flat, or frozen; a program's frames have no unit but metres."""
    unit = "it is in metres" if of_program else option("depth-unit")
    there = sample.depth_m > 0.0
    share = there.mean(axis=(1, 2))
    empty = float((share == 0.0).mean())
    if empty == 1.0:
        yield Finding(
            Reason.DEPTH, Grade.SUSPICIOUS, f"None of the {len(sample)} frames that were looked at has any depth.",
            f"A map needs depth; check the depth pictures and their unit ({unit}).",
        )  # fmt: skip
        return
    if empty > MOST_EMPTY_FRAMES:
        sentence = f"{empty:.0%} of the {len(sample)} frames that were looked at have no depth at all."
        yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, "Check the depth pictures; the map lacks these frames.")
    elif float(np.median(share)) < LEAST_DEPTH_SHARE:
        sentence = f"Only {np.median(share):.1%} of the pixels of a frame have a depth (the middle of {len(sample)})."
        yield Finding(
            Reason.DEPTH,
            Grade.SUSPICIOUS,
            sentence,
            f"Check the depth pictures and their unit ({unit}).",
        )
    low, high = SUSPICIOUS_DEPTH_M
    if not low <= median_m <= high:
        sure = not IMPOSSIBLE_DEPTH_M[0] <= median_m <= IMPOSSIBLE_DEPTH_M[1]
        grade = Grade.IMPOSSIBLE if sure else Grade.SUSPICIOUS
        sentence = f"The depth is {median_m:.3g} m in the middle, where rooms have {low:g} to {high:g} m."
        says = f"{option('depth-unit', 'METRES')} says what one stored unit is (0.001: millimetres)"
        remedy = f"Check its unit: {'depth_m is in metres' if of_program else says}."
        yield Finding(Reason.DEPTH, grade, sentence, remedy)
    smooth = surfaces.smooth_share
    if smooth < LEAST_SMOOTH and sample.depth_m.shape[2] >= FEWEST_COLUMNS:
        grade = Grade.IMPOSSIBLE if smooth < IMPOSSIBLE_SMOOTH else Grade.SUSPICIOUS
        sentence = f"The depth pictures look like noise: {smooth:.0%} of the pixels lie on a surface with those around."
        remedy = "Check how the depth pictures are stored (16 bits, order of bytes, no colours, no lossy compression)."
        yield Finding(Reason.DEPTH, grade, sentence, remedy)
    yield from _flat_depth(sample, there)


def _flat_depth(sample: Sample, there: np.ndarray) -> Iterator[Finding]:
    if len(sample) < 3:
        return
    spread = [float(np.ptp(d[t])) / float(d[t].mean()) for d, t in zip(sample.depth_m, there, strict=True) if t.any()]
    if len(spread) >= 3 and float(np.median(spread)) < 0.01:
        sentence = "The depth pictures are flat: every pixel has the same depth."
        yield Finding(Reason.DEPTH, Grade.IMPOSSIBLE, sentence, "Check how they were written.")
    else:
        yield from _cut_off(sample, there)
        yield from _wrapped(sample, there)
    yield from _frozen(sample, np.where(there, sample.depth_m, np.nan), Reason.DEPTH)


def _cut_off(sample: Sample, there: np.ndarray) -> Iterator[Finding]:
    most_m = float(sample.depth_m.max())
    shares = [float((d[t] == most_m).mean()) for d, t in zip(sample.depth_m, there, strict=True) if t.any()]
    share = float(np.median(shares))
    if share > MOST_CUT_OFF and most_m < FARTHEST_FUSED_M:
        sentence = f"{share:.0%} of the depths of a frame are exactly the largest one, {most_m:.4g} m."
        remedy = "They look cut off there, or none was measured: write 0 for these, or the map has a wall there."
        yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, remedy)


def _wrapped(sample: Sample, there: np.ndarray) -> Iterator[Finding]:
    most_m = float(sample.depth_m.max())
    far, near = sample.depth_m > _NEARLY_MOST * most_m, there & (sample.depth_m < _MEASURED_BY_NONE_M)
    beside = np.zeros(len(sample), np.int64)
    for one, other in ((far, near), (near, far)):
        beside += (one[:, :, 1:] & other[:, :, :-1]).sum(axis=(1, 2)) + (one[:, 1:] & other[:, :-1]).sum(axis=(1, 2))
    share = float((beside >= _FEWEST_WRAPPED).mean())
    if share > _WRAPPED_FRAMES:
        sentence = (
            f"In {share:.0%} of the {len(sample)} frames that were looked at, depths of {most_m:.3g} m, the largest, "
            f"lie beside some below {_MEASURED_BY_NONE_M:g} m, which no camera measures."
        )
        remedy = "They look cut to too few bits, so that they begin again at 0: write them whole, or 0 where too far."
        yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, remedy)


def _frozen(sample: Sample, pictures: np.ndarray, reason: Reason) -> Iterator[Finding]:
    moved = np.array([steps_between_all(sample.world_from_camera[pair])[0] for pair in sample.pairs])
    if (moved > 0.3).sum() < 3:
        return
    shown = np.array([np.nanmax(one, initial=-np.inf) > np.nanmin(one, initial=np.inf) for one in pictures])
    same = np.array(
        [shown[a] and np.array_equal(pictures[a], pictures[b], equal_nan=True) for a, b in sample.pairs[moved > 0.3]]
    )
    share = float(same.mean())
    if share > MOST_FROZEN:
        sentence = f"In {share:.0%} of the pairs of frames the {reason} picture is the same although the camera moved."
        remedy = "The camera or its driver may have hung; record again, or leave these frames out."
        yield Finding(reason, Grade.SUSPICIOUS, sentence, remedy)


def of_colour(sample: Sample, surfaces: Surfaces) -> Iterator[Finding]:
    """Find colour pictures that show nothing, and depth that no colour belongs to."""
    spread = sample.grey.std(axis=(1, 2))
    level = float(np.median(sample.grey))
    flat = float((spread < FLAT).mean())
    black = (spread < FLAT) & (sample.grey.mean(axis=(1, 2)) < BLACK)
    if MOST_BLACK < float(black.mean()) <= 0.5:
        which = np.flatnonzero(black)
        sentence = (
            f"{black.mean():.0%} of the {len(sample)} colour pictures that were looked at are black, from "
            f"{sample.stamps_s[which[0]]:.2f} to {sample.stamps_s[which[-1]]:.2f} s."
        )
        remedy = "Nothing is recognised in them; check the camera, or leave these frames out."
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, remedy)
    if flat > 0.5:
        shade = "black" if level < BLACK else "of one colour"
        sentence = f"{flat:.0%} of the {len(sample)} colour pictures that were looked at are {shade}."
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, "Nothing can be recognised in them; check the camera.")
    elif level < DARK:
        sentence = f"The colour pictures are dark: the middle brightness is {level:.0f} of 255."
        remedy = "Little is recognised in the dark; record with more light or a longer exposure."
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, remedy)
    else:
        yield from _frozen(sample, sample.grey, Reason.COLOUR)
        yield from _as_if_bgr(sample)
    rig = sample.rig
    if rig.registered or not surfaces.there.any():
        return
    frame, at = np.nonzero(surfaces.there)
    row, column = surfaces.row[frame, at], surfaces.column[frame, at]
    z = sample.depth_m[frame, row, column].astype(np.float64)
    points = np.stack(
        [(column + 0.5 - rig.depth.cx) / rig.depth.fx * z, (row + 0.5 - rig.depth.cy) / rig.depth.fy * z, z], 1
    )
    seen = points @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
    ahead = seen[:, 2] > 0.01
    at_px = rig.rgb.project(np.where(ahead[:, None], seen, 1.0))
    inside = ahead & ((at_px >= 0.0) & (at_px < (rig.rgb.width, rig.rgb.height))).all(axis=1)
    share = float(inside.mean())
    if share < LEAST_COLOURED:
        grade = Grade.IMPOSSIBLE if share < IMPOSSIBLE_COLOURED else Grade.SUSPICIOUS
        sentence = f"The colour camera sees {share:.0%} of what the depth camera sees; the rest has no colour."
        remedy = "Check the intrinsics of both cameras and the transform between them (rgb_from_depth)."
        yield Finding(Reason.INTRINSICS, grade, sentence, remedy)


def warmth_of(sample: Sample) -> float:
    """Return how much more of the pictures is redder than blue than the other way round; 0 for too few frames."""
    return float(sample.warmth.mean()) if len(sample) >= _FEWEST_FOR_WARMTH else 0.0


def _as_if_bgr(sample: Sample) -> Iterator[Finding]:
    warmth = warmth_of(sample)
    if warmth < -LEAST_WARMTH:
        sentence = (
            f"Blue outweighs red: of the pixels {-warmth:.0%} more are bluer than red than redder than blue, in the "
            f"mean of {len(sample)} frames, where rooms have more that are redder."
        )
        remedy = (
            "Red and blue look exchanged in all colour pictures: write them as RGB, not BGR; or the light, the walls "
            "or the camera's white balance are blue."
        )
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, remedy)


def of_poses(recording: Recording) -> Iterator[Finding]:
    """Find a drive much of which has no pose, or another clock."""
    if recording.posed < LEAST_POSED:
        sentence = f"Only {recording.posed:.0%} of the frames have a pose on one clock; the others are left out."
        remedy = "What they show is not in the map: check that pictures and poses are of one drive and one clock."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)


def of_sound(recording: Recording) -> Iterator[Finding]:
    """Find a track that lasts as long as the drive only at another rate, and one that misses most of the drive."""
    track, drive_s = recording.audio, recording.duration_s
    if track is None or drive_s < _SHORTEST_DRIVE_S:
        return
    begin_s, end_s = track.start_s, track.start_s + track.duration_s
    first_s, last_s = float(recording.stamps_s[0]), float(recording.stamps_s[-1])
    spans = f"The sound lasts from {begin_s:.1f} to {end_s:.1f} s and the drive from {first_s:.1f} to {last_s:.1f} s"
    longer = track.duration_s / drive_s
    if skipped := _skipped(recording, last_s - end_s):
        at, apart_s = skipped
        sentence = (
            f"{spans}: the sound ends {last_s - end_s:.1f} s before the frames do, and {apart_s:.1f} s lie between "
            f"{recording.name(at)} and {recording.name(at + 1)}, where the camera stood."
        )
        remedy = "The clock of the frames looks set there; take that time out of the later stamps, or cut there."
        yield Finding(Reason.SOUND, Grade.SUSPICIOUS, sentence, remedy)
        return
    meant = [hz for hz in _RATES_HZ if hz != track.rate_hz and abs(longer * track.rate_hz / hz - 1.0) < _AS_LONG]
    if meant and abs(begin_s - first_s) < _AS_LONG * drive_s and not _LIKE_ONE < longer < 1.0 / _LIKE_ONE:
        sentence = (
            f"{spans}: {longer:.3g} times as long, as if {meant[0]} samples a second were called {track.rate_hz}."
        )
        remedy = f"If so, write {track.path.name} again with its true rate; else its sounds lie at wrong places."
        yield Finding(Reason.SOUND, Grade.SUSPICIOUS, sentence, remedy)
    elif (heard := max(0.0, min(end_s, last_s) - max(begin_s, first_s)) / drive_s) < LEAST_HEARD:
        sentence = f"{spans}: {heard:.0%} of the drive has sound."
        remedy = "Check that both are of one drive and one clock."
        yield Finding(Reason.SOUND, Grade.SUSPICIOUS, sentence, remedy)


def _skipped(recording: Recording, missing_s: float) -> tuple[int, float] | None:
    apart_s, pose = np.diff(recording.stamps_s), recording.world_from_camera
    at = int(np.argmax(apart_s))
    gap_s = float(apart_s[at] - np.median(apart_s))
    others_s = np.delete(apart_s, at).max(initial=0.0)
    moved_m = float(np.linalg.norm(pose[at + 1, :3, 3] - pose[at, :3, 3]))
    turned_rad = float(rotation_angle_rad(pose[at : at + 1], pose[at + 1 : at + 2])[0])
    stood = moved_m < LEAST_JUMP_M and turned_rad < _MOST_TURN_RAD
    if gap_s < _SKIP_S or others_s > gap_s / 2 or abs(missing_s - gap_s) > _ALIKE_S or not stood:
        return None
    return at, float(apart_s[at])


def of_loudness(recording: Recording) -> Iterator[Finding]:
    """Find a track that is silent or clipped; of an array, its channels are looked at elsewhere."""
    if recording.audio is None or recording.audio.microphones is not None:
        return
    try:
        silent, clipped = level_faults(recording.audio)
    except AudioError:  # hearing says why
        return
    for sentence in silent:
        remedy = "Check the microphone, and which input was recorded: nothing that sounded then is in the map."
        yield Finding(Reason.SOUND, Grade.SUSPICIOUS, sentence, remedy)
    for sentence in clipped:
        remedy = "What is loud may be taken for another sound."
        yield Finding(Reason.SOUND, Grade.SUSPICIOUS, sentence, remedy)


def of_motion(recording: Recording, found: Agreement, judged: bool) -> Iterator[Finding]:
    """Find a pace that nobody walks at, and frames that never see the same place."""
    if len(recording) < 5:
        return
    apart_s = np.diff(recording.stamps_s)
    moved_m = np.linalg.norm(np.diff(recording.world_from_camera[:, :3, 3], axis=0), axis=1)
    pace_s, speed = float(np.median(apart_s)), float(np.quantile(moved_m / apart_s, 0.75))
    if speed > MOST_SPEED_M_S:
        sentence = f"The camera moves at {speed:.3g} m/s in a quarter of the steps or faster, more than anybody walks."
        remedy = "Check that positions are in metres and stamps in seconds."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)
        return
    far = np.flatnonzero(moved_m > LEAST_JUMP_M + MOST_SPEED_M_S * apart_s)
    if len(far):
        at = int(far[np.argmax(moved_m[far])])
        sentence = (
            f"The poses jump by {moved_m[at]:.3g} m within {apart_s[at]:.2g} s between {recording.name(at)} and "
            f"{recording.name(at + 1)}, faster than anybody walks"
            f"{f', and at {len(far) - 1} other places' if len(far) > 1 else ''}."
        )
        remedy = "If tracking began again there, the map shows the place twice: cut the recording, or fix the poses."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)
    elif len(recording) >= 20 and pace_s < _NEAR_IN_TIME_S and not judged and found.outside > 0.0:
        sentence = (
            f"Hardly any two frames see the same place ({found.outside:.0%} of the points of one lie outside of the "
            f"other's view), although they are {pace_s:.2g} s apart."
        )
        remedy = "Check the poses, the intrinsics and the depth unit."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)
