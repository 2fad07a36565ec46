"""An agent with 8,000 tokens: it reads the tools, and answers 30 questions about an office of 110 things."""

import json
import math
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcp.client.client import Client
from starlette.testclient import TestClient

from avlmaps.cli.things import Rooms, Things
from avlmaps.core.printable import shortened
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.agents import MOST_TOKENS, agent_server, fitting, token_count
from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service
from helpers.agent_talk import texts, told
from helpers.office import ROOM_M, ROOMS, names, office_of

BUDGET, MOST_OF_TOOLS = 8_000, 1_500
UPSTAIRS = {kind for kind, floor, *_ in ROOMS if floor == 1}


pytestmark = pytest.mark.nightly  # its office of 110 things takes a quarter of a minute


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return office_of(tmp_path_factory)


@pytest.fixture(scope="module")
def service(office: Path) -> Iterator[Service]:
    opened = Service.open({"office": office})
    yield opened
    opened.close()


class Agent:
    """Calls tools and counts every token that goes in or out: the tools, the questions, the calls, the answers."""

    def __init__(self, client: Client) -> None:
        self.client, self.spent, self.answers = client, 0, []

    async def begin(self) -> None:
        tools = (await self.client.list_tools()).tools
        self.spent += token_count(plain([tool.model_dump(exclude_none=True, by_alias=True) for tool in tools]))
        self.spent += token_count(self.client.instructions or "")

    async def call(self, tool: str, **arguments: Any) -> Any:
        result = await self.client.call_tool(tool, arguments)
        assert len(result.content) == 1, "no picture that nobody wants"
        assert result.structured_content is None, "the text is not repeated"
        (text,) = texts(result)
        assert token_count(text) <= MOST_TOKENS
        self.spent += token_count(plain([tool, arguments])) + token_count(text)
        return text if result.is_error else json.loads(text)


def plain(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"))


def of_kind(kind: str) -> Counter[str]:
    """Return what truly stands in the rooms of a kind."""
    return sum((Counter(things) for name, *_, things in ROOMS if name == kind), Counter[str]())


def column_of(position: list[float]) -> int:
    return int(position[0] // ROOM_M)


# Each question, the calls that a sensible agent makes, and whether what they say is true.
Told = list[Any]
QUESTIONS: list[tuple[str, list[tuple[str, dict[str, Any]]], Callable[[Told], bool]]] = [
    ("How many floors are there?", [("describe_map", {})], lambda a: len(a[0]["floors"]) == 2),
    ("How many things?", [], lambda a: a[0]["things"] == 110),
    ("How many offices?", [], lambda a: sum(f["rooms"].get("office", 0) for f in a[0]["floors"]) == 3),
    ("How many rooms are on the lowest floor?", [], lambda a: sum(a[0]["floors"][0]["rooms"].values()) == 4),
    ("How many monitors?", [], lambda a: a[0]["names"]["monitor"] == 12),
    ("Which rooms are upstairs?", [("list_rooms", {"floor": 1})],
     lambda a: {room["name"] for room in a[-1]["rooms"]} == UPSTAIRS),
    ("Which room has most things?", [("list_rooms", {})],
     lambda a: max(a[-1]["rooms"], key=lambda room: room["things"])["room"] == "living room"),
    ("How many things are in the kitchen?", [("list_things", {"room": "kitchen", "top": 1})],
     lambda a: a[-1]["total"] == sum(of_kind("kitchen").values())),
    ("Where is the refrigerator?", [("list_things", {"name": "refrigerator", "top": 1})],
     lambda a: column_of(a[-1]["things"][0]["position"]) == 2),
    ("In which room is the stove?", [("list_things", {"name": "stove", "top": 1})],
     lambda a: a[-1]["things"][0]["room"] == "kitchen"),
    ("How many chairs are in the meeting room?", [("list_things", {"room": "meeting room", "name": "chair", "top": 1})],
     lambda a: a[-1]["total"] == 10),
    ("How many desks are in the office upstairs?", [("list_things", {"room": "office 3", "name": "desk", "top": 1})],
     lambda a: a[-1]["total"] == 4),
    ("How many desks are in all offices?", [("list_things", {"room": "office", "name": "desk", "top": 1})],
     lambda a: a[-1]["total"] == of_kind("office")["desk"]),
    ("Is there a bed?", [("list_things", {"name": "bed", "top": 1})], lambda a: a[-1]["total"] == 0),
    ("Is there a labtop?", [("list_things", {"name": "labtop", "top": 1})],
     lambda a: a[-1]["total"] == 0 and "laptop" in a[-1]["note"]),
    ("How many sinks are in the bathroom?", [("list_things", {"room": "bathroom", "name": "sink", "top": 1})],
     lambda a: a[-1]["total"] == 3),
    ("What is next to the refrigerator?", [("list_things", {"room": "kitchen", "near": "refrigerator", "top": 1})],
     lambda a: a[-1]["things"][0]["name"] in ("stove", "dining table") and a[-1]["things"][0]["distance_m"] < 1.2),
    ("What is nearest to the lowest corner?", [("list_things", {"near": "0,0,0", "top": 1})],
     lambda a: a[-1]["things"][0]["name"] == "desk"),
    ("How many sofas?", [("list_things", {"name": "sofa", "top": 1})], lambda a: a[-1]["total"] == 4),
    ("How wide is a sofa?", [], lambda a: 0.5 <= max(a[-1]["things"][0]["size"][:2]) <= 0.9),
    ("Which rooms have a tv?", [("list_things", {"name": "tv", "top": 3})],
     lambda a: {one["room"] for one in a[-1]["things"]} == {"meeting room", "living room"}),
    ("Where is a whiteboard?", [("ask", {"sentence": "the whiteboard", "top": 1})],
     lambda a: a[-1]["found"] and column_of(a[-1]["goals"][0]["position"]) == 1),
    ("Is there a sink in the kitchen?", [("ask", {"object": "sink", "area": "kitchen", "top": 1})],
     lambda a: a[-1]["found"] and column_of(a[-1]["goals"][0]["position"]) == 2),
    ("How many toilets?", [("ask", {"sentence": "how many toilets are there", "top": 1})],
     lambda a: a[-1]["count"] == 2),
    ("When was a toilet seen last?", [("last_seen", {"thing": "toilet", "top": 1})],
     lambda a: a[-1]["found"] and a[-1]["places"][0]["last_seen_s"] == 3),
    ("What was heard, and when?", [("list_sounds", {})],
     lambda a: a[-1]["total"] == 1 and abs(a[-1]["sounds"][0]["onset_s"] - 2.0) < 0.3),
    ("Where are plants 6 to 10?", [("list_things", {"name": "plant", "top": 5, "page": 2})],
     lambda a: a[-1]["total"] == 12 and len(a[-1]["things"]) == 5 and a[-1]["pages"] == 3),
    ("What is in the bathroom?", [("list_things", {"room": "bathroom"})],
     lambda a: Counter(one["name"] for one in a[-1]["things"]) == of_kind("bathroom")),
    ("How many lamps are in the living room?",
     [("list_things", {"rooms": "living room"}), ("list_things", {"room": "living room", "name": "lamp", "top": 1})],
     lambda a: "did you mean room?" in a[-2] and "near (string)" in a[-2] and a[-1]["total"] == 6),
    ("What is in the sauna?", [("list_things", {"room": "sauna"})],
     lambda a: "no room 'sauna'" in a[-1] and "meeting room" in a[-1]),
]  # fmt: skip


def test_an_agent_with_8000_tokens_answers_30_questions(service: Service) -> None:
    assert len(names()) == 110 and len(QUESTIONS) == 30

    async def main() -> tuple[list[str], int]:
        async with Client(agent_server(service)) as client:
            agent, wrong = Agent(client), []
            await agent.begin()
            assert agent.spent <= MOST_OF_TOOLS + 200
            for question, calls, is_true in QUESTIONS:
                agent.spent += token_count(question)
                for tool, arguments in calls:
                    agent.answers.append(await agent.call(tool, **arguments))
                refused = isinstance(agent.answers[-1], str) and "There is no room" not in agent.answers[-1]
                if refused or not is_true(agent.answers):
                    wrong.append(f"{question} {agent.answers[-1]}")
            return wrong, agent.spent

    wrong, spent = anyio.run(main)
    assert wrong == []
    assert spent <= BUDGET


def test_the_tools_are_described_in_1500_tokens_and_default_answers_in_800(service: Service, office: Path) -> None:
    at = AVLMap.open(office).things(["refrigerator"])[0].position
    place = ",".join(str(value) for value in at)

    async def main() -> tuple[int, dict[str, int]]:
        async with Client(agent_server(service)) as client:
            tools = (await client.list_tools()).tools
            described = plain([tool.model_dump(exclude_none=True, by_alias=True) for tool in tools])
            calls: dict[str, dict[str, Any]] = {
                "describe_map": {}, "list_rooms": {}, "list_things": {}, "list_sounds": {},
                "ask": {"sentence": "a chair near a desk in the office"},
                "describe_place": {"x": at[0], "y": at[1], "z": at[2]}, "last_seen": {"thing": "chair"},
                "goal_near": {"sentence": "a chair", "near": place},
            }  # fmt: skip
            sizes = {}
            for tool, arguments in calls.items():
                result = await client.call_tool(tool, arguments)
                assert not result.is_error, (tool, result.content)
                sizes[tool] = sum(map(token_count, texts(result)))
            return token_count(described), sizes

    tools, sizes = anyio.run(main)
    assert tools <= MOST_OF_TOOLS
    assert max(sizes.values()) <= MOST_TOKENS, sizes


def test_every_thing_is_on_exactly_one_page(service: Service) -> None:
    async def main() -> list[list[float]]:
        async with Client(agent_server(service)) as client:
            first = told(await client.call_tool("list_things", {"top": 7}))
            pages = [
                told(await client.call_tool("list_things", {"top": 7, "page": page}))
                for page in range(1, first["pages"] + 1)
            ]
            beyond = await client.call_tool("list_things", {"top": 7, "page": first["pages"] + 1})
            assert beyond.is_error and "There is no page 17" in texts(beyond)[0]
            return [one["position"] for page in pages for one in page["things"]]

    places = anyio.run(main)
    assert len(places) == 110
    assert len({tuple(place) for place in places}) == 110


def test_things_near_a_place_come_by_distance(service: Service) -> None:
    async def main(near: Any) -> Any:
        async with Client(agent_server(service)) as client:
            return told(await client.call_tool("list_things", {"near": near}))

    for near in ([6.0, 2.0, 0.5], "6,2,0.5"):
        things = anyio.run(main, near)["things"]
        away = [one["distance_m"] for one in things]
        assert away == sorted(away)
        assert away == pytest.approx([math.dist(one["position"], [6.0, 2.0, 0.5]) for one in things], abs=0.02)


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


def test_a_program_lists_the_things_of_a_room_near_a_place_by_pages(service: Service) -> None:
    with TestClient(create_app(service), base_url="http://127.0.0.1:8750") as client:

        def listed(**query: Any) -> Any:
            answer = client.get("/maps/office/things", params=query)
            assert answer.status_code == 200, answer.text
            return answer.json()

        everything = listed()["things"]
        kitchen = listed(room="kitchen")
        assert Counter(thing["name"] for thing in kitchen["things"]) == of_kind("kitchen")
        assert kitchen["total"] == len(kitchen["things"])
        pages = [listed(top=25, page=page)["things"] for page in range(1, 6)]
        assert [thing for page in pages for thing in page] == everything
        place = everything[0]["position"]
        near = listed(near=",".join(map(str, place)), top=5)["things"]
        away = sorted(math.dist(thing["position"], place) for thing in everything)
        assert [thing["distance_m"] for thing in near] == pytest.approx(away[:5], abs=1e-3)
        named = listed(near=everything[0]["name"], name=[everything[0]["name"]])
        assert named["near"]["name"] == everything[0]["name"]
        assert named["near"]["position"] not in [thing["position"] for thing in named["things"]]
        for query, status in (
            ({"room": "ballroom"}, 422),
            ({"near": "1,x"}, 422),
            ({"page": 99}, 422),
            ({"top": 0}, 400),
        ):
            refused = client.get("/maps/office/things", params=query)
            assert refused.status_code == status, refused.text


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"room": "kitchen"},
        {"room": "kitchen", "name": ["chair"], "least": 0.3},
        {"top": 7, "page": 2},
        {"near": "1.0,2.0,0.5", "top": 3},
        {"near": "1.0,2.0"},
        {"near": "chair", "structure": True},
    ],
)
def test_the_command_line_lists_what_the_server_lists(service: Service, options: dict[str, Any]) -> None:
    avlmap = service.shelf.get("office").avlmap
    things = Things(map=Path("office"), **options | {"name": tuple(options.get("name", ()))})
    said = shortened(things.answer(avlmap))
    lines = things.lines(said)
    with TestClient(create_app(service), base_url="http://127.0.0.1:8750") as client:
        served = client.get("/maps/office/things", params=options).json()
        rooms = client.get("/maps/office/rooms").json()
    assert {key: said[key] for key in served} == served
    assert all(thing["name"] in line for thing, line in zip(said["things"], lines[1:], strict=False))
    assert shortened(Rooms(map=Path("office")).answer(avlmap)) == rooms
    named = {room["room"] for room in rooms["rooms"]}
    assert len(named) == len(rooms["rooms"]) and {one.get("room") for one in served["things"]} <= named | {None}
