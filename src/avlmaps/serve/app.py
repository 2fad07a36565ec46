"""The HTTP application: routes of the operations, errors as JSON, progress as server-sent events."""

import asyncio
from codecs import BOM_UTF8
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from typing import Any

import msgspec
from starlette.applications import Starlette
from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route

from avlmaps.core.files import decode_json
from avlmaps.core.version import __version__
from avlmaps.serve.agents import agent_endpoint, agent_server
from avlmaps.serve.guard import AccessGuard, App
from avlmaps.serve.lanes import JSON_TYPE, Cancellation, RequestError, streamed
from avlmaps.serve.operations import CONTENT_POLICY, OPERATIONS, Operation, document, html_page
from avlmaps.serve.requests import PHOTO, Files, files_in, lists_of, read
from avlmaps.serve.service import Service, error_response
from avlmaps.serve.work import File, WorkInput, encoded, list_maps

EVENTS = "text/event-stream"
_POLL_S = 2.0


def create_app(service: Service, mounts: Mapping[str, Starlette] | None = None, agents: bool = True) -> App:
    """Return the ASGI application of a server; ``agents`` are served under ``/mcp``.

    ``mounts`` are further applications by path, such as ``{"/drive": driving.app}``; the guard stands before them, too.
    One may name in ``state.operations`` what the OpenAPI document says of it.
    """
    mounts = mounts or {}
    token, names = service.settings.token, service.shelf.names
    more = {path: getattr(app.state, "operations", ()) for path, app in mounts.items()}

    def told(answer: Callable[[str], Any]) -> Callable[[Request], Awaitable[Response]]:
        async def endpoint(request: Request) -> Response:
            return json_response(answer(str(request.base_url).rstrip("/")))

        return endpoint

    routes: list[BaseRoute] = [
        Route("/", _page, methods=["GET"]),
        Route("/health", told(lambda _: {"status": "ok", "version": __version__}), methods=["GET"]),
        Route("/openapi.json", told(lambda url: document(names, url, token is not None, more)), methods=["GET"]),
        Route("/maps", told(lambda _: list_maps(service.shelf)), methods=["GET"]),
    ]
    routes += [
        Route(f"/maps/{{map}}{one.path}", partial(_endpoint, service, one), methods=list(one.methods))
        for one in OPERATIONS
        if one.path is not None
    ]
    if agents:
        endpoint = agent_endpoint(agent_server(service), service.settings.limits.body_bytes)
        routes.append(Route("/mcp", endpoint, methods=["POST"]))
    routes += [Mount(path, app=app) for path, app in mounts.items()]

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            for one in mounts.values():
                await stack.enter_async_context(one.router.lifespan_context(one))
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
            HTTPException: lambda _, error: http_error(error, "/ lists them"),
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


def http_error(error: Exception, where: str) -> Response:
    """Return the answer to an address or a method that there is not, as JSON; ``where`` is what lists them."""
    status = error.status_code if isinstance(error, HTTPException) else 500
    sentences = {404: "There is no such address", 405: "This address does not take this method"}
    message = f"{sentences[status]}; {where}." if status in sentences else "The request cannot be read."
    headers = dict(error.headers or {}) if isinstance(error, HTTPException) else {}
    return Response(encoded({"error": {"kind": "usage", "message": message}}), status, headers, JSON_TYPE)


def json_response(answer: Any, status: int = 200) -> Response:
    """Return an answer as JSON."""
    return Response(encoded(answer), status, media_type=JSON_TYPE)


async def _page(request: Request) -> Response:
    page = html_page(str(request.base_url).rstrip("/"))
    return HTMLResponse(page, headers={"content-security-policy": CONTENT_POLICY})


async def _endpoint(service: Service, operation: Operation, request: Request) -> Response:
    try:
        return await _answered(service, operation, request)
    except Exception as error:  # noqa: BLE001 - every fault gets its JSON, and unknown ones go to the log
        return error_response(service, error)


async def _answered(service: Service, operation: Operation, request: Request) -> Response:
    served = service.shelf.get(request.path_params["map"])
    values, files = await values_of(request, operation, service.settings.limits.body_bytes)
    in_path = {name: value for name, value in request.path_params.items() if name != "map"}
    query = read({**values, **in_path}, operation.query, operation.files)
    lane = service.slow if operation.slow or files else service.quick
    tag = f'"{served.version}-{__version__}"'  # another release draws and names another way, and has another page

    def job(watch: Cancellation) -> Any:
        made = operation.work(WorkInput(served, service.settings.limits, files, watch), query)
        return made if isinstance(made, File) else encoded(made)

    if isinstance(operation.answer, str):
        if request.headers.get("if-none-match") == tag and not request.query_params and request.method == "GET":
            return Response(status_code=304, headers={"etag": tag})
        file = await lane.run(job)
        return Response(file.content, 200, {"etag": tag}, file.media_type)
    if EVENTS not in request.headers.get("accept", ""):
        return Response(await lane.run(job), media_type=JSON_TYPE)
    loop = asyncio.get_running_loop()

    async def answered(tell: Callable[[bytes], None]) -> bytes:
        def report(stage: str, done: int, total: int) -> None:
            step = msgspec.json.encode({"stage": stage, "done": done, "total": total})
            loop.call_soon_threadsafe(tell, _event("progress", step))

        report("queued", 0, 0)
        try:
            return _event("answer", await lane.run(job, report))
        except Exception as error:  # noqa: BLE001 - as of a plain request
            return _event("error", bytes(error_response(service, error).body))

    return StreamingResponse(streamed(answered), media_type=EVENTS)


def _event(name: str, data: bytes) -> bytes:
    return b"event: " + name.encode() + b"\ndata: " + data + b"\n\n"


async def values_of(request: Request, operation: Operation, most_bytes: int) -> tuple[dict[str, Any], Files]:
    """Return the values and the files of a request; ``requests.read`` makes a request of them."""
    pairs: list[tuple[str, Any]] = request.query_params.multi_items()
    if request.method != "POST":
        return _values(pairs, operation), {}
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind in ("multipart/form-data", "application/x-www-form-urlencoded"):
        return await _form(request, operation, pairs)
    body = await request.body()
    if PHOTO in operation.needs and (kind.startswith("image/") or kind == "application/octet-stream"):
        return _values(pairs, operation), {PHOTO: body}
    if not kind and not body:
        return _values(pairs, operation), {}
    if kind != JSON_TYPE:
        photo = "image/jpeg, image/png, " if PHOTO in operation.needs else ""
        forms = " or multipart/form-data" if operation.files else ""
        raise RequestError(f"A body of type {kind[:80]!r} is not read here; send {photo}{JSON_TYPE}{forms}.", 415)
    if pairs:
        raise RequestError("Values come in the address or in the body, not in both.")
    values = json_object(body)
    return values, files_in(values, operation.files, most_bytes)


def json_object(body: bytes) -> dict[str, Any]:
    """Return the values of a body, or raise ``RequestError`` where it is no JSON object."""
    try:
        values = decode_json(body.removeprefix(BOM_UTF8))
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as fault:
        raise RequestError(f"The body is no JSON ({str(fault)[:200]}); send an object of values.") from None
    if not isinstance(values, dict):
        raise RequestError('The body is no JSON object; send one, such as {"sentence": "the sofa"}.')
    return values


def _values(pairs: Sequence[tuple[str, Any]], operation: Operation) -> dict[str, Any]:
    lists = lists_of(operation.query)
    values: dict[str, Any] = {}
    for name, text in pairs:
        if name in lists:
            values.setdefault(name, []).append(text)
        elif name in values:
            raise RequestError(f"{name[:80]!r} is given twice; give it once.")
        else:
            values[name] = text
    return values


async def _form(request: Request, operation: Operation, pairs: list[tuple[str, Any]]) -> tuple[dict[str, Any], Files]:
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
                where = f"send {wanted}, once" if wanted else "it takes no files"
                raise RequestError(f"A file called {name[:80]!r} is not taken here, or came twice; {where}.")
            files[name] = await value.read()
    return _values(pairs, operation), files
