"""The driving application: plan, confirm, stop and status, under ``/drive`` of the server.

A request that reaches it has passed the server's guard (Host, Origin, token, size of the body).
"""

import asyncio
import contextlib
import json
import logging
import os
import signal
from codecs import BOM_UTF8
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import msgspec
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from avlmaps.core.printable import printable_json
from avlmaps.query.schema import ErrorAnswer
from avlmaps.serve.drive.orders import Dispatcher
from avlmaps.serve.drive.plans import ConfirmRequest, DriveError, PlanRequest, Who

log = logging.getLogger("avlmaps.serve.drive")
T = TypeVar("T", bound=msgspec.Struct)
_JSON, _EVENTS = "application/json", "text/event-stream"
_LOOK_S, _BEAT_S = 0.1, 10.0
_MOST_BODY = 200_000
_MOST_WAITING = 8


@dataclass(slots=True)
class DriveService:
    """A dispatcher, and the threads in which its work is done.

    Stops have threads of their own, which no plan can fill.

    Attributes:
        dispatcher: decides what moves.
        orders: threads of plans and confirmations.
        stops: threads of stops.
        waiting: orders that are being read.
        ending: whether the server ends.
    """

    dispatcher: Dispatcher
    orders: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(2, "avlmaps-drive"))
    stops: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(4, "avlmaps-stop"))
    waiting: int = 0
    ending: bool = False

    async def ordered(self, work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Do the work of a plan, a confirmation or a status in a thread.

        Raises:
            DriveError: too many of them wait.
        """
        if self.waiting >= _MOST_WAITING:
            raise DriveError(f"{self.waiting} orders are being read; send this one again in a second.", 503, "busy")
        self.waiting += 1
        try:
            return await _in(self.orders, work)
        finally:
            self.waiting -= 1

    async def stop(self, who: Who) -> dict[str, Any]:
        """Stop the robot: the brake at once, here; the robot's confirmation in a thread."""
        self.dispatcher.brake_now()
        return await _in(self.stops, partial(self.dispatcher.stop, who))

    def end(self) -> None:
        """Stop the robot at once, since the server ends; streams end as well."""
        self.ending = True
        self.dispatcher.brake_now()
        with contextlib.suppress(RuntimeError):  # the threads have ended
            self.stops.submit(self.dispatcher.stop, Who("server", "signal"))

    @contextlib.asynccontextmanager
    async def lifespan(self) -> AsyncIterator[None]:
        """Stop the robot when the server ends; SIGHUP ends the server as SIGTERM does."""
        loop = asyncio.get_running_loop()
        with contextlib.suppress(NotImplementedError, RuntimeError, AttributeError):
            loop.add_signal_handler(signal.SIGHUP, os.kill, os.getpid(), signal.SIGTERM)
        try:
            yield
        finally:
            self.ending = True
            self.dispatcher.brake_now()
            await asyncio.shield(loop.run_in_executor(self.stops, self.dispatcher.close))
            self.orders.shutdown(wait=False, cancel_futures=True)
            self.stops.shutdown(wait=False)


async def _in(threads: ThreadPoolExecutor, work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    context = copy_context()
    return await asyncio.get_running_loop().run_in_executor(threads, lambda: context.run(work))


def drive_app(service: DriveService, agents: Any = None) -> Starlette:
    """Return the application."""
    routes = [
        Route("/", _about, methods=["GET"]),
        Route("/plan", _answered(service, _plan), methods=["POST"]),
        Route("/confirm", _answered(service, _confirm), methods=["POST"]),
        Route("/stop", _answered(service, _stop), methods=["POST"]),
        Route("/status", _answered(service, _status), methods=["GET"]),
    ]
    if agents is not None:
        routes.append(Route("/mcp", agents))
    app = Starlette(routes=routes, exception_handlers={HTTPException: _http_error})
    app.router.redirect_slashes = False
    app.state.document = drive_document()
    return app


Endpoint = Callable[[DriveService, Request, Who], Any]


def _answered(service: DriveService, endpoint: Endpoint) -> Callable[[Request], Any]:
    async def answer(request: Request) -> Response:
        who = Who(request.client.host if request.client else "unknown")
        try:
            return await endpoint(service, request, who)
        except DriveError as error:
            return error_response(error)
        except Exception:
            log.exception("%s", request.url.path)
            return error_response(
                DriveError("This is a fault of avlmaps; the server's log has the details.", 500, "internal")
            )

    return answer


async def _plan(service: DriveService, request: Request, who: Who) -> Response:
    wanted = await _read(request, PlanRequest)
    begun = service.dispatcher.begun
    return _json(
        await service.ordered(lambda: service.dispatcher.plan(wanted.words, wanted.program, who, begun, wanted.choose))
    )


async def _confirm(service: DriveService, request: Request, who: Who) -> Response:
    wanted = await _read(request, ConfirmRequest)
    return _json(await service.ordered(lambda: service.dispatcher.confirm(wanted.token, who)), 202)


async def _stop(service: DriveService, request: Request, who: Who) -> Response:
    """Stop; the body is not read, so that nothing in it can stand against a stop."""
    del request
    answer = await service.stop(who)
    return _json(answer, 200 if answer["stopped"] else 503)


async def _status(service: DriveService, request: Request, who: Who) -> Response:
    del who
    if _EVENTS in request.headers.get("accept", ""):
        return StreamingResponse(_events(service), media_type=_EVENTS)
    return _json(await service.ordered(service.dispatcher.status))


async def _events(service: DriveService) -> AsyncIterator[bytes]:
    """Yield the status now and after each change, until the client leaves."""
    loop, seen, sent_s = asyncio.get_running_loop(), -1, 0.0
    while not service.ending:
        if service.dispatcher.change != seen:
            seen = service.dispatcher.change
            status = await service.ordered(service.dispatcher.status)
            yield b"event: status\ndata: " + encoded(status) + b"\n\n"
            sent_s = loop.time()
        elif loop.time() - sent_s > _BEAT_S:
            yield b": nothing new\n\n"
            sent_s = loop.time()
        await asyncio.sleep(_LOOK_S)


async def _about(request: Request) -> Response:
    del request
    return _json(
        {
            "plan": "POST /drive/plan {words} or {program}: a plan and its token; nothing moves",
            "confirm": "POST /drive/confirm {token}: starts that plan",
            "stop": "POST /drive/stop: stops the robot and forgets every plan",
            "status": "GET /drive/status: what the robot is at; as a stream with Accept: text/event-stream",
            "agents": "/drive/mcp",
        }
    )


async def _read(request: Request, kind: type[T]) -> T:
    """Return the JSON body of a request.

    Raises:
        DriveError: it is no such body.
    """
    chunks = bytearray()
    async for chunk in request.stream():
        chunks += chunk
        if len(chunks) > _MOST_BODY:
            raise DriveError(f"The body is larger than {_MOST_BODY:,} bytes; send a shorter order.", 413, "size")
    try:
        return msgspec.json.decode(bytes(chunks).removeprefix(BOM_UTF8), type=kind, strict=True)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as fault:
        raise DriveError(
            f"The body does not fit ({str(fault)[:300]}); GET /drive/ lists the requests.", 400, "usage"
        ) from None


def error_response(error: DriveError) -> Response:
    """Return an error as the JSON that the command line prints; a question names its choices."""
    return _json(error_json(error), error.status)


def error_json(error: DriveError) -> dict[str, Any]:
    """Return an error as JSON."""
    choices = {"choices": list(error.choices)} if error.choices else {}
    return {"error": {"kind": error.kind, "message": str(error), **choices}}


def _http_error(request: Request, error: Exception) -> Response:
    del request
    status = error.status_code if isinstance(error, HTTPException) else 500
    messages = {404: "There is no such address; GET /drive/ lists them.", 405: "This address takes another method."}
    answer = error_response(DriveError(messages.get(status, "The request cannot be read."), status, "usage"))
    answer.headers.update(error.headers or {} if isinstance(error, HTTPException) else {})  # the methods that it takes
    return answer


def encoded(answer: Any) -> bytes:
    """Return an answer as JSON bytes, without raw control characters and marks of direction."""
    return printable_json(json.dumps(answer, allow_nan=False, ensure_ascii=False)).encode()


def _json(answer: Any, status: int = 200) -> Response:
    return Response(encoded(answer), status, media_type=_JSON)


_TEMPLATE = "#/components/schemas/{name}"
_TEXT, _NUMBER, _OBJECT = {"type": "string"}, {"type": "number"}, {"type": "object"}
# An order is a command or a program, and not both.
_ONE_OF = [
    {"required": [name], "properties": {name: {"type": "string", "pattern": r"\S"}}} for name in ("words", "program")
]
_OR_NULL = {"type": ["object", "null"]}
_PLAN = {
    "order": _TEXT, "words": _TEXT, "reading": _TEXT, "program": _TEXT, "notes": {"type": "array", "items": _TEXT},
    "path": {"type": "array", "items": {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}},
    "path_m": _NUMBER, "subgoals": {"type": "array", "items": _OBJECT}, "frame": _TEXT, "map": _TEXT,
    "version": _TEXT, "robot": _TEXT, "token": _TEXT, "expires_in_s": _NUMBER,
}  # fmt: skip
_STARTED = {"order": _TEXT, "state": {"const": "driving"}, "reading": _TEXT}
_STOPPED = {"stopped": {"type": "boolean"}, "note": _TEXT, "order": {"type": ["string", "null"]}}
_STATUS = {
    "state": {"enum": ["idle", "driving", "stopping", "unstopped"]}, "robot": _TEXT, "real": {"type": "boolean"},
    "pose": _OR_NULL, "frame": _TEXT, "order": _OR_NULL, "last": _OR_NULL,
    "plans_waiting": {"type": "integer", "minimum": 0}, "fault": {"type": ["string", "null"]},
}  # fmt: skip
_ERRORS = {
    "400": "The request does not fit.",
    "401": "The token of the server is missing or wrong.",
    "403": "The token names no waiting plan.",
    "409": "The robot drives already, or the plan no longer holds.",
    "413": "The body is too large.",
    "422": "The order cannot be read or planned; the sentence says why, or asks.",
    "503": "Too many orders are being read, or the robot cannot be reached.",
}


def drive_document() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the paths below the mount, and the schemas that they refer to."""
    types = [PlanRequest, ConfirmRequest, ErrorAnswer]
    (plan, confirm, error), schemas = msgspec.json.schema_components(types, ref_template=_TEMPLATE)

    order = {"allOf": [plan], "oneOf": _ONE_OF}

    def answers(status: str, about: str, fields: dict[str, Any]) -> dict[str, Any]:
        schema = {"type": "object", "properties": fields, "required": list(fields)}
        found = {code: _content(text, error) for code, text in _ERRORS.items()}
        return {status: _content(about, schema)} | found

    stopped = {"type": "object", "properties": _STOPPED, "required": list(_STOPPED)}
    stop = answers("200", "The robot stands.", _STOPPED)
    stop["503"] = _content("The robot did not confirm that it stands.", stopped)
    status = answers("200", "What the robot does.", _STATUS)
    status["200"]["content"]["text/event-stream"] = {"schema": _TEXT}
    return {
        "/plan": {"post": {
            "operationId": "planDrive",
            "summary": "Plan a command or a program. Nothing moves.",
            "requestBody": {"required": True, "content": {"application/json": {"schema": order}}},
            "responses": answers("200", "The plan and its token.", _PLAN),
        }},
        "/confirm": {"post": {
            "operationId": "confirmDrive",
            "summary": "Start the plan of a token. The robot moves.",
            "requestBody": {"required": True, "content": {"application/json": {"schema": confirm}}},
            "responses": answers("202", "The robot drives.", _STARTED),
        }},
        "/stop": {"post": {
            "operationId": "stopDrive",
            "summary": "Stop the robot and forget every plan. A body is not read.",
            "responses": stop,
        }},
        "/status": {"get": {
            "operationId": "driveStatus",
            "summary": "Return what the robot does, once or as events after each change.",
            "responses": status,
        }},
    }, schemas  # fmt: skip


def _content(about: str, schema: Any) -> dict[str, Any]:
    return {"description": about, "content": {"application/json": {"schema": schema}}}
