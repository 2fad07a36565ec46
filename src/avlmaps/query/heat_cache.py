"""The heat of words, remembered by a map that many query."""

import threading
from collections import OrderedDict
from collections.abc import Callable

from avlmaps.core.question import Part, Role
from avlmaps.query.heatmap import Heatmap

_BYTES_PER_VOXEL, _BYTES = 12, 4096  # of a factor that was used: heat, mask or winner, and its twin with unsure things


class HeatCache:
    """Remembers heat up to a size; what was queried longest ago goes first. Threads may use it."""

    def __init__(self, most_bytes: int, watch: Callable[[Part], object] = lambda part: None) -> None:
        """Begin empty.

        Args:
            most_bytes: about how much heat may take.
            watch: is given each part before its heat is looked up.
        """
        self._most_bytes, self._watch = most_bytes, watch
        self._held: OrderedDict[Part, tuple[Heatmap, int]] = OrderedDict()
        self._held_bytes = 0
        self._lock = threading.Lock()

    def anew(self) -> "HeatCache":
        """Return an empty one of the same size."""
        return HeatCache(self._most_bytes, self._watch)

    def heat(self, part: Part, find: Callable[[], Heatmap]) -> Heatmap:
        """Return the heat of a part; that of a file, whose name says nothing, is found each time."""
        self._watch(part)
        if part.is_file:
            return find()
        with self._lock:
            held = self._held.get(part)
            if held is not None:
                self._held.move_to_end(part)
        if held is not None:
            if part.role is Role.CONTEXT:  # queried again: its heat everywhere serves every further query
                _ = held[0].values
            return held[0]
        heat = find()
        self._hold(part, heat)
        return heat

    def _hold(self, part: Part, heat: Heatmap) -> None:
        size = sum(len(heat.space) * _BYTES_PER_VOXEL + _BYTES for _ in heat.factors)
        with self._lock:
            if part in self._held or size > self._most_bytes:
                return
            self._held[part] = heat, size
            self._held_bytes += size
            while self._held_bytes > self._most_bytes:
                self._held_bytes -= self._held.popitem(last=False)[1][1]
