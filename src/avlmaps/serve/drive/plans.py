"""Plans that wait for their confirmation, and the tokens that confirm them."""

import hmac
import json
import os
import secrets
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from avlmaps.core.errors import AvlmapsError, NavigationError
from avlmaps.core.files import state_file
from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import FRAME
from avlmaps.core.printable import printable_json
from avlmaps.language.commands import MOST_CHARACTERS
from avlmaps.navigate.grounding import Heats
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.guard import token_digest

_MOST_PLANS = 16


class DriveError(AvlmapsError):
    """An order that is not carried out.

    Attributes:
        status: HTTP status.
        kind: word for programs.
        choices: answers that would do, for a command that is unclear.
    """

    def __init__(self, message: str, status: int, kind: str, choices: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.status, self.kind, self.choices = status, kind, choices


@dataclass(frozen=True, slots=True)
class Who:
    """Where an order comes from.

    Attributes:
        address: of the client.
        by: ``http`` or ``mcp``.
    """

    address: str
    by: str = "http"

    def to_json(self) -> dict[str, str]:
        """Return it as the log has it."""
        return {"address": self.address, "by": self.by}


@dataclass(frozen=True, slots=True)
class MapNow:
    """The map as it is now.

    Attributes:
        name: as clients call it.
        version: another word for another content.
        avlmap: the map.
    """

    name: str
    version: str
    avlmap: AVLMap = field(repr=False)


@dataclass(frozen=True, slots=True)
class OrderPlan:
    """What an order would do.

    Attributes:
        order: its name in the log.
        words: the command; "" for a program.
        reading: what the robot will do, in plain words.
        program: what runs.
        notes: one sentence each: how words were taken, what a person should know.
        path: (x, y, z) places, metres, recording frame, as rehearsed on the map.
        path_m: length.
        subgoals: where it stops, as `go` reports them.
        start: where the robot stood.
        map: which map.
        version: of the map.
        robot: identity of the robot.
        choose: which of several things that fit equally are meant.
        heats: what the map answered while it was planned; see ``heats_for``.
        of: that map.
    """

    order: str
    words: str
    reading: str
    program: str
    notes: tuple[str, ...]
    path: tuple[tuple[float, float, float], ...]
    path_m: float
    subgoals: tuple[dict[str, Any], ...]
    start: GroundPose
    map: str
    version: str
    robot: str
    choose: tuple[int, ...] = ()
    heats: Heats = field(default_factory=dict, repr=False, compare=False)
    of: AVLMap | None = field(default=None, repr=False, compare=False)

    def heats_for(self, avlmap: AVLMap) -> Heats:
        """Return what the map answered, so that a drive need not query it again; nothing of another object."""
        return self.heats if avlmap is self.of else {}

    def to_json(self) -> dict[str, Any]:
        """Return the plan as clients and the log have it; a token is no part of it."""
        return {
            "order": self.order,
            "words": self.words,
            "reading": self.reading,
            "program": self.program,
            "notes": list(self.notes),
            "path": [list(place) for place in self.path],
            "path_m": round(self.path_m, 3),
            "subgoals": list(self.subgoals),
            "frame": FRAME,
            "map": self.map,
            "version": self.version,
            "robot": self.robot,
        }


class PlanBook:
    """Plans by the digests of their tokens; each token is good once, and for a short time. Not safe for threads.

    Attributes:
        lifetime_s: of a token.
        cleared: how often every plan was forgotten; a plan that was begun before the last time is not added.
    """

    def __init__(self, lifetime_s: float) -> None:
        self.lifetime_s = lifetime_s
        self.cleared = 0
        self._waiting: OrderedDict[bytes, tuple[OrderPlan, float]] = OrderedDict()

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, plan: OrderPlan, now_s: float, begun: int | None = None) -> str:
        """Keep a plan and return its token; the oldest of too many plans goes.

        ``begun`` is what ``cleared`` was when the plan was requested; that of now by default.

        Raises:
            DriveError: the robot was stopped, or took another order, while the plan was computed.
        """
        if begun not in (None, self.cleared):
            raise DriveError(
                "The robot was stopped, or took another order, while this plan was computed; plan again.",
                409, "stopped",
            )  # fmt: skip
        token = secrets.token_urlsafe(32)
        self._waiting[token_digest(token)] = plan, now_s + self.lifetime_s
        while len(self._waiting) > _MOST_PLANS:
            self._waiting.popitem(last=False)
        return token

    def take(self, token: str, now_s: float) -> OrderPlan:
        """Return the plan of a token and forget both.

        Raises:
            DriveError: there is no such token, or it is too old.
        """
        given = token_digest(token)
        found = None
        for digest in list(self._waiting):  # all of them, so that the time shows nothing
            if hmac.compare_digest(digest, given):
                found = digest
        if found is None:
            raise DriveError(
                "This token confirms no plan: it was used, replaced by an order or a stop, or never given; plan again.",
                403,
                "token",
            )
        plan, until_s = self._waiting.pop(found)
        if now_s > until_s:
            raise DriveError(
                f"The plan is older than {self.lifetime_s:g} s; plan again, and confirm sooner.", 410, "expired"
            )
        return plan

    def clear(self) -> None:
        """Forget every plan, also those that are still computed."""
        self.cleared += 1
        self._waiting.clear()


Words = Annotated[str, Meta(max_length=MOST_CHARACTERS, description="A command, such as 'go to the sofa'.")]
Program = Annotated[str, Meta(max_length=20_000, description="Skills as a program, instead of a command.")]
Choose = Annotated[
    tuple[int, ...],
    Meta(max_length=20, description="Which of the choices is meant where several things fit equally: its number."),
]
Token = Annotated[str, Meta(min_length=1, max_length=200, description="The token of the plan that is confirmed.")]


class PlanRequest(Struct, forbid_unknown_fields=True):
    """A command or a program to plan; nothing moves."""

    words: Words = ""
    program: Program = ""
    choose: Choose = ()


class ConfirmRequest(Struct, forbid_unknown_fields=True):
    """The token of a plan that a person has read."""

    token: Token


class NothingRequest(Struct, forbid_unknown_fields=True):
    """Nothing is sent."""


def default_log() -> Path:
    """Return the log in the user's state folder."""
    return state_file("orders.jsonl")


class OrderLog:
    """Appends entries; a line is whole or not there, also when several processes write."""

    def __init__(self, path: Path) -> None:
        """Open the log.

        Raises:
            NavigationError: it cannot be opened for writing.
        """
        self.path = path
        self._lock = threading.Lock()
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        except OSError as error:
            raise self._fault(error) from None

    def write(self, event: str, entry: Mapping[str, Any]) -> None:
        """Append an entry and wait until it is on the disk.

        Raises:
            NavigationError: it cannot be written; then nothing may move.
        """
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = json.dumps({"time": time, "event": event, **entry}, ensure_ascii=False, allow_nan=False)
        content = printable_json(line).encode() + b"\n"
        try:
            with self._lock:
                if os.write(self._file, content) != len(content):
                    raise OSError("the disk is full")
                os.fsync(self._file)
        except OSError as error:
            raise self._fault(error) from None

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
            self._file = -1  # the number may be another file's from now on

    def _fault(self, error: OSError) -> NavigationError:
        return NavigationError(
            f"The log of orders {self.path.name} cannot be written ({error.strerror or error}), so nothing is driven; "
            "check its folder and the space on the disk."
        )
