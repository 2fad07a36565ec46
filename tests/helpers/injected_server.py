"""A driving server whose map has names that are injections."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import cv2
from starlette.testclient import TestClient

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service
from helpers.driven_server import Driven, driven
from helpers.injections import Campaign
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import CAMERA, write_walk


@contextmanager
def injected_server(folder: Path, service: Service | None = None) -> Iterator[tuple[Campaign, Driven]]:
    """Serve a small map with driving on, and a robot that counts what moves it.

    Args:
        folder: for the log, and the map where none is given.
        service: of a map that is there already; one is built otherwise.
    """
    opened = service or _built(folder)
    driving = driven(opened, folder / "orders.jsonl")
    name = opened.shelf.names[0]
    names: list[str] = []
    things, sounds, rooms = AVLMap.things, AVLMap.sounds, AVLMap.rooms

    def named(made: list[Any], **words: Any) -> list[Any]:
        return [replace(one, **words) for one in made] if names else made

    def rename(text: str) -> None:
        names[:] = [text]
        opened.shelf.get(name)._answers.clear()  # pyright: ignore[reportPrivateUsage]

    # The names of things, sounds and rooms come from the map's models: these speak as a poster would.
    with (
        patch.object(AVLMap, "things", lambda *a, **k: named(things(*a, **k), name=names[0] if names else "")),
        patch.object(AVLMap, "sounds", lambda *a, **k: [_kind(one, names) for one in sounds(*a, **k)]),
        patch.object(AVLMap, "rooms", lambda *a, **k: named(rooms(*a, **k), name=names[0] if names else "")),
        TestClient(
            create_app(opened, driving.mounts), base_url="http://127.0.0.1:8750", raise_server_exceptions=False
        ) as client,
    ):
        view = render(Room().scene, CAMERA, Room().walk()[100])
        photo = cv2.imencode(".png", cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR))[1].tobytes()
        try:
            yield Campaign(client, name, photo, rename), driving
        finally:  # other tests ask the same service
            names.clear()
            opened.shelf.get(name)._answers.clear()  # pyright: ignore[reportPrivateUsage]


def _kind(event: Any, names: list[str]) -> Any:
    return replace(event, names=(names[0],), confidences=(0.9,)) if names else event


def _built(folder: Path) -> Service:
    path = folder / "room.avlmap"
    settings = BuildSettings(voxel_size_m=0.1)
    build_map(open_recording(write_walk(folder / "rec")), path, "colours", settings, progress=False)
    return Service.open({"room": path})
