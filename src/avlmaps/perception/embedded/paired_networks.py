"""Two networks that look at the same frame: one that saw real frames in training, one that saw rendered worlds alone.

Where they agree on what a frame shows, it is like the worlds that both know, and the mean of the two is right more
often than either. Where they do not, it is a real frame, of which the second knows little: then the first decides.
Agreement is the Bhattacharyya coefficient of their probabilities, the mean over the frame's cells. Ensembles of
networks: Hansen and Salamon, "Neural Network Ensembles", IEEE TPAMI 1990.
"""

from dataclasses import replace
from functools import cache
from hashlib import sha256

import numpy as np

from avlmaps.core.arrays import Bool, Float32
from avlmaps.perception.embedded.scene_network import (
    PLAIN,
    SYNTHETIC_WEIGHTS,
    Augmentation,
    Notes,
    SceneNetwork,
    Seen,
    load_network,
)
from avlmaps.recordings.types import Frame

# Agreement at which the second network begins to count, and from which on both count the same; in between its share
# grows evenly. Chosen on real frames of the development split and on frames of simulated homes with artists' furniture
# (training/pixels/README.md).
NO_SAY, SAME_SAY = 0.75, 0.95


class PairedNetworks:
    """A network and a second one that has a say where the two agree.

    Args:
        first: its notes are the pair's; its categories hold all of the second's.
        second: the other one.

    Attributes:
        notes: of the first.
        checksum: of both and of how they are mixed.

    Raises:
        ValueError: the second network has categories that the first lacks, or other kinds of room.
    """

    def __init__(self, first: SceneNetwork, second: SceneNetwork) -> None:
        self._first, self._second = first, second
        self.notes: Notes = first.notes
        if more := sorted(set(second.notes.categories) - set(first.notes.categories)):
            raise ValueError(f"The second network has {', '.join(more)}, which the first lacks; swap them.")
        if second.notes.rooms != first.notes.rooms:
            raise ValueError("The two networks know different kinds of room; train them with one list.")
        self._column = np.array([first.notes.categories.index(name) for name in second.notes.categories])
        both = f"{first.checksum} {second.checksum} {NO_SAY} {SAME_SAY}"
        self.checksum = sha256(both.encode()).hexdigest()

    def see(self, frame: Frame, augmentation: Augmentation = PLAIN) -> Seen:
        """Encode a frame with both networks."""
        seen, second = self._first.see(frame, augmentation), self._second.see(frame, augmentation)
        other = np.zeros_like(seen.category)
        other[..., self._column] = second.category
        share = share_of_second(seen.category, other, seen.known)
        return replace(
            seen, category=mixed(seen.category, other, share), room=mixed(seen.room, second.room, share)
        )  # fmt: skip


def share_of_second(
    first: Float32[np.ndarray, "h w c"], second: Float32[np.ndarray, "h w c"], known: Bool[np.ndarray, "h w"]
) -> float:
    """Return the say that a second network has in a frame, from 0 to a half.

    Args:
        first: probabilities of the network that decides where they differ.
        second: of the other.
        known: which cells have a depth; only these are compared.
    """
    agreement = np.sqrt(first * second).sum(axis=-1)
    mean = float(agreement[known].mean()) if known.any() else 0.0
    return 0.5 * float(np.clip((mean - NO_SAY) / (SAME_SAY - NO_SAY), 0.0, 1.0))


def mixed(
    first: Float32[np.ndarray, "*n c"], second: Float32[np.ndarray, "*n c"], share: float
) -> Float32[np.ndarray, "*n c"]:
    """Return the mean of two networks' probabilities, the second's with a weight of ``share``."""
    return (1.0 - share) * first + share * second if share else first


@cache
def load_pair() -> PairedNetworks:
    """Return the two networks that ship with the package.

    Raises:
        BackendError: files are missing or damaged.
    """
    return PairedNetworks(load_network(), load_network(SYNTHETIC_WEIGHTS))
