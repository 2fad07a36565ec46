"""What could be wrong with a recording that agrees with itself, and would not show: tried by making it wrong."""

from collections.abc import Iterator

import numpy as np

from avlmaps.core.arrays import Bool
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.consistency.agreement import Agreement
from avlmaps.recordings.consistency.edges import DepthEdges
from avlmaps.recordings.consistency.jumps import gaps
from avlmaps.recordings.consistency.levels import Levels
from avlmaps.recordings.consistency.limits import apart_agrees, can_be_judged, geometry_agrees
from avlmaps.recordings.consistency.right_angles import RightAngles
from avlmaps.recordings.consistency.sample import pairs_across
from avlmaps.recordings.consistency.single_frames import LEAST_WARMTH
from avlmaps.recordings.consistency.suspects import Suspect, Trial, Trials, is_closer
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.types import Recording

# Mistakes that are made to see whether they would show: twice, half, a moment.
_FACTOR, _FOCAL, _DELAY_S = 2.0, 1.25, 0.3
# Smaller ones of the depth, which shows where the camera moves among what it sees.
_SLIGHT, _FARTHER_M = 1.15, 0.3
_BESIDE, _ROLLED_DEG = 0.08, 6.0
# A step that turns the camera by more than this share of its view leaves nothing that both frames see.
_NO_OVERLAP = 0.9


def blind_spots(
    recording: Recording,
    found: Agreement,
    trials: Trials,
    edges: DepthEdges,
    levels: Levels,
    angles: RightAngles,
    warmth: float,
) -> tuple[str, ...]:
    """Return what cannot be checked in a recording of which nothing is wrong, and why, one sentence each.

    Args:
        recording: that agrees with itself.
        found: pairs of its frames that follow one another.
        trials: of its sample.
        edges: of its colour and depth.
        levels: of its floors.
        angles: of its flat surfaces.
        warmth: of its pictures.
    """
    if not can_be_judged(found):
        return (_nothing(recording, found),)
    return (*_spots(recording, trials, edges, levels), *_of_flats(angles), *_of_channels(warmth))


def _nothing(recording: Recording, found: Agreement) -> str:
    if len(recording) == 1:
        why = "there is one frame"
    elif found.outside > 0.0:
        why = f"hardly any two frames see the same place ({found.outside:.0%} of the points of one lie "
        why += "outside of the other's view)"
    else:
        why = "too few pixels have a depth on smooth surface"
    return f"Poses, depth, colour, intrinsics and clocks cannot be checked here, because {why}."


def _spots(recording: Recording, trials: Trials, edges: DepthEdges, levels: Levels) -> Iterator[str]:
    as_it_is = trials.run(Suspect(), colour=False)

    def shows(*suspects: Suspect) -> bool:
        return all(_would_show(as_it_is, trials.run(suspect, colour=False)) for suspect in suspects)

    places = recording.world_from_camera[:, :3, 3]
    across_m = float(np.linalg.norm(np.ptp(places, axis=0)))
    if not shows(Suspect(scale=_FACTOR), Suspect(scale=1.0 / _FACTOR)):
        yield (
            "The scale of positions against depth cannot be checked here, because the camera moved within "
            f"{across_m:.2g} m, and between frames that see the same place hardly: positions twice as far apart would "
            "not show."
        )
    elif not shows(Suspect(scale=_SLIGHT), Suspect(scale=1.0 / _SLIGHT), Suspect(farther_m=_FARTHER_M)):
        yield (
            "The scale of positions against depth cannot be checked closely here, because between frames that see the "
            f"same place the camera turns more than it moves: depths that are {_SLIGHT - 1.0:.0%} or {_FARTHER_M:g} m "
            "too large would not show."
        )
    late, early = (Suspect(Corrections(pose_delay_s=s)) for s in (_DELAY_S, -_DELAY_S))
    if not shows(late, early):
        yield (
            "The clock of the poses cannot be checked here, because the camera moves evenly or hardly at all: poses "
            f"that are {_DELAY_S:g} s late would not show."
        )
    if not shows(Suspect(focal=_FOCAL), Suspect(focal=1.0 / _FOCAL)):
        yield (
            "The focal length cannot be checked here, because the camera hardly turns between frames that see the same "
            f"place: one {_FOCAL:g} times as long would not show."
        )
    tilted = levels.would_show or shows(Suspect(off_centre=(0.0, _BESIDE)), Suspect(rolled_deg=_ROLLED_DEG))
    aside = shows(Suspect(off_centre=(_BESIDE, 0.0)))
    if tilted and not aside:
        yield (
            "Whether the camera looks aside in its mount cannot be checked here, because it turns about one axis or "
            f"hardly: a principal point that is off by {_BESIDE:.0%} of the picture's width would not show."
        )
    elif not tilted:
        yield (
            "How the camera sits in its mount and its principal point cannot be checked here, because the camera turns "
            f"about one axis or hardly: a principal point that is off by {_BESIDE:.0%} of the picture, or a roll of "
            f"{_ROLLED_DEG:g} degrees, would not show."
        )
    if not shows(Suspect(along_ray=True)):
        yield (
            "Whether depth is measured along the camera's axis cannot be checked here, because the camera hardly turns "
            "or sees a narrow angle: distances along the ray would not show."
        )
    if not edges.would_show:
        yield (
            "Whether colour lies on depth cannot be checked here, because too few edges are seen in both: colour that "
            "lies a sixteenth of the picture beside would not show."
        )
    yield from _of_gaps(recording)
    yield from _of_parts(recording)


def _of_flats(angles: RightAngles) -> Iterator[str]:
    if not angles.lens_would_show:
        yield (
            "Whether the distortion of the lens was taken out cannot be checked here, because too few flat surfaces "
            "are seen: a wide lens that bends walls would not show."
        )
    if not angles.squeeze_would_show:
        yield (
            "The ratio of fx to fy cannot be checked here, because too few flat surfaces that meet at right angles are "
            "seen, or all of them by a level camera: pictures that were squeezed along one axis would not show."
        )


def _of_channels(warmth: float) -> Iterator[str]:
    if warmth < LEAST_WARMTH:
        yield (
            "The order of the colour channels cannot be checked here, because red outweighs blue as little as blue "
            "does red: red and blue that are exchanged in all pictures would not show."
        )


def _would_show(as_it_is: Trial, wrong: Trial) -> bool:
    """Return whether a recording that is wrong in one way would not pass for right."""
    if not can_be_judged(wrong.agreement):
        return wrong.agreement.pairs > 0
    if not geometry_agrees(wrong.agreement) or not apart_agrees(wrong.apart):
        return True
    return is_closer(as_it_is, wrong)


def _of_gaps(recording: Recording) -> Iterator[str]:
    """Yield a sentence where frames that follow one another see nothing in common, so that the poses may jump there."""
    blind = _steps_without_overlap(recording)
    if not blind.any():
        return
    at = int(np.argmax(blind))
    yield (
        f"Jumps of the poses cannot be checked at {int(blind.sum())} of {len(blind)} steps, because the camera turns "
        f"there by more than it sees, as between {recording.name(at)} and {recording.name(at + 1)}."
    )


def _of_parts(recording: Recording) -> Iterator[str]:
    """Yield a sentence for gaps after which nothing is seen again, so that the poses may have two origins."""
    for at in gaps(recording):
        if not len(pairs_across(recording.world_from_camera, at)):
            apart_s = float(recording.stamps_s[at + 1] - recording.stamps_s[at])
            yield (
                f"Whether the poses have one origin before and after the gap of {apart_s:.3g} s between "
                f"{recording.name(at)} and {recording.name(at + 1)} cannot be checked here, because no place is seen "
                "in both."
            )


def _steps_without_overlap(recording: Recording) -> Bool[np.ndarray, " m"]:
    pose, camera = recording.world_from_camera, recording.rig.depth
    view_rad = 2.0 * np.arctan(0.5 * camera.width / camera.fx)
    if len(pose) < 2:
        return np.zeros(0, bool)
    return rotation_angle_rad(pose[:-1], pose[1:]) > _NO_OVERLAP * view_rad
