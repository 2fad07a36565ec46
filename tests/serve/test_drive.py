"""The driving server: plan, confirm, stop, status; one order at a time, each logged, none without its token."""

import json
import threading
from collections.abc import Iterator
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator, ValidationError
from starlette.testclient import TestClient

from avlmaps.serve.agents import MOST_TOKENS, token_count
from avlmaps.serve.app import create_app
from avlmaps.serve.drive.orders import OrderPlan, PlanBook, Who
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.service import Service
from avlmaps.serve.settings import ServeSettings
from helpers.driven_server import START, Driven, driven

BASE = "http://127.0.0.1:8750"


@pytest.fixture
def drive(service: Service, tmp_path: Path) -> Driven:
    return driven(service, tmp_path / "orders.jsonl")


@pytest.fixture
def client(service: Service, drive: Driven) -> Iterator[TestClient]:
    with TestClient(create_app(service, drive.mounts), base_url=BASE) as opened:
        yield opened


def plan(client: TestClient, words: str) -> dict[str, Any]:
    answer = client.post("/drive/plan", json={"words": words})
    assert answer.status_code == 200, answer.text
    return answer.json()


def until(condition: Any, within_s: float = 30.0) -> None:
    end = monotonic() + within_s
    while not condition():
        assert monotonic() < end, "it did not come"
        sleep(0.01)


def idle(client: TestClient) -> dict[str, Any]:
    until(lambda: client.get("/drive/status").json()["state"] == "idle")
    return client.get("/drive/status").json()


def test_a_command_is_planned_confirmed_driven_and_logged(client: TestClient, drive: Driven) -> None:
    told = plan(client, "go to the nearest red thing, then turn left")
    assert told["reading"] == "I will go to the nearest red thing, then turn left 90 degrees."
    assert told["program"].splitlines()[-1] == "robot.turn(-90)"
    assert len(told["path"]) > 5 and told["path_m"] > 0.5
    assert told["path"][0][:2] == pytest.approx([START.x_m, START.y_m], abs=0.01)
    assert told["subgoals"][0]["reached"] is True
    assert told["frame"] == "recording"
    assert drive.machine.motions == 0, "a plan moves nothing"
    started = client.post("/drive/confirm", json={"token": told["token"]})
    assert started.status_code == 202
    assert started.json()["order"] == told["order"]
    last = idle(client)["last"]
    assert last["outcome"]["ok"] is True and last["stopped"] is False
    assert drive.machine.body.told[0] == "go_to" and drive.machine.body.told[1].startswith("turn")
    assert drive.events == ["planned", "confirmed", "ended"]
    for entry in drive.entries:
        assert {"time", "who"} <= entry.keys() and entry["words"] == "go to the nearest red thing, then turn left"
    assert told["token"] not in drive.log.read_text(encoding="utf-8"), "a log that is read confirms nothing"


def test_the_openapi_document_describes_what_the_addresses_answer(client: TestClient, drive: Driven) -> None:
    document = client.get("/openapi.json").json()
    assert {path for path in document["paths"] if path.startswith("/drive/")} == {
        f"/drive/{name}" for name in ("plan", "confirm", "stop", "status")
    }

    def conforms(response: Any, path: str, method: str = "post") -> Any:
        described = document["paths"][f"/drive/{path}"][method]["responses"][str(response.status_code)]
        schema = described["content"]["application/json"]["schema"]
        validator = Draft202012Validator({**schema, "components": document["components"]})
        validator.validate(response.json())
        with pytest.raises(ValidationError):
            validator.validate([])
        return response.json()

    token = conforms(client.post("/drive/plan", json={"words": "turn left"}), "plan")["token"]
    conforms(client.post("/drive/plan", json={"words": "go to the frobnicator"}), "plan")
    conforms(client.post("/drive/plan", json={"wrods": "turn left"}), "plan")
    conforms(client.get("/drive/status"), "status", "get")
    conforms(client.post("/drive/confirm", json={"token": "none"}), "confirm")
    drive.machine.body.let_go.clear()
    conforms(client.post("/drive/confirm", json={"token": token}), "confirm")
    conforms(client.get("/drive/status"), "status", "get")
    conforms(client.post("/drive/stop"), "stop")
    conforms(client.get("/drive/status"), "status", "get")


def test_an_agents_program_is_short_enough_to_be_shown(client: TestClient, drive: Driven) -> None:
    long = "robot.turn_left(90)\n" * 400
    result = call(client, "/drive/mcp", "tools/call", name="plan_drive", arguments={"program": long})
    assert result["isError"] is True
    assert "plan it in parts" in result["content"][0]["text"]


def test_a_stop_is_accepted_with_a_body_of_any_size(client: TestClient, drive: Driven) -> None:
    for size in ("40000000", "9" * 30):
        answer = client.post("/drive/stop", content=b"x", headers={"content-length": size})
        assert answer.status_code == 200 and answer.json()["stopped"] is True
    assert client.post("/drive/plan", content=b"x", headers={"content-length": "9" * 30}).status_code == 413


def test_a_program_is_planned_as_well(client: TestClient, drive: Driven) -> None:
    answer = client.post("/drive/plan", json={"program": "for i in range(2):\n    robot.turn(45)\n"}).json()
    assert answer["reading"] == "I will run the program: turn, then turn."
    assert client.post("/drive/confirm", json={"token": answer["token"]}).status_code == 202
    idle(client)
    assert drive.machine.motions == 2


@pytest.mark.parametrize(
    ("body", "status", "kind"),
    [
        ({"words": "gabble gabble the"}, 422, "unclear"),
        ({"words": "kill the cat"}, 422, "unclear"),
        ({"words": ""}, 400, "usage"),
        ({"words": "turn left", "program": "robot.turn(5)"}, 400, "usage"),
        ({"words": "go to the purple elephant near the sound of thunder"}, 422, "goal-not-found"),
        ({"program": "import os"}, 422, "program"),
        ({"program": "robot.load_image('/etc/passwd')"}, 422, None),
        ({"velocity": [0.5, 0.1]}, 400, "usage"),
        ({"words": "turn left", "speed_m_s": 1.0}, 400, "usage"),
        ({"words": "x" * 5000}, 400, "usage"),
        ([], 400, "usage"),
        (None, 400, "usage"),
    ],
)
def test_what_has_no_plan_has_no_token(client: TestClient, drive: Driven, body: Any, status: int, kind: str) -> None:
    answer = client.post("/drive/plan", json=body)
    assert answer.status_code == status, answer.text
    said = answer.json()
    assert said.keys() == {"error"}
    assert kind is None or said["error"]["kind"] == kind
    assert "token" not in said["error"]
    assert client.get("/drive/status").json()["plans_waiting"] == 0
    assert drive.machine.motions == 0


def test_a_token_is_good_once_and_for_a_short_time(client: TestClient, drive: Driven) -> None:
    told = plan(client, "turn left")
    assert told["expires_in_s"] == 60.0
    for wrong in ("", "x", told["token"][:-1], told["order"], 7, None):
        assert client.post("/drive/confirm", json={"token": wrong}).status_code in (400, 403)
    drive.now_s[0] += 61.0
    assert client.post("/drive/confirm", json={"token": told["token"]}).status_code == 410
    drive.now_s[0] = 0.0
    assert client.post("/drive/confirm", json={"token": told["token"]}).status_code == 403, "it is gone"
    assert drive.machine.motions == 0
    token = plan(client, "turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202
    idle(client)
    assert client.post("/drive/confirm", json={"token": token}).status_code == 403
    assert drive.machine.motions == 1


def test_a_token_is_bound_to_its_map_its_robot_and_where_the_robot_stands(
    client: TestClient, drive: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    moved = plan(client, "turn left")["token"]
    drive.machine.body.pose = START.ahead(2.0)
    assert client.post("/drive/confirm", json={"token": moved}).json()["error"]["kind"] == "moved"
    drive.machine.body.pose = START
    robot = plan(client, "turn left")["token"]
    drive.machine.identity = "another"
    assert client.post("/drive/confirm", json={"token": robot}).json()["error"]["kind"] == "robot-changed"
    replaced = plan(client, "turn left")["token"]
    from avlmaps.serve.shelf import ServedMap

    monkeypatch.setattr(ServedMap, "version", property(lambda self: "another"))
    assert client.post("/drive/confirm", json={"token": replaced}).json()["error"]["kind"] == "map-changed"
    assert drive.machine.motions == 0


def test_one_order_at_a_time_and_a_stop_at_any_time(client: TestClient, drive: Driven) -> None:
    drive.machine.body.let_go.clear()
    first, second = plan(client, "turn left")["token"], plan(client, "turn right")["token"]
    assert client.post("/drive/confirm", json={"token": first}).status_code == 202
    for answer in (
        client.post("/drive/confirm", json={"token": second}),
        client.post("/drive/plan", json={"words": "turn right"}),
    ):
        assert answer.status_code == 409
        assert "another order" in answer.json()["error"]["message"]
    assert client.get("/drive/status").json()["state"] == "driving"
    stopped = client.post("/drive/stop", content=b"\xff{nonsense", headers={"content-type": "x/y"})
    assert stopped.status_code == 200 and stopped.json()["stopped"] is True
    status = client.get("/drive/status").json()
    assert status["state"] == "idle" and status["last"]["stopped"] is True
    assert drive.machine.motions == 0
    assert client.post("/drive/confirm", json={"token": second}).status_code == 403, "a stop forgets every plan"
    assert "stop" in drive.events


def test_an_area_that_is_forbidden_while_it_drives_stops_the_robot(
    client: TestClient, drive: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    areas = [""]
    monkeypatch.setattr("avlmaps.navigate.brake.stamp", lambda path: areas[-1])
    monkeypatch.setattr("avlmaps.navigate.brake.Brake._forbidden", lambda brake: areas[-1])
    token = plan(client, "wait 500 seconds, then turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202
    sleep(0.1)
    assert client.get("/drive/status").json()["state"] == "driving", "another edit stops nothing"
    areas.append("the wet floor")
    last = idle(client)["last"]
    assert last["stopped"] is True and last["outcome"]["ok"] is False
    assert drive.machine.motions == 0 and drive.machine.stops == 1 and "stop" in drive.events
    assert last["note"] == "the wet floor was forbidden meanwhile, so that the robot was stopped (plan again)"


def test_a_robot_that_is_not_seen_to_stand_takes_no_order_until_it_is(client: TestClient, drive: Driven) -> None:
    drive.machine.stands = False
    assert client.post("/drive/stop").status_code == 503
    assert client.get("/drive/status").json()["state"] == "unstopped"
    token = plan(client, "turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).json()["error"]["kind"] == "unstopped"
    drive.machine.stands = True
    assert client.post("/drive/stop").status_code == 200
    token = plan(client, "turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202
    idle(client)


def test_an_order_that_fails_while_the_robot_may_move_leaves_it_unstopped(
    client: TestClient, drive: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: Any, **__: Any) -> None:
        drive.machine.stands = False
        raise RuntimeError("of avlmaps")

    token = plan(client, "turn left")["token"]
    monkeypatch.setattr("avlmaps.serve.drive.orders.instruct", fails)
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202
    until(lambda: client.get("/drive/status").json()["order"] is None)
    assert client.get("/drive/status").json()["state"] == "unstopped"


def test_a_robot_that_cannot_be_driven_is_not(client: TestClient, drive: Driven) -> None:
    token = plan(client, "turn left")["token"]
    drive.machine.body.broken = "its pose is not known"
    refused = client.post("/drive/confirm", json={"token": token})
    assert refused.status_code == 503 and "its pose is not known" in refused.json()["error"]["message"]
    assert client.post("/drive/plan", json={"words": "turn left"}).status_code == 503
    assert drive.machine.motions == 0
    assert drive.events.count("refused") == 2


def test_without_a_log_nothing_moves_and_a_stop_is_accepted(
    client: TestClient, drive: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    token = plan(client, "turn left")["token"]

    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("avlmaps.serve.drive.orders.os.fsync", full)
        refused = client.post("/drive/confirm", json={"token": token})
        assert refused.status_code == 503 and "No space left" in refused.json()["error"]["message"]
        assert client.post("/drive/stop").status_code == 200
    assert drive.machine.motions == 0


def test_the_token_of_the_server_stands_before_every_address(service: Service, drive: Driven) -> None:
    from dataclasses import replace

    guarded = replace(service, settings=ServeSettings(token="x" * 20))
    with TestClient(create_app(guarded, drive.mounts), base_url=BASE) as client:
        for path in ("plan", "confirm", "stop", "mcp"):
            assert client.post(f"/drive/{path}", json={}).status_code == 401
        assert client.get("/drive/status").status_code == 401
        assert drive.machine.stops == 0
        assert client.post("/drive/stop", headers={"authorization": f"Bearer {'x' * 20}"}).status_code == 200


def test_the_end_of_the_server_stops_the_robot(service: Service, drive: Driven) -> None:
    drive.machine.body.let_go.clear()
    with TestClient(create_app(service, drive.mounts), base_url=BASE) as client:
        token = plan(client, "turn left")["token"]
        client.post("/drive/confirm", json={"token": token})
    assert drive.machine.stops >= 1 and drive.machine.closed == 1
    assert drive.machine.motions == 0
    assert drive.entries[-1]["event"] in ("stop", "ended")
    with pytest.raises(RequestError):
        drive.dispatcher.plan("turn left", "", Who("here"))


def test_without_drive_there_is_no_such_address(service: Service) -> None:
    with TestClient(create_app(service), base_url=BASE) as client:
        for path in ("plan", "confirm", "stop", "mcp", ""):
            assert client.post(f"/drive/{path}", json={}).status_code == 404


def a_plan(order: str) -> OrderPlan:
    return OrderPlan(
        order=order, words="", reading="", program="", notes=[], path=[], path_m=0.0, subgoals=[], map="m", version="v",
        robot="r", start=START,
    )  # fmt: skip


@given(st.lists(st.tuples(st.sampled_from(["add", "take", "old", "wrong", "clear"]), st.integers(0, 5)), max_size=30))
def test_a_token_returns_its_own_plan_once_whatever_comes_before(steps: list[tuple[str, int]]) -> None:
    book, now, tokens, good = PlanBook(10.0), 0.0, [], {}
    for step, which in steps:
        if step == "add":
            token = book.add(a_plan(str(len(tokens))), now)
            good[token] = str(len(tokens)), now
            tokens.append(token)
            for gone in list(good)[:-16]:
                del good[gone]
        elif step == "clear":
            book.clear()
            good.clear()
        elif step == "old":
            now += 4.0
        elif step == "wrong":
            with pytest.raises(RequestError):
                book.take(f"wrong{which}", now)
        elif tokens:
            token = tokens[which % len(tokens)]
            order, made = good.pop(token, (None, 0.0))
            if order is not None and now - made <= 10.0:
                assert book.take(token, now).order == order
            else:
                with pytest.raises(RequestError):
                    book.take(token, now)


def test_status_streams_until_the_server_ends(service: Service, drive: Driven) -> None:
    import asyncio

    async def streamed() -> list[dict[str, Any]]:
        seen: list[dict[str, Any]] = []
        async for event in drive.service.events():
            assert event.startswith(b"event: status\ndata: ")
            seen.append(json.loads(event.partition(b"data: ")[2]))
            if len(seen) == 1:
                token = drive.dispatcher.plan("turn left", "", Who("here"))["token"]
            if seen[-1]["plans_waiting"] == 1:
                drive.dispatcher.confirm(token, Who("here"))
            if seen[-1]["last"]:
                drive.service.ending = True
        return seen

    seen = asyncio.run(asyncio.wait_for(streamed(), 60))
    assert seen[0]["state"] == "idle" and seen[-1]["last"]["outcome"]["ok"] is True
    assert seen[0]["pose"]["position"][:2] == pytest.approx([START.x_m, START.y_m], abs=0.01)


def call(client: TestClient, path: str, method: str, **params: Any) -> dict[str, Any]:
    headers = {"accept": "application/json, text/event-stream", "mcp-protocol-version": "2025-06-18"}
    body = {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}
    answer = client.post(path, json=body, headers=headers)
    text = answer.text.partition("data: ")[2] if "event-stream" in answer.headers["content-type"] else answer.text
    return json.loads(text)["result"]


def test_agents_plan_confirm_and_stop_by_tools_of_their_own(client: TestClient, drive: Driven) -> None:
    tools = {tool["name"]: tool for tool in call(client, "/drive/mcp", "tools/list")["tools"]}
    assert set(tools) == {"plan_drive", "confirm_drive", "stop_robot", "robot_status"}
    assert not set(tools) & {tool["name"] for tool in call(client, "/mcp", "tools/list")["tools"]}
    hints = {name: tool["annotations"]["readOnlyHint"] for name, tool in tools.items()}
    assert hints == {"plan_drive": True, "confirm_drive": False, "stop_robot": False, "robot_status": True}
    assert tools["confirm_drive"]["annotations"]["destructiveHint"] is True

    def tool(name: str, **arguments: Any) -> dict[str, Any]:
        return call(client, "/drive/mcp", "tools/call", name=name, arguments=arguments)

    def answer(name: str, **arguments: Any) -> dict[str, Any]:
        result = tool(name, **arguments)
        assert not result.get("isError") and "structuredContent" not in result
        (content,) = result["content"]
        assert token_count(content["text"]) <= MOST_TOKENS
        return json.loads(content["text"])

    assert token_count(json.dumps(list(tools.values()), separators=(",", ":"))) <= 400
    refused = tool("plan_drive", words="gabble gabble the")
    assert refused["isError"] is True and "token" not in json.loads(refused["content"][0]["text"])
    planned = answer("plan_drive", words="turn left")
    assert drive.machine.motions == 0
    assert tool("confirm_drive", token="x", velocity=1.0)["isError"] is True
    assert answer("confirm_drive", token=planned["token"])["state"] == "driving"
    idle(client)
    assert drive.machine.motions == 1
    assert answer("stop_robot", nonsense=[1, 2])["stopped"] is True
    assert answer("robot_status")["state"] == "idle"
    assert {entry["who"]["by"] for entry in drive.entries} == {"mcp"}


def test_a_stop_voids_plans_that_are_still_computed(
    client: TestClient, drive: Driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    computing, stopped = threading.Event(), threading.Event()
    prepare = drive.machine.prepare

    def slowly(*given: Any) -> Any:
        computing.set()
        assert stopped.wait(30.0)
        return prepare(*given)

    monkeypatch.setattr(drive.machine, "prepare", slowly)
    answers: list[Any] = []
    # The first is being computed when the stop comes, the others wait for their turn.
    asking = [
        threading.Thread(target=lambda: answers.append(client.post("/drive/plan", json={"words": "turn left"})))
        for _ in range(3)
    ]
    for thread in asking:
        thread.start()
    assert computing.wait(30.0)
    until(lambda: drive.service.orders.taken == 3)
    assert client.post("/drive/stop").status_code == 200
    stopped.set()
    for thread in asking:
        thread.join(60.0)
    assert [answer.status_code for answer in answers] == [409] * 3
    assert {answer.json()["error"]["kind"] for answer in answers} == {"stopped"}
    assert client.get("/drive/status").json()["plans_waiting"] == 0
    token = plan(client, "turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202


def test_a_stop_ends_a_wait_and_what_comes_after_it(client: TestClient, drive: Driven) -> None:
    token = plan(client, "wait 500 seconds, then turn left")["token"]
    assert client.post("/drive/confirm", json={"token": token}).status_code == 202
    assert client.post("/drive/stop").json()["stopped"] is True
    assert idle(client)["last"]["outcome"]["ok"] is False
    assert drive.machine.motions == 0


def test_a_question_back_names_its_choices_and_gives_no_token(client: TestClient) -> None:
    answer = client.post("/drive/plan", json={"words": "turn"})
    assert answer.status_code == 422
    assert answer.json()["error"]["choices"]
