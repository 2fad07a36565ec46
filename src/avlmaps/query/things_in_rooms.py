"""How far the kind of room speaks for a thing that seems to stand in it: a stove in a bedroom is seldom one."""

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.perception.protocols import RoomContents
from avlmaps.query.room_contents import commonness
from avlmaps.query.rooms import RoomField

# What one room says about one thing lies between these, in nats. Much may stand in an unusual room, and
# a thing in its usual room may still be another.
_LEAST_NATS, _MOST_NATS = -3.0, 1.0


class ThingsInRooms:
    """The evidence of the rooms of a map on the things in it.

    Args:
        field: how likely each place is each kind of room.
        contents: the things of rooms of each kind.
    """

    def __init__(self, field: RoomField, contents: RoomContents) -> None:
        self._field = field
        self._contents = contents
        self._nats: dict[tuple[str, ...], Float32[np.ndarray, " c"] | None] = {}

    def nats(
        self, names: tuple[str, ...], rows: Int[np.ndarray, " a"], instance: Int[np.ndarray, " a"], count: int
    ) -> Float[np.ndarray, " i"] | None:
        """Return the mean, over the voxels of each instance, of ln of how many times as common such things are there.

        Returns:
            Nats in [-3, 1]; None where it is not known in which rooms such things stand.
        """
        if names not in self._nats:
            self._nats[names] = self._of_cells(names)
        of_cells = self._nats[names]
        if of_cells is None:
            return None
        total = np.bincount(instance, of_cells[self._field.plan.voxel_cells[rows]], minlength=count)
        mean = total / np.maximum(np.bincount(instance, minlength=count), 1)
        return np.clip(mean, _LEAST_NATS, _MOST_NATS)

    def _of_cells(self, names: tuple[str, ...]) -> Float32[np.ndarray, " c"] | None:
        nats = commonness(names, self._field.kinds, self._contents)
        if nats is None:
            return None
        return np.log(np.maximum(self._field.share @ np.exp(nats), 1e-9)).astype(np.float32)


def with_rooms(
    confidence: Float[np.ndarray, " i"], nats: Float[np.ndarray, " i"], cost: float
) -> Float[np.ndarray, " i"]:
    """Return confidences after the evidence of rooms: their log-odds raised by it, less a cost.

    Args:
        confidence: of each instance, in [0, 1].
        nats: evidence for each, times its weight.
        cost: nats; most things stand in rooms that speak for them, which the confidence knows already.
    """
    odds = np.exp(nats - cost)
    return confidence * odds / np.maximum(1.0 - confidence + confidence * odds, 1e-12)
