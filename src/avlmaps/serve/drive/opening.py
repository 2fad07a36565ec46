"""Opening a driving server beside a server of maps."""

from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from avlmaps.core.wording import option
from avlmaps.serve.drive.agents import drive_agent_app
from avlmaps.serve.drive.app import DriveService, drive_app
from avlmaps.serve.drive.orders import Dispatcher
from avlmaps.serve.drive.plans import MapNow, OrderLog, default_log
from avlmaps.serve.drive.robots import open_machine
from avlmaps.serve.guard import App
from avlmaps.serve.service import Service
from avlmaps.serve.settings import ServeError

PATH = "/drive"


@dataclass(frozen=True, slots=True)
class Driving:
    """What a server of maps needs to drive as well.

    Attributes:
        robot: as people know it.
        log: file of the log.
        mounts: the applications by path.
        lifespans: what is open while the server runs.
        dispatcher: decides what moves.
        ending: is called when a signal ends the server; it stops the robot at once.
    """

    robot: str
    log: Path
    mounts: dict[str, App]
    lifespans: tuple[Callable[[], AbstractAsyncContextManager[Any]], ...]
    dispatcher: Dispatcher
    ending: Callable[[], None]


def open_driving(robot_file: Path, service: Service, log: Path | None = None) -> Driving:
    """Connect to a robot and return the driving server.

    Args:
        robot_file: ROBOT.json.
        service: the server of maps.
        log: file of the log; in the user's state folder if None.

    Raises:
        ServeError: a real robot would be driven without a token.
        NavigationError: the robot's file cannot be read, the robot cannot be reached or stopped, or the log cannot be
            written.
        RequestError: there is no such map.
    """
    machine = open_machine(robot_file)
    if machine.is_real and service.settings.token is None:
        raise ServeError(
            f"Driving a {machine.name} needs a token, also on this machine; give {option('token-file', 'FILE')} or set "
            "AVLMAPS_TOKEN."
        )

    def current() -> MapNow:
        served = service.shelf.get(machine.map)
        return MapNow(served.name, served.version, served.avlmap)

    current()
    path = default_log() if log is None else log
    dispatcher = Dispatcher(machine, current, OrderLog(path))
    dispatcher.connect()
    drive = DriveService(dispatcher)
    agents, running = drive_agent_app(drive)
    # `running` is inside: the tools end before the robot is stopped.
    return Driving(
        machine.name, path, {PATH: drive_app(drive, agents)}, (drive.lifespan, running), dispatcher, drive.end
    )
