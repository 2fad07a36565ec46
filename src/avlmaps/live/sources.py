"""Sources of frames and sound other than recordings, by what another package brings (``avlmaps.live_sources``)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import how_to_get
from avlmaps.core.registry import brought, entry_points

if TYPE_CHECKING:
    from avlmaps.live.live_map import LiveMap

ENTRY_POINT_GROUP = "avlmaps.live_sources"


class LiveSource(Protocol):
    """What gives a live map frames and sound; z is up in its world, and its stamps are dates."""

    def play(self, live: "LiveMap", give_up_s: float, over: Callable[[], bool]) -> None:
        """Give a live map frames until it is over, or none came for some seconds.

        Raises:
            RecordingError: no frame came at all.
        """
        ...


def join_source(kind: str, topics: Mapping[str, str]) -> LiveSource:
    """Join a source.

    Args:
        kind: ``ros2``.
        topics: names by what they are for; the others are found.

    Raises:
        RecordingError: a topic is for nothing that is known.
        BackendError: the package that brings it, or what that needs, is not installed.
    """
    for entry in entry_points(ENTRY_POINT_GROUP):
        if entry.name == kind:
            return brought(entry, "the source")(topics)
    raise BackendError(f"The source {kind} needs a package of its own; get it with: {how_to_get('sources', kind)}")
