"""What every part of the server shares: settings, maps, lanes, and how errors are written."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from starlette.responses import Response

from avlmaps.query.avlmap import QuerySettings
from avlmaps.query.modalities.sound import SoundSettings
from avlmaps.serve.errors import Privacy, RequestError
from avlmaps.serve.lanes import Lane
from avlmaps.serve.settings import ServeSettings
from avlmaps.serve.shelf import MapSource, Shelf
from avlmaps.serve.work import encoded

if TYPE_CHECKING:
    from avlmaps.view.route import MakeRobot

JSON_TYPE = "application/json"
log = logging.getLogger("avlmaps.serve")


@dataclass(frozen=True, slots=True)
class Service:
    """What every part of the server shares.

    Attributes:
        settings: where it listens, and its limits.
        shelf: the maps.
        quick: the lane of queries in words.
        slow: the lane of photos, clips, lists and pictures.
        privacy: takes paths out of sentences.
    """

    settings: ServeSettings
    shelf: Shelf
    quick: Lane
    slow: Lane
    privacy: Privacy

    @classmethod
    def open(
        cls,
        maps: Mapping[str, Path | MapSource],
        settings: ServeSettings | None = None,
        note: Callable[[str], None] = lambda _: None,
        robot: "MakeRobot | None" = None,
        warm: bool = True,
    ) -> "Service":
        """Open the maps and start the lanes.

        Raises:
            MapError: a map cannot be opened.
        """
        settings = settings or ServeSettings()
        limits = settings.limits
        querying = QuerySettings(found_at=settings.found_at, sounds=SoundSettings(at=settings.at))
        shelf = Shelf(maps, limits, note, querying, robot, warm)
        return cls(
            settings,
            shelf,
            Lane("quick", limits.quick_workers, limits.waiting, limits.answer_s),
            Lane("slow", limits.slow_workers, limits.waiting, limits.answer_s),
            Privacy((path, name) for name, path in shelf.paths.items()),
        )

    def close(self) -> None:
        """End the lanes after the work that they have."""
        self.quick.close()
        self.slow.close()


def error_response(service: Service, error: BaseException) -> Response:
    """Return an error as the JSON that the command line prints; what is a fault of ours goes to the log."""
    status, answer = service.privacy.described(error)
    if status >= 500 and not isinstance(error, RequestError):
        log.error("%s", error, exc_info=error if status == 500 else None)
    headers = error.headers if isinstance(error, RequestError) else {}
    return Response(encoded(answer), status, headers, JSON_TYPE)
