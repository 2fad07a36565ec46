"""The HTTP application: routes of the operations, errors as JSON, progress as server-sent events."""

import asyncio
from codecs import BOM_UTF8
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from typing import Any

import msgspec
from starlette.applications import Starlette
from starlette.convertors import Convertor, register_url_convertor
from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route

from avlmaps.core.version import __version__
from avlmaps.serve.guard import AccessGuard, App
from avlmaps.serve.lanes import Cancellation, Report, RequestError
from avlmaps.serve.openapi import CONTENT_POLICY, OPERATIONS, Operation, document, html_page
from avlmaps.serve.requests import Uploads, checked, checked_texts
from avlmaps.serve.service import JSON_TYPE, Service, error_response
from avlmaps.serve.tools import TOOLS, AgentTool
from avlmaps.serve.work import File, WorkInput, encoded, list_maps


class _Count(Convertor[int]):
    """Whole numbers in addresses, of a few digits."""

    regex = "[0-9]{1,9}"

    def convert(self, value: str) -> int:
        return int(value)

    def to_string(self, value: int) -> str:
        return str(value)


class _Index(_Count):
    """The same, also below 0."""

    regex = "-?[0-9]{1,9}"


register_url_convertor("count", _Count())
register_url_convertor("index", _Index())
Lifespan = Callable[[], AbstractAsyncContextManager[Any]]
_EVENTS = "text/event-stream"
_POLL_S, _BEAT_S = 2.0, 10.0


def create_app(
    service: Service,
    mounts: Mapping[str, App] | None = None,
    lifespans: Sequence[Lifespan] = (),
    tools: Sequence[AgentTool] = TOOLS,
) -> App:
    """Return the ASGI application of a server.

    Args:
        service: maps, lanes and settings.
        mounts: further ASGI applications by path, such as ``{"/drive": drive_app(service)}``; the guard stands before
            them, too. The longest path wins over shorter ones. A Starlette application says in ``state.document`` which
            paths and schemas it adds to the OpenAPI document.
        lifespans: async context managers that are open while the server runs.
        tools: what agents can call under ``/mcp``; none serves no agents.
    """
    routes: list[BaseRoute] = [
        Route("/", _page, methods=["GET"]),
        Route("/health", _health, methods=["GET"]),
        Route("/openapi.json", _openapi(service, mounts or {}), methods=["GET"]),
        Route("/maps", _maps(service), methods=["GET"]),
        *(Route(f"/maps/{{map}}{one.path}", _endpoint(service, one), methods=list(one.methods)) for one in OPERATIONS),
    ]
    opened = list(lifespans)
    if tools:
        from avlmaps.serve.agents import agent_app

        agents, running = agent_app(service, tools)
        routes.append(Route("/mcp", agents))
        opened.append(running)
    routes += [Mount(path, app=app) for path, app in sorted((mounts or {}).items(), key=lambda pair: -len(pair[0]))]

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            for one in opened:
                await stack.enter_async_context(one())
            looking = asyncio.create_task(_look_for_replaced_maps(service))
            try:
                yield
            finally:
                looking.cancel()

    app = Starlette(
        routes=routes,
        lifespan=lifespan,
        exception_handlers={
            Exception: lambda _, error: error_response(service, error),
            RequestError: lambda _, error: error_response(service, error),
            HTTPException: lambda _, error: _http_error(error),
        },
    )
    app.router.redirect_slashes = False
    if not service.settings.is_loopback:  # packing only costs time where the browser is on this machine
        app.add_middleware(GZipMiddleware, minimum_size=10_000, compresslevel=1)
    return AccessGuard(app, service.settings)


async def _look_for_replaced_maps(service: Service) -> None:
    while True:
        await asyncio.sleep(_POLL_S)
        service.shelf.refresh()


def _http_error(error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 500
    message = {
        404: "There is no such address; / lists them.",
        405: "This address does not take this method; /openapi.json lists the methods.",
    }.get(status, "The request cannot be read.")
    headers = dict(error.headers or {}) if isinstance(error, HTTPException) else {}
    return Response(encoded({"error": {"kind": "usage", "message": message}}), status, headers, JSON_TYPE)


def _json(answer: Any) -> Response:
    return Response(encoded(answer), media_type=JSON_TYPE)


async def _page(request: Request) -> Response:
    return HTMLResponse(
        html_page(str(request.base_url).rstrip("/")), headers={"content-security-policy": CONTENT_POLICY}
    )


async def _health(request: Request) -> Response:
    del request
    return _json({"status": "ok", "version": __version__})


def _openapi(service: Service, mounts: Mapping[str, App]) -> Callable[[Request], Any]:
    described = {
        path: app.state.document
        for path, app in mounts.items()
        if isinstance(app, Starlette) and hasattr(app.state, "document")
    }

    async def endpoint(request: Request) -> Response:
        url = str(request.base_url).rstrip("/")
        whole = document(service.shelf.names, url, service.settings.token is not None)
        for path, (paths, schemas) in described.items():
            whole["paths"] |= {f"{path}{below}": item for below, item in paths.items()}
            whole["components"]["schemas"] |= schemas
        return _json(whole)

    return endpoint


def _maps(service: Service) -> Callable[[Request], Any]:
    async def endpoint(request: Request) -> Response:
        _no_values(request)
        return _json(list_maps(service.shelf))

    return endpoint


def _no_values(request: Request) -> None:
    if request.query_params:
        raise RequestError("This address takes no values.")


def _endpoint(service: Service, operation: Operation) -> Callable[[Request], Any]:
    async def endpoint(request: Request) -> Response:
        try:
            return await _answered(service, operation, request)
        except Exception as error:  # noqa: BLE001 - every fault gets its JSON, and unknown ones go to the log
            return error_response(service, error)

    return endpoint


async def _answered(service: Service, operation: Operation, request: Request) -> Response:
    served = service.shelf.get(request.path_params["map"])
    query, uploads = await _read(operation, request)
    quick = operation.lane == "quick" and uploads == Uploads()
    lane = service.quick if quick else service.slow
    numbers = {name: str(value) for name, value in request.path_params.items() if name != "map"}
    tag = f'"{served.version}"'

    def job(watch: Cancellation) -> Any:
        made = operation.work(WorkInput(served, service.settings.limits, uploads, watch, numbers), query)
        return made if isinstance(made, File) else encoded(made)

    if isinstance(operation.answer, str):
        if request.headers.get("if-none-match") == tag and not request.query_params and request.method == "GET":
            return Response(status_code=304, headers={"etag": tag})
        file = await lane.run(job)
        return Response(file.content, 200, file.headers, file.media_type)
    if _EVENTS in request.headers.get("accept", ""):
        return StreamingResponse(_events(service, lane, job), media_type=_EVENTS)
    return Response(await lane.run(job), media_type=JSON_TYPE)


async def _events(service: Service, lane: Any, job: Callable[[Cancellation], bytes]) -> AsyncIterator[bytes]:
    """Yield the progress of a piece of work, and its answer or its error as the last event."""
    loop = asyncio.get_running_loop()
    steps: asyncio.Queue[bytes | None] = asyncio.Queue()

    def report(stage: str, done: int, total: int) -> None:
        step = _event("progress", msgspec.json.encode({"stage": stage, "done": done, "total": total}))
        loop.call_soon_threadsafe(steps.put_nowait, step)

    answering = asyncio.ensure_future(_finished(service, lane, job, report))
    answering.add_done_callback(lambda _: steps.put_nowait(None))
    try:
        yield _event("progress", msgspec.json.encode({"stage": "queued", "done": 0, "total": 0}))
        while True:
            try:
                step = await asyncio.wait_for(steps.get(), _BEAT_S)
            except TimeoutError:
                yield b": still working\n\n"
                continue
            if step is None:
                break
            yield step
        yield await answering
    finally:
        answering.cancel()


async def _finished(service: Service, lane: Any, job: Callable[[Cancellation], bytes], report: Report) -> bytes:
    try:
        return _event("answer", await lane.run(job, report))
    except Exception as error:  # noqa: BLE001 - as of a plain request
        return _event("error", bytes(error_response(service, error).body))


def _event(name: str, data: bytes) -> bytes:
    return b"event: " + name.encode() + b"\ndata: " + data + b"\n\n"


async def _read(operation: Operation, request: Request) -> tuple[Any, Uploads]:
    """Return the values and the files of a request."""
    pairs = request.query_params.multi_items()
    if request.method != "POST":
        return checked_texts(pairs, operation.query), Uploads()
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind == JSON_TYPE:
        if pairs:
            raise RequestError("Values come in the address or in the body, not in both.")
        return checked(_object(await request.body()), operation.query), Uploads()
    if kind in ("multipart/form-data", "application/x-www-form-urlencoded"):
        return await _form(operation, request, pairs)
    if operation.body == "photo" and (kind.startswith("image/") or kind == "application/octet-stream"):
        return checked_texts(pairs, operation.query), Uploads(photo=await request.body())
    if operation.body == "form" and not kind and not await request.body():
        return checked_texts(pairs, operation.query), Uploads()
    photo = "image/jpeg, image/png, " if operation.body == "photo" else ""
    raise RequestError(
        f"A body of type {kind[:80]!r} is not read here; send {photo}application/json or multipart/form-data.", 415
    )


def _object(body: bytes) -> dict[str, Any]:
    from avlmaps.core.files import decode_json

    try:
        values = decode_json(body.removeprefix(BOM_UTF8))
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise RequestError(f"The body is no JSON ({str(fault)[:200]}); send an object of values.") from None
    if not isinstance(values, dict):
        raise RequestError('The body is no JSON object; send one, such as {"sentence": "the sofa"}.')
    return values


async def _form(operation: Operation, request: Request, pairs: list[tuple[str, str]]) -> tuple[Any, Uploads]:
    files: dict[str, bytes] = {}
    try:
        form = await request.form(max_files=4, max_fields=100, max_part_size=1 << 20)
    except HTTPException as fault:
        raise RequestError(f"The form cannot be read ({str(fault.detail)[:200]}).") from None
    async with AsyncExitStack() as stack:
        stack.push_async_callback(form.close)
        for name, value in form.multi_items():
            if not isinstance(value, UploadFile):
                pairs.append((name, value))
                continue
            if name not in operation.files or name in files:
                wanted = " and ".join(operation.files)
                raise RequestError(
                    f"A file called {name[:80]!r} is not taken here, or came twice; send {wanted}, once."
                )
            files[name] = await value.read()
    return checked_texts(pairs, operation.query), Uploads(files.get("photo"), files.get("clip"))
