"""What may move the robot: one order at a time, planned on the map, confirmed by its token, stopped by anyone, logged.

The only way to a movement is `Dispatcher.confirm` with a token that `Dispatcher.plan` made. Words from maps, photos and
questions never get there by themselves: nothing here reads an order out of anything but the request for a plan.
"""

import json
import logging
import os
import secrets
import threading
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from math import degrees
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from avlmaps.core.errors import AvlmapsError, NavigationError, SeveralFitError, kind_named
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps.core.poses import FRAME
from avlmaps.core.printable import printable, printable_json
from avlmaps.language.commands import MOST_CHARACTERS, is_stop
from avlmaps.language.program import Budget, parse_program
from avlmaps.language.translator import LearnedTranslator, Translation
from avlmaps.navigate.brake import Brake
from avlmaps.navigate.costmap import floor_of_walk
from avlmaps.navigate.driver import MapDriver
from avlmaps.navigate.instruct import (
    NO_FILES,
    FreeBody,
    Outcome,
    given_by,
    instruct,
    path_in_world,
    rehearse,
    settings_after,
)
from avlmaps.navigate.skills import RobotSettings
from avlmaps.serve.drive.robots import Machine
from avlmaps.serve.guard import token_digest
from avlmaps.serve.lanes import RequestError, context_of_its_own
from avlmaps.serve.requests import Request
from avlmaps.serve.shelf import ServedMap

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles

log = logging.getLogger("avlmaps.serve.drive")
_REHEARSAL = Budget(seconds=20.0)
_MOVED_M, _MOVED_RAD = 0.5, 0.35  # a robot that stands elsewhere than its plan begins is not driven by it
_LONGEST_STOP_S, _STOP_AGAIN_S = 15.0, 0.5
_MOST_PLANS = 16
_MOST_LINES, _LONGEST_LINE = 50, 500


@dataclass(frozen=True, slots=True)
class Who:
    """Where an order comes from: the client's address, and ``http`` or ``mcp``."""

    address: str
    by: str = "http"


_REFUSALS = {
    "stopped": (409, "The robot was stopped, or took another order, meanwhile; plan again."),
    "token": (403, "This token confirms no plan: it was used, replaced by an order or a stop, or never given."),
    "expired": (410, "The plan is older than {:g} s; plan again, and confirm sooner."),
    "usage": (400, "An order is a command (words) or a program, and not both."),
    "map-changed": (409, "The map was replaced since the plan was made; plan again."),
    "robot-changed": (409, "The plan was made for another robot; plan again."),
    "unstopped": (503, "The robot did not confirm its last stop ({}); stop it until it does."),
    "ending": (503, "The server is ending; it takes no orders."),
    "busy": (409, "The robot is at another order ({}); wait for its end, or stop it: /drive/stop (stop_robot)."),
    "stop": (409, "{}; /drive/stop (stop_robot) stops the robot, without a plan."),
    "moved": (409, "The robot stands {:.2f} m from where the plan begins, turned by {:.0f} degrees; plan again."),
}


def _refused(kind: str, *said: object) -> RequestError:
    status, sentence = _REFUSALS[kind]
    return RequestError(sentence.format(*said), status, kind)


class OrderPlan(Struct, frozen=True, kw_only=True):
    """What an order would do, as clients and the log have it; a token is no part of it."""

    order: str
    words: str
    reading: str
    program: str
    notes: list[str]
    path: list[list[float]]  # metres, recording frame
    path_m: float
    subgoals: list[dict[str, Any]]
    start: GroundPose  # level frame
    map: str
    version: str  # of the map
    robot: str  # its identity
    choose: tuple[int, ...] = ()
    frame: str = FRAME


class PlanBook:
    """Plans by the digests of their tokens; each token is good once, and for a short time. Not safe for threads."""

    def __init__(self, lifetime_s: float) -> None:
        self.lifetime_s = lifetime_s  # of a token
        self.cleared = 0  # how often every plan was forgotten; one that was begun before the last time is not added
        self._waiting: dict[bytes, tuple[OrderPlan, float]] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, plan: OrderPlan, now_s: float, begun: int | None = None) -> str:
        """Keep a plan that was requested when ``cleared`` was ``begun``, and return its token; the oldest goes.

        It is refused where the robot was stopped, or took another order, while the plan was computed.
        """
        if begun not in (None, self.cleared):
            raise _refused("stopped")
        token = secrets.token_urlsafe(32)
        self._waiting[token_digest(token)] = plan, now_s + self.lifetime_s
        if len(self._waiting) > _MOST_PLANS:
            del self._waiting[next(iter(self._waiting))]
        return token

    def take(self, token: str, now_s: float) -> OrderPlan:
        """Return the plan of a token and forget both; the digest is looked up, so that the time shows nothing."""
        plan, until_s = self._waiting.pop(token_digest(token), (None, 0.0))
        if plan is None:
            raise _refused("token")
        if now_s > until_s:
            raise _refused("expired", self.lifetime_s)
        return plan

    def clear(self) -> None:
        """Forget every plan, also those that are still computed."""
        self.cleared += 1
        self._waiting.clear()


class PlanRequest(Request):
    """A command or a program to plan; nothing moves."""

    words: Annotated[str, Meta(max_length=MOST_CHARACTERS, description="A command, such as 'go to the sofa'.")] = ""
    program: Annotated[str, Meta(max_length=20_000, description="Skills as a program, instead of a command.")] = ""
    choose: Annotated[
        tuple[int, ...], Meta(max_length=20, description="Which choice is meant where several things fit: its number.")
    ] = ()


class ConfirmRequest(Request):
    """The token of a plan that a person has read."""

    token: Annotated[str, Meta(min_length=1, max_length=200, description="The token of the plan that is confirmed.")]


class OrderLog:
    """Appends entries; a line is whole or not there, also when several processes write."""

    def __init__(self, path: Path) -> None:
        """Take its file, or raise ``NavigationError`` where it cannot be opened for writing."""
        self.path = path
        self._append(b"")

    def write(self, event: str, entry: Mapping[str, Any]) -> None:
        """Append an entry and wait until it is on the disk; where it cannot be written nothing may move."""
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = json.dumps({"time": time, "event": event, **entry}, ensure_ascii=False, allow_nan=False)
        self._append(printable_json(line).encode() + b"\n")

    def _append(self, content: bytes) -> None:
        try:
            self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            number = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            with os.fdopen(number, "wb", buffering=0) as file:
                if file.write(content) != len(content):
                    raise OSError("the disk is full")
                os.fsync(number)
        except OSError as error:
            raise NavigationError(
                f"The log of orders {self.path.name} cannot be written ({error.strerror or error}), so nothing is "
                "driven; check its folder and the space on the disk."
            ) from None


@dataclass(slots=True)
class RunningOrder:
    """A confirmed plan that runs."""

    plan: OrderPlan
    now: ServedMap
    brake: Brake
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=_MOST_LINES))
    thread: threading.Thread | None = None
    stopped: bool = False  # by a client, who hears whether the robot stands


class Dispatcher:
    """Decides what moves the robot.

    ``fault`` is why it may still drive although it was stopped last, "" where it stood; ``change`` is a number that
    grows with each change of the status.
    """

    def __init__(
        self,
        machine: Machine,
        current: Callable[[], ServedMap],
        order_log: OrderLog,
        *,
        token_s: float = 60.0,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.machine, self.log, self.fault, self.change = machine, order_log, "", 0
        self._current, self._clock, self._book = current, clock, PlanBook(token_s)
        self._preparing = threading.Lock()  # plans and confirmations, one at a time; never needed for a stop
        self._lock = threading.Lock()  # of what follows; never held while something waits
        self._running: RunningOrder | None = None
        self._last: dict[str, Any] | None = None
        self._closed = False

    # Planning.

    def connect(self) -> None:
        """Connect to the robot; ``NavigationError`` where it cannot be reached, or cannot stand on the map."""
        self._ready(self._current())

    def _ready(self, now: ServedMap) -> "Obstacles":
        obstacles = self.machine.prepare(now.avlmap, now.version)
        if fault := self.machine.driver.fault():
            raise NavigationError(f"The {self.machine.name} cannot be driven: {fault.rstrip('.')}.")
        return obstacles

    @property
    def begun(self) -> int:
        """A number for plans that are requested now: they are void after the next stop or order."""
        return self._book.cleared

    def plan(
        self, words: str, program: str, who: Who, begun: int | None = None, choose: tuple[int, ...] = ()
    ) -> dict[str, Any]:
        """Plan a command or a program on the map, and return the plan with its token.

        ``begun`` is of when it was requested, now by default; ``choose`` answers which of several things is meant.
        ``RequestError`` says why there is no plan, and so no token.
        """
        begun = self.begun if begun is None else begun
        with self._refusing(who, words=words, program=program):
            if is_stop(words):
                raise _refused("stop", "Nothing drives" if self._running is None else self.stop(who)["note"])
            with self._preparing:
                self._require_idle()
                plan = self._planned(words, program, choose)
            with self._lock:
                token = self._book.add(plan, self._clock(), begun)
            told = msgspec.to_builtins(plan)
            self.log.write("planned", {"who": asdict(who), **told})
        self._changed()
        # The token stands before the path, which may be long.
        return {"order": plan.order, "token": token, "expires_in_s": self._book.lifetime_s, **told}

    @contextmanager
    def _refusing(self, who: Who, **entry: str) -> Generator[None]:
        try:
            yield
        except AvlmapsError as error:
            refused = _refusal(error)
            self._note("refused", {"who": asdict(who), **entry, "kind": refused.kind, "outcome": str(refused)})
            raise refused from None

    def _planned(self, words: str, program: str, choose: tuple[int, ...]) -> OrderPlan:
        now = self._current()
        translation = self._read(words, program, now, choose)
        settings = settings_after(translation, self._settings(choose))
        obstacles, start = self._ready(now), self.machine.driver.pose
        body = MapDriver(obstacles, FreeBody(start), self.machine.shape)
        outcome = rehearse(words, translation, now.avlmap, body, settings=settings, budget=_REHEARSAL)
        if outcome.error is not None:
            kind = _kind(outcome.error_type or "RefusedError")
            raise RequestError(f"There is no plan: {outcome.error}", 422, kind, outcome.choices)
        path = path_in_world(outcome, now.avlmap, _floor_m(now))
        return OrderPlan(
            order=secrets.token_hex(8), words=words, reading=translation.plan or _reading(outcome),
            program=translation.program, notes=list(dict.fromkeys((*translation.notes, *outcome.notes))),
            path=np.round(path, 3).tolist(), path_m=round(outcome.path_m, 3),
            subgoals=[move.to_json() for move in outcome.subgoals], map=now.name, version=now.version,
            robot=self.machine.identity, start=start, choose=settings.choose,
        )  # fmt: skip

    def _read(self, words: str, program: str, now: ServedMap, choose: tuple[int, ...]) -> Translation:
        if bool(words.strip()) == bool(program.strip()):
            raise _refused("usage")
        if program.strip():
            parse_program(program)
            return Translation(program)
        return LearnedTranslator(given_by(now.avlmap, said=words), next(iter(choose), None)).program_for(words)

    def _settings(self, choose: tuple[int, ...]) -> RobotSettings:
        return RobotSettings(guess=self.machine.guess, choose=choose)

    # Driving.

    def confirm(self, token: str, who: Who) -> dict[str, Any]:
        """Start the plan of a token; ``RequestError`` says why nothing is started."""
        with self._refusing(who), self._preparing:
            order = self._begun(token)
            try:
                self._ready(order.now)
                here, start = self.machine.driver.pose, order.plan.start
                turned_rad = abs(wrap_angle(here.heading_rad - start.heading_rad))
                if here.distance_m(start) > _MOVED_M or turned_rad > _MOVED_RAD:
                    raise _refused("moved", here.distance_m(start), degrees(turned_rad))
                self.log.write("confirmed", {"who": asdict(who), **msgspec.to_builtins(order.plan)})
                if order.brake.pulled:
                    raise _refused("stopped")
                run = context_of_its_own().run  # what the order says is read over HTTP
                order.thread = threading.Thread(target=run, args=(self._run, order, who), name="avlmaps-order")
                order.thread.start()
            except BaseException:
                with self._lock:
                    self._running = None
                raise
        self._changed()
        return {"order": order.plan.order, "state": "driving", "reading": order.plan.reading}

    def _begun(self, token: str) -> RunningOrder:
        self._require_idle()
        now = self._current()
        with self._lock:
            plan = self._book.take(token, self._clock())
            if plan.version != now.version or plan.map != now.name:
                raise _refused("map-changed")
            if plan.robot != self.machine.identity:
                raise _refused("robot-changed")
            if self.fault:
                raise _refused("unstopped", self.fault)
            self._book.clear()  # other plans begin where the robot stands now
            self._running = RunningOrder(plan, now, Brake(now.avlmap, self.machine.pace_s))
            return self._running

    def _require_idle(self) -> None:
        with self._lock:
            if self._closed:
                raise _refused("ending")
            if self._running is not None:
                raise _refused("busy", self._running.plan.order)

    def _run(self, order: RunningOrder, who: Who) -> None:
        plan, brake, faulted = order.plan, order.brake, False
        answer = {"ok": False, "error": "The order ended by a fault of avlmaps; the server's log has the details."}
        try:
            answer = instruct(
                plan.words, order.now.avlmap, self.machine.driver, LearnedTranslator(),
                settings=self._settings(plan.choose), readable=NO_FILES,
                translation=Translation(plan.program, tuple(plan.notes), plan.reading),
                tell=lambda line: self._tell(order, line), brake=brake,
            ).to_json()  # fmt: skip
        except Exception:
            log.exception("order %s", plan.order)
            brake.pull()
            faulted = True
        if faulted or (brake.pulled and not order.stopped):  # by an edit, or by a fault of ours
            self._noted_stop(Who("server", "edit" if brake.forbidden else "fault"), plan.order, *self._halt())
        note = {"note": brake.forbidden} if brake.forbidden else {}
        ended = {"order": plan.order, "words": plan.words, "stopped": brake.pulled, "outcome": answer, **note}
        self._note("ended", {"who": asdict(who), **ended})
        with self._lock:
            self._running, self._last = None, ended
        self._changed()

    def _tell(self, order: RunningOrder, line: str) -> None:
        order.lines.append(printable(line, _LONGEST_LINE))
        self._changed()

    def _note(self, event: str, entry: dict[str, Any]) -> None:
        try:
            self.log.write(event, entry)
        except NavigationError as fault:
            log.error("%s", fault)

    # Stopping.

    def stop(self, who: Who) -> dict[str, Any]:
        """Stop the robot at once, and forget every plan; never raises."""
        order, until_s = self.brake_now(), monotonic() + _LONGEST_STOP_S
        stands, note = self._halt()
        thread = None if order is None else order.thread
        while thread is not None and thread.is_alive() and monotonic() < until_s:
            thread.join(_STOP_AGAIN_S)
            if thread.is_alive():  # a goal that was sent in the same instant is cancelled as well
                stands, note = self._halt()
        if thread is not None and thread.is_alive():
            stands, note = False, f"{note.rstrip('.')}; its program has not ended"
        return self._noted_stop(who, None if order is None else order.plan.order, stands, note)

    def _noted_stop(self, who: Who, order: str | None, stands: bool, note: str) -> dict[str, Any]:
        with self._lock:
            self.fault = "" if stands else note
        answer: dict[str, Any] = {"stopped": stands, "note": note, "order": order}
        self._note("stop", {"who": asdict(who), **answer})
        self._changed()
        return answer

    def brake_now(self) -> RunningOrder | None:
        """Pull the brake without waiting for the robot; `stop` follows. It returns the order that runs."""
        with self._lock:
            self._book.clear()
            if self._running is not None:
                self._running.stopped = True
                self._running.brake.pull()
            return self._running

    def _halt(self) -> tuple[bool, str]:
        try:
            return self.machine.stop()
        except Exception as error:
            log.exception("stop")
            return False, f"the stop failed ({printable(error, 200)}); use the robot's own stop"

    def close(self) -> None:
        """Stop the robot and end its connection."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self.stop(Who("server", "shutdown"))
        self.machine.close()

    # Status.

    def _changed(self) -> None:
        with self._lock:
            self.change += 1

    def status(self) -> dict[str, Any]:
        """Return what the robot is at."""
        with self._lock:
            order, last, fault, waiting = self._running, self._last, self.fault, len(self._book)
        state = "idle" if order is None else "stopping" if order.brake.pulled else "driving"
        said = "order", "words", "reading", "program"
        running = order and {**{name: getattr(order.plan, name) for name in said}, "lines": list(order.lines)}
        return {
            "state": "unstopped" if fault and order is None else state,
            "robot": self.machine.name,
            "real": self.machine.is_real,
            "pose": self._pose(),
            "frame": FRAME,
            "order": running,
            "last": last,
            "plans_waiting": waiting,
            "fault": fault or None,
        }

    def _pose(self) -> dict[str, Any] | None:
        try:
            pose, now = self.machine.driver.pose, self._current()
            place = now.avlmap.space.world(np.array([pose.x_m, pose.y_m, _floor_m(now)]))
        except AvlmapsError:
            return None
        position = [round(float(value), 3) for value in place]
        return {"position": position, "heading_deg": round(degrees(pose.heading_rad), 1)}


def _floor_m(now: ServedMap) -> float:
    return now.once("floor", lambda: floor_of_walk(now.avlmap))


def _refusal(error: AvlmapsError) -> RequestError:
    if isinstance(error, RequestError):
        return error
    status = 503 if isinstance(error, NavigationError) else 422
    return RequestError(str(error), status, _kind(type(error).__name__), getattr(error, "choices", ()))


def _kind(error_type: str) -> str:
    return "unclear" if error_type == SeveralFitError.__name__ else kind_named(error_type)


def _reading(outcome: Outcome) -> str:
    steps = []
    for move in outcome.moves:
        what = move.skill.replace("_", " ")
        where = move.name or ("" if move.goal is None else f"({move.goal[0]:.2f}, {move.goal[1]:.2f})")
        steps.append(f"{what} {where}".strip())
    if not steps:
        return "I will run the program, which moves nothing."
    more = f", and {len(steps) - 20} more" if len(steps) > 20 else ""
    return printable(f"I will run the program: {', then '.join(steps[:20])}{more}.")
