"""The things of a day, the changes since one and the sources of sounds, by the server and by the command line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from avlmaps.cli.things import Things
from avlmaps.core.errors import QueryError
from avlmaps.maps.sources.candidates import Spread
from avlmaps.maps.store.life import Life, Stay
from avlmaps.maps.store.manifest import Visit
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.changes import Days
from avlmaps.query.sound_sources import SoundSource
from avlmaps.serve.service import Service


@pytest.fixture
def client(room: Path, serving: Callable[..., TestClient]) -> TestClient:
    """A server that remembers no other test's answers."""
    return serving(Service.open({"room": room}))


@pytest.fixture
def two_days(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the map be of two days: a bag moved from one to the other."""
    info = AVLMap.open(room).data.info
    itself = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    visits = tuple(
        Visit(day=day, recording=info.recording, begin_s=0.0, end_s=1.0, shift_s=0.0, map_from_recording=itself,
              rig=info.rig, frames=9)
        for day in ("2026-11-23", "2026-11-25")
    )  # fmt: skip

    def bag(x: float, visit: int, **more: Any) -> Stay:
        return Stay(name="bag", confidence=0.8, position=(x, 0.0, 0.3), size=(0.3, 0.3, 0.3), color=(9, 9, 9),
                    first=visit, last=visit, last_seen_s=0.5, looked=1, **more)  # fmt: skip

    life = Life.of([bag(0.25, 0, gone=1, moved_to=1), bag(1.25, 1, appeared=True, moved_from=0)],
                   [np.zeros((2, 3), np.int32)] * 2)  # fmt: skip
    monkeypatch.setattr(Days, "of", lambda *_: Days(visits, life))


def listed(verb: Things) -> dict[str, Any]:
    return verb.answer(verb.opened())


@pytest.mark.usefixtures("two_days")
@pytest.mark.parametrize(("at", "x"), [("2026-11-23", 0.25), ("2026-11-24", 0.25), ("1", 0.25), ("2", 1.25)])
def test_the_things_of_a_day_are_one_answer_by_every_front(client: TestClient, room: Path, at: str, x: float) -> None:
    served = client.get("/maps/room/things", params={"at": at}).json()
    (thing,) = served["things"]
    assert thing["position"] == [x, 0.0, 0.3] and served["total"] == 1
    assert listed(Things(map=room, at=at))["things"] == served["things"]
    (near,) = client.get("/maps/room/things", params={"at": at, "near": f"{x},0,0"}).json()["things"]
    assert near["distance_m"] == 0.3
    assert not client.get("/maps/room/things", params={"at": at, "least": 0.9}).json()["things"]


@pytest.mark.usefixtures("two_days")
@pytest.mark.parametrize(
    ("at", "why"), [("3", "no visit 3"), ("monday", "'monday' is no day"), ("2026-11-22", "not seen up to 2026-11-22")]
)
def test_an_unknown_day_is_refused_with_one_sentence(client: TestClient, room: Path, at: str, why: str) -> None:
    for address, name in (("things", "at"), ("changes", "since")):
        refused = client.get(f"/maps/room/{address}", params={name: at})
        assert refused.status_code == 422 and why in refused.json()["error"]["message"]
    with pytest.raises(QueryError, match=why):
        listed(Things(map=room, at=at))


@pytest.mark.usefixtures("two_days")
def test_changes_are_those_of_the_verb(client: TestClient, room: Path) -> None:
    served = client.get("/maps/room/changes").json()
    assert [(one["kind"], one["from"], one["position"][0]) for one in served["changes"]] == [
        ("moved", [0.25, 0.0, 0.3], 1.25)
    ]
    assert served == {**AVLMap.open(room).changes(), "map": "room"}
    assert client.get("/maps/room/changes", params={"since": "2026-11-25"}).json()["changes"] == []


def test_sources_are_those_of_the_verb(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    refused = client.get("/maps/room/sources")
    assert refused.status_code == 422 and "does not know where sounds came from" in refused.json()["error"]["message"]
    asked: list[Any] = []
    source = SoundSource("dog bark", 0.9, 0.7, (1.0, 2.0, 0.5), 0.2, 0.6, 0.1, 0.4, (("kitchen", 0.8),),
                         (("dog", (1.0, 2.0, 0.4), 0.6),), (0,), False, 4, Spread(0.2, 0.6, 0.8))  # fmt: skip

    def sources(_: AVLMap, names: Any = (), **more: Any) -> list[SoundSource]:
        asked.append((list(names), more))
        return [source]

    monkeypatch.setattr(AVLMap, "sources", sources)
    words = {"sound": ["dog bark", "cat"], "prior": "none", "least": 0.5}
    assert client.get("/maps/room/sources", params=words).json()["sources"] == [source.to_json()]
    assert asked == [(["dog bark", "cat"], {"prior": False, "least": 0.5})]
    assert client.get("/maps/room/sources?prior=all").status_code == 400
