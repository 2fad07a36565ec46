"""Agents' side: what an agent reads, calls and is refused; sloppy calls are taken as they are meant."""

import asyncio
import base64
import itertools
import json
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.agents import MOST_TOKENS, agent_server, fitting, token_count
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.requests import file_of
from avlmaps.serve.service import Service
from helpers.agent_talk import Agent
from helpers.office import ROOM_M, ROOMS, names, office_of

_NEVER_ASKED = itertools.count()
BUDGET, MOST_OF_TOOLS = 8_000, 1_500
TOOLS = ["describe_map", "list_rooms", "list_things", "list_sounds", "ask", "locate_photo", "describe_place",
         "last_seen", "goal_near"]  # fmt: skip


@pytest.fixture(scope="module")
def agent(service: Service) -> Agent:
    return Agent(agent_server(service))


@pytest.fixture(scope="module")
def calls(room: Path, walk: Path) -> dict[str, dict[str, Any]]:
    photo = sorted((walk / "rgb").iterdir())[5].read_bytes()
    camera = AVLMap.open(room).data.keyframes.world_from_camera[0][:3, 3]
    return {
        "describe_map": {}, "list_things": {"least": 0.2}, "list_sounds": {}, "list_rooms": {},
        "ask": {"sentence": "the red thing"}, "locate_photo": {"photo": base64.b64encode(photo).decode()},
        "describe_place": {"x": float(camera[0]), "y": float(camera[1])}, "last_seen": {"thing": "red thing"},
        "goal_near": {"sentence": "the red thing", "near": ",".join(str(float(value)) for value in camera)},
    }  # fmt: skip


def test_a_conversation_begins_in_every_revision_of_the_protocol(agent: Agent) -> None:
    for asked, said in (("2025-06-18", "2025-06-18"), ("2030-01-01", "2025-11-25")):
        begun = agent.ask("initialize", protocolVersion=asked, capabilities={}, clientInfo={})
        assert begun["protocolVersion"] == said and begun["capabilities"].keys() == {"tools", "prompts", "resources"}
    found = agent.ask("server/discover")
    assert "2026-07-28" in found["supportedVersions"] and "never follow them" in found["instructions"]
    assert agent.ask("ping") == {} and agent.ask("nothing/there")["code"] == -32601
    for wrong, code in (([], -32600), ({"id": 1}, -32600), ({"id": 1, "method": "ping", "params": 3}, -32602)):
        assert asyncio.run(agent.server.answer(wrong))["error"]["code"] == code
    assert asyncio.run(agent.server.answer({"method": "notifications/initialized"})) is None


def test_every_tool_reads_only_and_has_a_schema(agent: Agent) -> None:
    assert list(agent.tools) == TOOLS
    for tool in agent.tools.values():
        assert tool["annotations"] == {"readOnlyHint": True, "destructiveHint": False}
        assert tool.keys() == {"name", "description", "inputSchema", "annotations"}, "an agent reads them all"
        Draft202012Validator.check_schema(tool["inputSchema"])
        assert tool["inputSchema"]["properties"]["map"]["enum"] == ["room"]


def test_every_tool_answers_with_a_small_picture_where_one_is_wanted(agent: Agent, calls: Any) -> None:
    for name, arguments in calls.items():
        Draft202012Validator(agent.tools[name]["inputSchema"]).validate(arguments)
        answer, picture = agent.drawn(name, **arguments)
        assert agent.call(name, **arguments).keys() == answer.keys(), name
        decoded = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        assert decoded is not None and max(decoded.shape) <= 480


def test_answers_are_those_of_the_package_in_few_digits(agent: Agent, room: Path, calls: Any) -> None:
    opened = AVLMap.open(room)
    goals = agent.call("ask", sentence="the red thing", top=2)["goals"]
    expected = opened.ask("the red thing", top=2).goals
    assert [goal["position"] for goal in goals] == [pytest.approx(one.position, abs=0.006) for one in expected]
    stamps = np.asarray(opened.data.voxels.last_seen_s)
    seen = [place["last_seen_s"] for place in agent.call("last_seen", thing="red thing")["places"]]
    assert seen and stamps.min() - 0.01 <= min(seen) and max(seen) <= stamps.max() + 0.01
    near = agent.call("goal_near", **calls["goal_near"])["goals"]
    lengths = [goal["path_m"] for goal in near if goal["reachable"]]
    assert lengths == sorted(lengths)


def test_sloppy_arguments_are_taken_as_they_are_meant(agent: Agent, calls: Any) -> None:
    photo = calls["locate_photo"]["photo"]
    broken = "\r\n".join(photo[at : at + 76] for at in range(0, len(photo), 76))
    alike: dict[str, tuple[dict[str, Any], ...]] = {
        "ask": (
            {"sentence": "the red thing", "top": 2},
            {"sentence": "the red thing", "top": "2", "object": "", "primary": "", "near": None, "picture": "false"},
        ),
        "list_things": ({"name": ["red"], "near": "1,2,0.5"}, {"name": "red", "near": [1, 2, 0.5], "page": 1.0},
                        {"name": '["red"]', "near": "[1, 2, 0.5]"}, {"name": "red", "near": ["1", " 2", "0.5"]},
                        {"name": "red", "near": {"x": 1, "y": 2, "z": 0.5}}),
        "locate_photo": (
            {"photo": photo}, {"photo": broken, "intrinsics": ""}, {"photo": f"data:image/png;base64,{broken}"},
            {"photo": photo.replace("+", "-").replace("/", "_").rstrip("=")},
        ),
        "describe_place": ({"x": 4.0, "y": 3.0}, {"x": "4.0", "y": "3", "z": ""}),
    }  # fmt: skip
    for tool, ways in alike.items():
        answers = [agent.call(tool, **way) for way in ways]
        assert all(one == answers[0] for one in answers), tool


@pytest.mark.parametrize("address", ["{}", "file://{}", "file://localhost{}"])
def test_a_file_on_this_machine_is_named_by_its_path_or_its_url(tmp_path: Path, address: str) -> None:
    (tmp_path / "a photo.png").write_bytes(b"bytes")
    named = address.format(quote(str(tmp_path / "a photo.png")) if "file:" in address else tmp_path / "a photo.png")
    assert file_of(named, "photo", 1000, reads_files=True) == b"bytes"
    with pytest.raises(RequestError, match="base64"):
        file_of(named, "photo", 1000)


@pytest.mark.parametrize(
    ("tool", "arguments", "says"),
    [
        ("ask", {"sentence": "why"}, "ask it like"),
        ("ask", {}, "sentence"),
        ("ask", {"sentence": "the red thing", "top": 0}, "top (integer 1 to 100)"),
        ("ask", {"sentense": "the red thing"}, "did you mean sentence?"),
        ("list_things", {"least": 2.0}, "least (number 0 to 1)"),
        ("list_things", {"page": 9}, "no page 9"),
        ("list_things", {"near": "a unicorn"}, "no 'a unicorn'"),
        ("list_rooms", {"floor": 7}, "no floor 7"),
        ("ask", {"sentence": "the red thing", "image": "/etc/passwd"}, "image"),
        ("ask", {"sentence": "the red thing", "map": "nope"}, "no map"),
        ("locate_photo", {"photo": "/etc/passwd"}, "base64"),
        ("locate_photo", {"photo": "aGVsbG8="}, "PNG"),
        ("locate_photo", {}, "photo"),
        ("locate_photo", {"path": "/tmp/x.png"}, "photo (file)"),
        ("describe_place", {"x": 1.0}, "y"),
        ("goal_near", {"sentence": "the red thing", "near": "here"}, "x,y"),
    ],
)
def test_a_wrong_call_is_an_error_that_says_what_to_do(
    agent: Agent, room: Path, tool: str, arguments: dict[str, Any], says: str
) -> None:
    refused = agent.refused(tool, **arguments)
    assert says in refused and str(room.parent) not in refused


def test_resources_summarise_the_maps_and_prompts_take_words_as_data(agent: Agent, room: Path) -> None:
    listed = [one["uri"] for one in agent.ask("resources/list")["resources"]]
    maps, summary = (json.loads(agent.ask("resources/read", uri=uri)["contents"][0]["text"]) for uri in listed)
    assert (maps["maps"][0]["name"], summary["path"]) == ("room", "room")
    assert summary["voxels"] == maps["maps"][0]["voxels"] and str(room.parent) not in json.dumps([maps, summary])
    given = {"thing": "the {thing} of {errand}", "errand": "the {thing} of {errand}"}
    prompts = [one["name"] for one in agent.ask("prompts/list")["prompts"]]
    find, tour, errand = (agent.ask("prompts/get", name=name, arguments=given)["messages"][0] for name in prompts)
    assert all("the {thing} of {errand}" in one["content"]["text"] for one in (find, errand))
    assert "list_rooms" in tour["content"]["text"]
    for wrong in (agent.ask("prompts/get", name="find"), agent.ask("prompts/get", name="x"),
                  agent.ask("resources/read", uri="x"), agent.ask("tools/call", name="drive")):  # fmt: skip
        assert wrong["code"] == -32602


def test_progress_reaches_a_client_that_wants_it(agent: Agent) -> None:
    steps: list[Any] = []
    call = {"name": "list_things", "arguments": {"least": 0.4 + next(_NEVER_ASKED) / 1000.0}}
    agent.ask("tools/call", steps.append, **call, _meta={"progressToken": 7})
    assert [one["params"]["progress"] for one in steps] == list(range(1, len(steps) + 1))
    assert (steps[0]["params"]["message"], steps[0]["params"]["progressToken"]) == ("started", 7)


def test_two_maps_must_be_named(room: Path) -> None:
    service = Service.open({"one": room, "two": room})
    agent = Agent(agent_server(service))
    assert all("map" in tool["inputSchema"]["required"] for tool in agent.tools.values())
    assert "one, two" in agent.refused("list_sounds")
    assert agent.call("list_sounds", map="two")["map"] == "two"
    service.close()


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Agent]:
    service = Service.open({"office": office_of(tmp_path_factory)})
    yield Agent(agent_server(service))
    service.close()


def of_kind(kind: str) -> Counter[str]:
    """Return what truly stands in the rooms of a kind."""
    return sum((Counter(things) for name, *_, things in ROOMS if name == kind), Counter[str]())


def column_of(position: list[float]) -> int:
    return int(position[0] // ROOM_M)


UPSTAIRS = {kind for kind, floor, *_ in ROOMS if floor == 1}
# Each question, the call that a sensible agent makes, and whether what it says is true.
QUESTIONS: list[tuple[str, str, dict[str, Any], Callable[[Any], bool]]] = [
    ("How many floors, things, offices, monitors?", "describe_map", {}, lambda a: (
        len(a["floors"]), a["things"], sum(f["rooms"].get("office", 0) for f in a["floors"]), a["names"]["monitor"],
        sum(a["floors"][0]["rooms"].values())) == (2, 110, 3, 12, 4)),
    ("Which rooms are upstairs?", "list_rooms", {"floor": 1},
     lambda a: {room["name"] for room in a["rooms"]} == UPSTAIRS),
    ("How many things are in the kitchen?", "list_things", {"room": "kitchen", "top": 1},
     lambda a: a["total"] == sum(of_kind("kitchen").values())),
    ("Where is the refrigerator?", "list_things", {"name": "refrigerator", "top": 1},
     lambda a: column_of(a["things"][0]["position"]) == 2),
    ("How many chairs are in the meeting room?", "list_things", {"room": "meeting room", "name": "chair", "top": 1},
     lambda a: a["total"] == 10),
    ("Is there a labtop?", "list_things", {"name": "labtop", "top": 1},
     lambda a: a["total"] == 0 and "laptop" in a["note"]),
    ("What is next to the refrigerator?", "list_things", {"room": "kitchen", "near": "refrigerator", "top": 1},
     lambda a: a["things"][0]["name"] in ("stove", "dining table") and a["things"][0]["distance_m"] < 1.2),
    ("Which rooms have a tv?", "list_things", {"name": "tv", "top": 3},
     lambda a: {one["room"] for one in a["things"]} == {"meeting room", "living room"}),
    ("Is there a sink in the kitchen?", "ask", {"object": "sink", "area": "kitchen", "top": 1},
     lambda a: a["found"] and column_of(a["goals"][0]["position"]) == 2),
    ("How many toilets?", "ask", {"sentence": "how many toilets are there", "top": 1}, lambda a: a["count"] == 2),
    ("When was a toilet seen last?", "last_seen", {"thing": "toilet", "top": 1},
     lambda a: a["found"] and a["places"][0]["last_seen_s"] == 3),
    ("What was heard, and when?", "list_sounds", {},
     lambda a: a["total"] == 1 and abs(a["sounds"][0]["onset_s"] - 2.0) < 0.3),
    ("Where are plants 6 to 10?", "list_things", {"name": "plant", "top": 5, "page": 2},
     lambda a: a["total"] == 12 and len(a["things"]) == 5 and a["pages"] == 3),
]  # fmt: skip


@pytest.mark.nightly  # its office of 110 things takes a quarter of a minute
def test_an_agent_with_8000_tokens_answers_questions_about_an_office(office: Agent) -> None:
    assert len(names()) == 110
    read = json.dumps(list(office.tools.values()), separators=(",", ":"))
    assert token_count(read) <= MOST_OF_TOOLS
    spent, wrong = token_count(read) + token_count(office.server.instructions), []
    for question, tool, arguments, is_true in QUESTIONS:
        text = office.text(tool, **arguments)
        assert token_count(text) <= MOST_TOKENS
        spent += sum(map(token_count, (question, tool, json.dumps(arguments), text)))
        if not is_true(json.loads(text)):
            wrong.append(f"{question} {text}")
    assert not wrong and spent <= BUDGET
    assert "did you mean room?" in office.refused("list_things", rooms="living room")
    assert "no room 'sauna'" in office.refused("list_things", room="sauna")


_TEXTS = st.text("abc 19", max_size=400)
_ROWS = st.lists(
    st.fixed_dictionaries({"name": _TEXTS, "position": st.lists(st.floats(-9, 9), max_size=3)}), max_size=40
)


@given(
    st.fixed_dictionaries({"rows": _ROWS, "text": _TEXTS, "last": st.fixed_dictionaries({"lines": st.lists(_TEXTS)})}),
    st.integers(2, 400),
)
def test_any_answer_fits_and_says_what_it_lacks(answer: dict[str, Any], places: int) -> None:
    path = [[float(at), 0.5, 0.25] for at in range(places)]
    whole = {**answer, "path": path}
    cut = fitting(whole, 200)
    assert token_count(json.dumps(cut, separators=(",", ":"))) <= 200
    assert cut["path"][0] == path[0] and cut["path"][-1] == path[-1]
    gone = cut.get("left_out", {})
    assert all(len(whole[key]) == len(cut[key]) + gone.get(key, 0) for key in ("rows", "path"))
    assert whole["path"] == path, "the answer itself stays as it was"
