"""A server of the OpenAI chat protocol, asked over HTTP: any that serves ``/chat/completions``, hosted or local.

One deadline holds all attempts and each read, nothing endless is read, no redirect is followed (it would carry the
command elsewhere), no proxy stands before this very machine, and a key appears in no message. Answers are read
strictly, since a garbled one must not become a program, and forgivingly, since servers differ in all that does not
matter here.
"""

import re
from dataclasses import dataclass
from http.client import HTTPException
from time import monotonic, sleep
from typing import Any, TypeVar
from urllib.error import HTTPError, URLError
from urllib.request import HTTPRedirectHandler, ProxyHandler, Request, build_opener

import msgspec

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply, quoted
from avlmaps.language.chat.replay import ChatRequest
from avlmaps.language.chat.settings import ChatSettings

MOST_BYTES = 1 << 20
_MOST_ERROR_BYTES = 1 << 16
_MOST_MODELS_WAIT_S = 10.0
_SHORTEST_KEY = 8
_LONGEST_NAME = 100
_BUSY = frozenset({408, 425, 429, 500, 502, 503, 504, 529})
Shape = TypeVar("Shape")
_SENTENCES = {
    "unreachable": "The chat server {url} cannot be reached ({message}): {start}, or correct its address.",
    "timeout": (
        "{model!r} at {url} gave no answer within {timeout_s:g} s: raise AVLMAPS_CHAT_TIMEOUT_S, or take a smaller "
        "model."
    ),
    "broken": "{url} broke off in the middle {times} ({message}): look into the server's log.",
    "huge": "{url} answered with more than {message}, which no program needs: ask another model.",
    "garbled": (
        "{url} does not speak the chat protocol: it answered with {message}; its address must be that of the API, "
        "which mostly ends in /v1."
    ),
    "empty": "{url} answered without any choice: look into the server's log, or ask another model than {model!r}.",
    "key": "{url} {held} ({told}): set {key} to one that may use {model!r}.",
    "model": "{url} has no model {model!r} ({told}): set AVLMAPS_CHAT_MODEL to one of {offered}.",
    "quota": "The account at {url} has no credit left ({told}): add some, or ask a server of your own.",
    "busy": "{url} has had too many requests ({told}): try again {wait}.",
    "redirect": "{url} sends on to another address ({told}): give that one, if it is meant.",
    "failed": "{url} failed {times} ({told}): try again later, or look into the server's log.",
    "other": "{url} does not take the request ({told}): ask another model than {model!r}, or change the settings.",
}


@dataclass(slots=True, eq=False)
class EndpointFault(Exception):  # noqa: N818 - never leaves this package: sentences are made of it
    """Why no answer came: a row of the sentences, or "status" for an HTTP status that is no success.

    Attributes:
        kind: of the fault.
        status: the HTTP status, 0 where there is none.
        message: what the server or the system says of it; ``code`` is the server's word for it.
        param: the parameter that the server does not take, where it says so.
        retry_after_s: when to try again, where the server says so.
    """

    kind: str
    status: int = 0
    message: str = ""
    param: str = ""
    code: str = ""
    retry_after_s: float | None = None


class _Part(msgspec.Struct):
    text: str | None = None
    refusal: str | None = None


class _Message(msgspec.Struct):
    content: str | list[_Part] | None = None
    refusal: str | None = None
    tool_calls: list[Any] | None = None


class _Choice(msgspec.Struct):
    message: _Message
    finish_reason: str | None = None


class _Completion(msgspec.Struct):
    choices: list[_Choice] | None = None
    model: str | None = None
    usage: Any = None
    error: Any = None


class _Model(msgspec.Struct):
    id: str


class _Models(msgspec.Struct):
    data: list[_Model]


class _NoRedirect(HTTPRedirectHandler):
    def redirect_request(self, req: Any, fp: Any, code: Any, msg: Any, headers: Any, newurl: Any) -> None:
        """Follow none: each ends as an error of its status."""


class Endpoint:
    """One server. What it turned out not to take (a temperature, a seed) is left out from then on.

    Attributes:
        left_out: names of parameters that the server did not take.
    """

    def __init__(self, settings: ChatSettings) -> None:
        if settings.hosted and not settings.api_key:
            raise LanguageError(
                f"There is no key for {settings.shown_url}: set OPENAI_API_KEY, or name a server of your own with "
                "OPENAI_BASE_URL, such as http://localhost:11434/v1 for Ollama."
            )
        self.left_out: list[str] = []
        self._settings = settings
        self._most_tokens_word = "max_completion_tokens" if settings.hosted else "max_tokens"
        self._opener = build_opener(_NoRedirect(), *([ProxyHandler({})] if settings.on_this_machine else []))

    def complete(self, request: ChatRequest, deadline: float | None = None) -> ModelReply:
        """Return the server's answer to a request, before a deadline of the monotonic clock.

        Raises:
            LanguageError: none came; one sentence says why and what to do.
        """
        deadline = monotonic() + self._settings.timeout_s if deadline is None else deadline
        attempt = 0
        while True:
            try:
                answer = _read_answer(self._asked("chat/completions", deadline, self._parameters(request)))
                return msgspec.structs.replace(answer, content=self._without_key(answer.content))
            except EndpointFault as fault:
                if self._adapted(fault):
                    continue
                wait_s = self._wait_s(fault, attempt, deadline)
                if wait_s is None:
                    raise LanguageError(self._sentence(fault, request.model, attempt + 1)) from None
            sleep(wait_s)
            attempt += 1

    def model(self) -> str:
        """Return the only model that the server offers.

        Raises:
            LanguageError: it offers several, or does not say which.
        """
        offered = () if self._settings.hosted else self._models()
        if len(offered) == 1:
            return offered[0]
        choice = f" to one of {_listed(offered)}" if offered else ", such as the name that the server was started with"
        raise LanguageError(f"No chat model is named for {self._settings.shown_url}: set AVLMAPS_CHAT_MODEL{choice}.")

    def _models(self) -> tuple[str, ...]:
        try:
            raw = self._asked("models", monotonic() + min(self._settings.timeout_s, _MOST_MODELS_WAIT_S))
            return tuple(model.id for model in _decoded(raw, _Models).data)
        except EndpointFault as fault:
            if fault.kind == "unreachable":
                raise LanguageError(self._sentence(fault, "", 1)) from None
            return ()

    def _parameters(self, request: ChatRequest) -> dict[str, Any]:
        optional = {
            "temperature": request.temperature,
            "seed": request.seed,
            self._most_tokens_word: request.max_tokens,
        }
        kept = {name: value for name, value in optional.items() if value is not None and name not in self.left_out}
        return {"model": request.model, "messages": request.messages, **kept}

    def _asked(self, path: str, deadline: float, parameters: dict[str, Any] | None = None) -> bytes:
        """Return the body of one request's answer; raises EndpointFault where none came before the deadline."""
        headers = {"Authorization": f"Bearer {self._settings.api_key or 'none'}", "Content-Type": "application/json"}
        body = None if parameters is None else msgspec.json.encode(parameters)
        request = Request(f"{self._settings.base_url.rstrip('/')}/{path}", body, headers)
        try:
            with self._opener.open(request, timeout=max(deadline - monotonic(), 0.01)) as response:
                return _read(response, MOST_BYTES, deadline)
        except HTTPError as fault:
            try:
                raw = _read(fault, _MOST_ERROR_BYTES, deadline)
            except (EndpointFault, OSError, HTTPException):
                raw = b""
            raise _read_error(fault.code, raw, fault.headers) from None
        except TimeoutError:
            raise EndpointFault("timeout") from None
        except URLError as fault:
            if isinstance(fault.reason, TimeoutError):
                raise EndpointFault("timeout") from None
            raise EndpointFault("unreachable", message=str(fault.reason)) from None
        except (OSError, HTTPException) as fault:
            raise EndpointFault("broken", message=str(fault) or type(fault).__name__) from None

    def _adapted(self, fault: EndpointFault) -> bool:
        """Leave out, or name otherwise, the parameter that the server does not take; return whether there was one."""

        def named(parameter: str) -> bool:
            said = not fault.param and re.search(rf"\b{parameter}\b", fault.message) is not None
            return fault.status in (400, 422) and (fault.param == parameter or said)

        if self._most_tokens_word == "max_tokens" and named("max_tokens"):
            self._most_tokens_word = "max_completion_tokens"
            return True
        wrong = [name for name in ("temperature", "seed") if name not in self.left_out and named(name)]
        self.left_out += wrong[:1]
        return bool(wrong)

    def _wait_s(self, fault: EndpointFault, attempt: int, deadline: float) -> float | None:
        """Return how long to wait before another attempt, None where there is to be none."""
        passes = fault.kind == "broken" or (fault.status in _BUSY and fault.code != "insufficient_quota")
        if not passes or attempt >= self._settings.retries:
            return None
        wait_s = min(0.5 * 2**attempt, 8.0) if fault.retry_after_s is None else fault.retry_after_s
        return wait_s if monotonic() + wait_s < deadline else None

    def _sentence(self, fault: EndpointFault, model: str, attempts: int) -> str:
        settings = self._settings
        offered = self._models() if fault.status == 404 and not settings.hosted else ()
        sentence = _SENTENCES[_kind_of(fault)].format(
            url=settings.shown_url,
            model=model,
            message=fault.message,
            timeout_s=settings.timeout_s,
            times="once" if attempts == 1 else f"{attempts} times",
            told=f"HTTP {fault.status}" + (f": {quoted(fault.message)}" if fault.message.strip() else ""),
            start="start the server there (Ollama: ollama serve)" if settings.on_this_machine else "check the network",
            key="OPENAI_API_KEY" if settings.hosted else "AVLMAPS_CHAT_API_KEY",
            held="does not accept the key" if settings.api_key else "asks for a key",
            offered=_listed(offered) or "those that the server has",
            wait=f"in {fault.retry_after_s:.0f} s" if fault.retry_after_s else "later",
        )
        return self._without_key(sentence)

    def _without_key(self, text: str) -> str:
        """Return a text without the key, which some servers repeat; what is shorter than any key is none."""
        key = self._settings.api_key or ""
        return text.replace(key, "…") if len(key) >= _SHORTEST_KEY else text


def _kind_of(fault: EndpointFault) -> str:
    if fault.kind != "status":
        return fault.kind
    if fault.code == "insufficient_quota":
        return "quota"
    rows = {401: "key", 403: "key", 404: "model", 429: "busy"}
    return rows.get(
        fault.status, "redirect" if 300 <= fault.status < 400 else "failed" if fault.status >= 500 else "other"
    )


def _read(response: Any, most: int, deadline: float) -> bytes:
    """Return a body; one that is too long, torn, or slower than the deadline raises EndpointFault."""
    body = bytearray()
    while chunk := response.read1(1 << 16):
        body += chunk
        if len(body) > most:
            raise EndpointFault("huge", message=f"{most >> 10} KiB")
        if monotonic() > deadline:
            raise EndpointFault("timeout")
    if getattr(response, "length", None):
        raise EndpointFault("broken", message="less came than was promised")
    return bytes(body)


def _read_answer(raw: bytes) -> ModelReply:
    """Return the first choice of a completion; raises EndpointFault where it has none, or is an error after all."""
    completion = _decoded(raw, _Completion)
    if completion.error and not completion.choices:
        raise _read_error(200, raw, {})
    if not completion.choices:
        raise EndpointFault("empty")
    choice = completion.choices[0]
    parts = choice.message.content if isinstance(choice.message.content, list) else []
    content = choice.message.content if isinstance(choice.message.content, str) else ""
    usage = completion.usage if isinstance(completion.usage, dict) else {}
    read, written = (usage.get(f"{name}_tokens") for name in ("prompt", "completion"))
    return ModelReply(
        content=content or "".join(part.text or "" for part in parts),
        refusal=choice.message.refusal or next((part.refusal for part in parts if part.refusal), None),
        finish=choice.finish_reason,
        tool_calls=len(choice.message.tool_calls or ()),
        model="".join(letter for letter in completion.model or "" if letter.isprintable())[:_LONGEST_NAME],
        tokens=(read if isinstance(read, int) else 0, written if isinstance(written, int) else 0),
    )


def _read_error(status: int, raw: bytes, headers: Any) -> EndpointFault:
    """Return the fault in a body of an HTTP error, in any of the usual shapes."""
    fault = EndpointFault("status", status, retry_after_s=_seconds(headers.get("retry-after")))
    if 300 <= status < 400:
        fault.message = headers.get("location") or ""
        return fault
    try:
        body = msgspec.json.decode(raw)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        text = raw.decode("utf-8", "replace").strip()
        fault.message = "" if text.startswith("<") else text
        return fault
    told = body.get("error", body) if isinstance(body, dict) else body
    if isinstance(told, dict):
        fault.message = str(told.get("message") or told.get("detail") or told.get("error") or "")
        fault.param, fault.code = str(told.get("param") or ""), str(told.get("code") or told.get("type") or "")
    else:
        fault.message = told if isinstance(told, str) else ""
    return fault


def _decoded(raw: bytes, shape: type[Shape]) -> Shape:
    try:
        return msgspec.json.decode(raw, type=shape)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
        is_page = raw.lstrip()[:1] == b"<"
        odd = "an HTML page" if is_page else f"something that is not what it should be ({quoted(str(fault))})"
        raise EndpointFault("garbled", message=odd) from None


def _seconds(retry_after: str | None) -> float | None:
    """Return the seconds of a Retry-After header; None where it holds a date."""
    try:
        seconds = float(retry_after or "nan")
    except ValueError:
        return None
    return max(seconds, 0.0) if seconds < 1e9 else None  # not a number is no time to wait either


def _listed(models: tuple[str, ...], most: int = 8) -> str:
    return ", ".join(models[:most]) + (f" and {len(models) - most} more" if len(models) > most else "")
