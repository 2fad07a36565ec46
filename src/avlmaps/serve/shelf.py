"""The maps of a server: opened once, queried by many, opened again when they are replaced.

A map in a folder is replaced when its ``map.json`` is, a live one when it has another snapshot. The new one is opened
and prepared beside the old one, which answers until then; a query sees one of them from its beginning to its end.
Where the new one cannot be opened, the old one stays.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar, cast

from avlmaps.core.errors import AvlmapsError, BackendError, QueryError
from avlmaps.core.files import user_path
from avlmaps.core.question import Modality, Part
from avlmaps.language.questions import parse_sentence
from avlmaps.maps.store.edits import EDITS
from avlmaps.maps.store.folder import MANIFEST, stamp
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import HeatCache
from avlmaps.query.settings import QuerySettings
from avlmaps.serve.lanes import RequestError, watch_here
from avlmaps.serve.settings import Limits, ServeError

if TYPE_CHECKING:
    from avlmaps.navigate.paths import PathFinder
    from avlmaps.query.plots import TopDown
    from avlmaps.view.labels import MapOnPage
    from avlmaps.view.route import Guide, MakeRobot

T = TypeVar("T")
# A query of each kind loads its model and compiles its loops.
_WARM = (("pixels", Modality.OBJECT, "chair"), ("views", Modality.AREA, "kitchen"), ("sounds", Modality.SOUND, "water"))
_LONGEST_NAME = 100


class ServedMap:
    """One map of a server, by the name that clients call it, and what is computed from it once."""

    def __init__(self, name: str, avlmap: AVLMap, robot: "MakeRobot | None" = None) -> None:
        self.name, self.avlmap, self._robot = name, avlmap, robot
        self._once = threading.RLock()
        self._answers: OrderedDict[object, object] = OrderedDict()

    @property
    def version(self) -> str:
        """A word that is another one for another content; clients may use it as an ETag."""
        edits = self.avlmap.edited.edits
        return f"{self.voxels_version}-{edits[-1].id}-{len(edits)}" if edits else self.voxels_version

    @property
    def voxels_version(self) -> str:
        """The same for the voxels and their order, which no edit changes."""
        info = self.avlmap.data.info
        return f"{info.build_key[:16]}-{info.timings.finished}-{info.counts.sounds}".replace('"', "")

    def as_edited_now(self) -> "ServedMap":
        """Return the map with the edits that its folder has by now; ``MapError`` where their log cannot be read."""
        edited = ServedMap(self.name, self.avlmap.as_edited_now(), self._robot)
        _ = edited.avlmap.edited
        return edited

    def prepare(self) -> None:
        """Compute what every query needs, so that the first one is as quick as the others."""
        avlmap, data = self.avlmap, self.avlmap.data
        there = {"pixels": True, "views": bool(len(data.keyframes)), "sounds": bool(len(data.sounds))}
        if len(avlmap.space):
            _ = avlmap.space.centres, avlmap.space.blocks, avlmap.space.horizontal
            for kind, modality, word in _WARM:
                if there[kind] and kind in data.info.models:
                    with suppress(QueryError, BackendError):  # a model that is not here; its queries say so
                        avlmap.heat(Part(modality, word))
        with suppress(QueryError):
            parse_sentence("the chair near the table in the kitchen")

    @cached_property
    def paths(self) -> "PathFinder":
        """The planner of this map's floor."""
        from avlmaps.navigate.paths import PathFinder

        return PathFinder(self.avlmap)

    @cached_property
    def top_down(self) -> "TopDown":
        """The map from above."""
        from avlmaps.query.plots import TopDown

        return TopDown.of(self.avlmap.space)

    @cached_property
    def page(self) -> "MapOnPage":
        """The map as the page of ``view`` draws it."""
        from avlmaps.view.labels import MapOnPage

        return MapOnPage(self.avlmap)

    @cached_property
    def guide(self) -> "Guide":
        """Plans the commands of that page."""
        from avlmaps.view.route import Guide

        return Guide(self.avlmap, self._robot)

    def once(self, key: object, work: Callable[[], T], most: int = 64) -> T:
        """Return what work returns, remembered for later under a key."""
        with self._once:
            if key not in self._answers:
                self._answers[key] = work()
            self._answers.move_to_end(key)
            while len(self._answers) > most:
                self._answers.popitem(last=False)
            return cast(T, self._answers[key])


@dataclass(frozen=True, slots=True)
class MapSource:
    """Where a map comes from that may be replaced."""

    path: Path
    stamp: Callable[[], object | None]  # another value for another map; None while there is no map
    open: "Callable[[], AVLMap]"
    tells: bool = True  # whether a replacement is worth a line in the log

    @classmethod
    def of(cls, path: Path) -> "MapSource":
        """Return that of a map on the disk."""
        return cls(path, lambda: stamp(path / MANIFEST), lambda: AVLMap.open(path))


class _Slot:
    """One name, the map that answers for it now, and the one that is being opened."""

    def __init__(self, source: MapSource, make: "Callable[[AVLMap], ServedMap]", warm: bool) -> None:
        self.path, self._source, self._make = source.path, source, make
        self._lock = threading.Lock()
        self._opening: threading.Thread | None = None
        self._fault: AvlmapsError | OSError | None = None
        self._edits = self._edits_now
        self._stamp, self.map = self._opened(warm)

    @property
    def _edits_now(self) -> object | None:
        return stamp(self.path / EDITS)

    def _opened(self, warm: bool = True) -> tuple[object, ServedMap]:
        before, opened = self._source.stamp(), self._make(self._source.open())
        if warm:
            opened.prepare()
        return before, opened

    def refresh(self, note: Callable[[str], None]) -> None:
        """Take new edits, and begin to open the map that has replaced this one, if there is one."""
        with self._lock:
            self._take_edits(note)
            is_opening = self._opening is not None and self._opening.is_alive()
            if is_opening or self._source.stamp() in (None, self._stamp):
                return
            self._opening = threading.Thread(target=self._reopen, args=(note,), name="avlmaps-reopen", daemon=True)
            self._opening.start()

    def _take_edits(self, note: Callable[[str], None]) -> None:
        if (edits := self._edits_now) == self._edits:
            return
        try:
            self.map = self.map.as_edited_now()
        except (AvlmapsError, OSError) as error:
            note(f"{self.map.name}: its edits cannot be read ({error}); those of before count.")
        self._edits = edits

    def _reopen(self, note: Callable[[str], None]) -> None:
        begin, tried, edits = perf_counter(), self._source.stamp(), self._edits_now
        name = self.map.name
        try:
            before, opened = self._opened()
        except (AvlmapsError, OSError) as error:
            self._stamp, self._fault = tried, error
            note(f"{name}: the map was replaced, and the new one cannot be opened ({error}); the old one answers.")
            return
        with self._lock:  # what was edited while it was opened counts as well
            self._stamp, self.map, self._fault, self._edits = before, opened, None, edits
            self._take_edits(note)
        if self._source.tells:
            note(f"{name}: the map was replaced; the new one was opened in {perf_counter() - begin:.1f} s.")

    @property
    def is_stale(self) -> bool:
        """Whether the map that answers is not the one in the folder: that is gone, or cannot be opened."""
        return self._fault is not None or self._source.stamp() is None

    def wait(self, timeout_s: float) -> None:
        if self._opening is not None:
            self._opening.join(timeout_s)


class Shelf:
    """The maps of a server by their names."""

    def __init__(
        self,
        maps: Mapping[str, Path | MapSource],
        limits: Limits | None = None,
        note: Callable[[str], None] = lambda _: None,
        settings: QuerySettings | None = None,
        robot: "MakeRobot | None" = None,
        warm: bool = True,
    ) -> None:
        """Open maps by their names (see ``named_maps``), or raise ``MapError``.

        ``note`` is given a line when a map was replaced; ``robot`` puts a simulated one into a map's scene, for the
        commands of its page; ``warm`` maps compute now what every query needs.
        """
        cache_bytes = (limits or Limits()).cache_bytes
        self._note = note

        def made(name: str, opened: AVLMap) -> ServedMap:
            cache = HeatCache(cache_bytes, lambda part: watch_here().step(f"heat of the {part.modality}"))
            avlmap = AVLMap(opened.data, opened.encoders, path=opened.path, settings=settings, heats=cache)
            return ServedMap(name, avlmap, robot)

        sources = {name: MapSource.of(one) if isinstance(one, Path) else one for name, one in maps.items()}
        self._slots = {name: _Slot(source, partial(made, name), warm) for name, source in sources.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """The maps' names, in the order in which they were given."""
        return tuple(self._slots)

    @property
    def paths(self) -> Mapping[str, Path]:
        """The maps' folders by name; for the server's own use, never for an answer."""
        return {name: slot.path for name, slot in self._slots.items()}

    def get(self, name: str | None = None) -> ServedMap:
        """Return the map of a name; without a name the only map, or ``RequestError`` where there are several."""
        if name is None and len(self._slots) > 1:
            raise RequestError(f"This server has {len(self._slots)} maps; name one of: {', '.join(self.names)}.")
        name = self.names[0] if name is None else name
        slot = self._slots.get(name)
        if slot is None:
            raise RequestError(
                f"There is no map {name[:80]!r} here; the maps are: {', '.join(self.names)}.", 404, "map-name"
            )
        slot.refresh(self._note)
        return slot.map

    def is_stale(self, name: str) -> bool:
        """Return whether a map is gone, or was replaced by one that cannot be opened; the old one answers."""
        return self._slots[name].is_stale

    def refresh(self, wait_s: float = 0.0) -> None:
        """Look for replaced maps, and wait up to a time until they are open."""
        for slot in self._slots.values():
            slot.refresh(self._note)
            slot.wait(wait_s)


def named_maps(words: Sequence[str]) -> dict[str, Path]:
    """Return folders by name, from words such as ``home.avlmap`` or ``upstairs=/data/home.avlmap``."""
    maps: dict[str, Path] = {}
    for word in words:
        given, mark, rest = word.partition("=")
        named = bool(mark) and "/" not in given and "\\" not in given and not user_path(word).exists()
        path = user_path(rest if named else word).absolute()
        name = given if named else path.name.removesuffix(".avlmap")
        if not name or len(name) > _LONGEST_NAME or not all(c.isalnum() or c in "-_. " for c in name) or name[0] == ".":
            raise ServeError(f"{name!r} cannot be the name of a map; name it with letters, such as: home={path.name}.")
        if name in maps:
            raise ServeError(
                f"Two maps are called {name!r} ({maps[name]} and {path}); name one of them: {name}-2={path}."
            )
        maps[name] = path
    if not maps:
        raise ServeError("The server needs a map; give the folder of at least one.")
    return maps
