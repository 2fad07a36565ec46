"""The connection to one robot, made again when it was lost, and where the robot says that it is."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic, sleep

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps.navigate.ros.frames import Frames
from avlmaps.navigate.ros.link import Link
from avlmaps.navigate.ros.settings import RosSettings
from avlmaps.navigate.ros.tree import LiveTree, Sighting

_LOOK_EVERY_S = 0.02
_STILL_M, _STILL_RAD, _STILL_S = 0.02, 0.03, 0.3


class Contact:
    """One robot behind one address.

    Attributes:
        frames: the robot's frames, and how they lie to the map.
        settings: patience and names.
        link: the connection that stands, or stood last.
    """

    def __init__(
        self,
        url: str,
        token: str | None,
        frames: Frames,
        settings: RosSettings,
        tf_kind: str,
        greet: Callable[[Link], None],
        clock: Callable[[], float] = monotonic,
    ) -> None:
        """Connect, and wait until the robot reports its pose.

        Args:
            url: of rosbridge.
            token: for a proxy before it.
            frames: the robot's frames.
            settings: patience and names.
            tf_kind: the type of /tf.
            greet: called with every new connection, to subscribe to what else is needed.
            clock: seconds, by which the age of a pose is measured; replaced in tests.

        Raises:
            NavigationError: there is no bridge, or the robot does not report its pose.
            BackendError: roslibpy is not installed.
        """
        self.frames, self.settings = frames, settings
        self._url, self._token, self._tf_kind, self._greet = url, token, tf_kind, greet
        self._clock = clock
        self._last: GroundPose | None = None
        self._connect()
        if self.pose_within(settings.pose_timeout_s) is None:
            self.link.close()
            raise NavigationError(
                f"The robot at {self.link.url} does not report its pose: {self.unseen(closed=True)}; start its "
                "localisation, give it its initial pose, and name its frames as docs/robots.md shows."
            )

    def _connect(self) -> None:
        link = Link(self._url, self._token, self.settings.connect_timeout_s)
        tree, prefix = LiveTree(self._clock), self.settings.tf_namespace
        link.subscribe(f"{prefix}/tf", self._tf_kind, lambda message: tree.hear(message, static=False))
        link.subscribe(f"{prefix}/tf_static", self._tf_kind, lambda message: tree.hear(message, static=True))
        self._greet(link)
        self.link, self._tree = link, tree

    def renew(self) -> None:
        """Connect again where the connection was lost.

        Raises:
            NavigationError: the robot is not there.
        """
        if self.link.lost is not None:
            self._connect()

    @contextmanager
    def anew(self) -> Iterator[Link | None]:
        """Open a second connection for a moment; None where the robot is not there."""
        try:
            link = Link(self._url, self._token, min(2.0, self.settings.connect_timeout_s))
        except NavigationError:
            yield None
            return
        try:
            yield link
        finally:
            link.close()

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame; where it was last, when that is not reported any more."""
        self._fresh()
        assert self._last is not None, "the constructor waits for it"
        return self._last

    def pose_within(self, wait_s: float) -> GroundPose | None:
        """Return the pose as soon as it is fresh; None where it is not by then."""
        until_s = monotonic() + wait_s
        while not self._fresh():
            if self.link.lost is not None or monotonic() > until_s:
                return None
            sleep(_LOOK_EVERY_S)
        return self._last

    def pose_from_now(self, wait_s: float) -> GroundPose | None:
        """Return a pose that was reported after this call; None where none is within that time."""
        now_s, until_s = self._clock(), monotonic() + wait_s
        while monotonic() < until_s and self.link.lost is None:
            seen = self.sighting()
            if seen is not None and seen.heard_s > now_s:
                self._last = self.frames.to_level(seen.pose)
                return self._last
            sleep(_LOOK_EVERY_S)
        return None

    def stands_still(self, wait_s: float) -> bool:
        """Return whether the robot comes to stand within that time.

        Only poses from now on count: two poses some time apart, and no other place between them. A robot that
        reports nothing is not seen to stand.
        """
        begun_s, until_s = self._clock(), monotonic() + wait_s
        since_s, at = begun_s, None
        while monotonic() < until_s and self.link.lost is None:
            sleep(_LOOK_EVERY_S)
            seen = self.sighting()
            if seen is None or seen.heard_s <= begun_s:
                continue
            if at is None or _is_elsewhere(at, seen.pose):
                since_s, at = seen.heard_s, seen.pose
            elif seen.heard_s - since_s >= _STILL_S:
                return True
        return False

    def is_unseen_for(self, longest_s: float) -> bool:
        """Return whether no pose has arrived for that time."""
        seen = self.sighting()
        return seen is None or seen.age_s > longest_s

    def unseen(self, closed: bool = False) -> str:
        """Return why the pose is not known, in part of a sentence."""
        if self.link.lost is not None and not closed:
            return self.loss()
        seen = self.sighting()
        if seen is not None:
            return f"its transforms are {seen.age_s:.1f} s old"
        refused = f"; {self._tree.refused} transforms were NaN or no rotation" if self._tree.refused else ""
        return self._tree.why_not(self.frames.map_frame, self.frames.base_frame) + refused

    def loss(self) -> str:
        """Return that the connection was lost, and how."""
        return f"The connection to the robot was lost ({(self.link.lost or '').rstrip('.')})"

    def sighting(self) -> Sighting | None:
        """Return the pose by the transforms now, in the robot's frame."""
        return self._tree.seen(self.frames.map_frame, self.frames.base_frame)

    def _fresh(self) -> bool:
        seen = self.sighting()
        if seen is None or seen.age_s > self.settings.pose_max_age_s:
            return False
        self._last = self.frames.to_level(seen.pose)
        return True


def _is_elsewhere(before: GroundPose, now: GroundPose) -> bool:
    turned_rad = abs(wrap_angle(now.heading_rad - before.heading_rad))
    return now.distance_m(before) > _STILL_M or turned_rad > _STILL_RAD
