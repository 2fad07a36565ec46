"""Which topics of ROS belong together, by their names: the pictures of one camera, and its calibration."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import takewhile

# A colour and a depth picture at most this far apart are taken for one moment.
PAIRING_TOLERANCE_S = 0.05


@dataclass(frozen=True, slots=True)
class RosTopics:
    """Topics by name; empty ones are found by type.

    Attributes:
        rgb: colour images (raw or compressed).
        depth: depth images (raw or compressedDepth), or point clouds.
        pose: odometry, poses of the camera or the body, transforms, or a file of poses; empty: /tf first.
        audio: audio data; ``none`` leaves the sound out.
        audio_pcm: no topic: ``16000,1`` says that audio data are plain 16-bit samples, 16,000 a second, in one channel.
        directions: azimuths of sounds, numbers or stamped poses; they are not found by type.
    """

    rgb: str = ""
    depth: str = ""
    pose: str = ""
    audio: str = ""
    audio_pcm: str = ""
    directions: str = ""


def pair_images(colours: list[str], depths: list[str]) -> tuple[str, str]:
    """Return the colour and the depth topic that belong together: of one namespace, depth registered to colour.

    Raw topics go before compressed ones (the order of the lists).
    """
    pairs = [(colour, depth) for depth in depths for colour in colours]
    if not pairs:
        return next(iter(colours), ""), next(iter(depths), "")

    def likeliness(pair: tuple[str, str]) -> tuple[int, bool, bool]:
        registered = any(word in pair[1].lower() for word in ("align", "registered"))
        coloured = any(word in pair[0].lower() for word in ("color", "rgb", "colour"))
        return shared_namespace(*pair), registered, coloured

    return max(pairs, key=likeliness)


def shared_namespace(one: str, other: str) -> int:
    """Return how many names two topics begin with alike."""
    names = zip(one.strip("/").split("/"), other.strip("/").split("/"), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], names))


def info_beside(image_topic: str, infos: Collection[str]) -> str:
    """Return the topic of the calibration that is published beside an image topic, or nothing.

    Args:
        image_topic: of the pictures.
        infos: topics of calibrations.
    """
    parts = image_topic.split("/")
    for length in range(len(parts) - 1, 0, -1):
        for name in ("camera_info", "info/camera_info"):  # the latter as RealSense's viewer has it
            if (beside := "/".join([*parts[:length], name])) in infos:
                return beside
    return ""
