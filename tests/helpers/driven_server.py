"""A robot for the tests of the driving server: it goes exactly where it is told, and counts what moved it."""

import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from avlmaps.core.motion import GroundPose
from avlmaps.maps.obstacles import Obstacles
from avlmaps.navigate.costmap import BASE, obstacles_for
from avlmaps.navigate.driver import Arrival
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.drive.app import DriveService
from avlmaps.serve.drive.orders import Dispatcher, OrderLog
from avlmaps.serve.service import Service
from helpers.kinematic import KinematicDriver

if TYPE_CHECKING:
    from avlmaps.serve.drive.robots import Machine

START = GroundPose(4.4, 3.2, 0.0)


class HeldDriver(KinematicDriver):
    """Each movement waits until it is let go, or until the robot is stopped."""

    let_go: threading.Event
    halted: threading.Event
    broken: str = ""

    def fault(self) -> str:
        return self.broken

    def turn(self, angle_rad: float) -> Arrival:
        while not self.let_go.wait(0.01):
            if self.halted.is_set():
                return self._came(self.pose, (), "it was told to stop")
        return super().turn(angle_rad)


@dataclass
class CountingMachine:
    """A robot on the map of the tests."""

    name: str = "counting robot"
    identity: str = "counting"
    is_real: bool = False
    shape: Any = BASE
    guess: bool = False
    start: GroundPose = START
    pace_s: float = 0.0
    stands: bool = True
    prepared: list[str] = field(default_factory=list)
    stops: int = 0
    closed: int = 0
    _obstacles: Obstacles | None = None

    def __post_init__(self) -> None:
        self.body = HeldDriver(self.start)
        self.body.let_go, self.body.halted = threading.Event(), threading.Event()
        self.body.let_go.set()

    @property
    def motions(self) -> int:
        return len(self.body.told)

    def prepare(self, avlmap: AVLMap, version: str) -> Obstacles:
        if self._obstacles is None or version not in self.prepared:
            self.prepared.append(version)
            self._obstacles = obstacles_for(avlmap, self.shape)
            self.body.level_from_world = np.asarray(self._obstacles.level_from_world)
        return self._obstacles

    @property
    def driver(self) -> HeldDriver:
        self.body.halted.clear()
        return self.body

    def stop(self) -> tuple[bool, str]:
        self.stops += 1
        self.body.halted.set()
        return self.stands, "it stands" if self.stands else "it is not seen to stand"

    def close(self) -> None:
        self.closed += 1


@dataclass
class Driven:
    """A driving server on a robot that counts."""

    machine: CountingMachine
    dispatcher: Dispatcher
    service: DriveService
    log: Path
    now_s: list[float]

    @property
    def mounts(self) -> dict[str, Any]:
        return {"/drive": self.service.app}

    @property
    def entries(self) -> list[dict[str, Any]]:
        import json

        return [json.loads(line) for line in self.log.read_text(encoding="utf-8").splitlines()]

    @property
    def events(self) -> list[str]:
        return [entry["event"] for entry in self.entries]


def driven(maps: Service, log: Path, machine: CountingMachine | None = None) -> Driven:
    """Return a driving server beside a server of maps."""
    machine, now_s = machine or CountingMachine(), [0.0]
    dispatcher = Dispatcher(cast("Machine", machine), maps.shelf.get, OrderLog(log), clock=lambda: now_s[0])
    return Driven(machine, dispatcher, DriveService(dispatcher, maps), log, now_s)
