"""A server of the OpenAI chat protocol: its settings, its answers, a file that repeats them.

One deadline holds all attempts and each read, nothing endless is read, no redirect is followed (it would carry the
command elsewhere), no proxy stands before this very machine, and a key appears in no message.
"""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from http.client import HTTPException
from pathlib import Path
from time import monotonic, sleep
from typing import Annotated, Any, TypeVar, get_type_hints
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import HTTPRedirectHandler, ProxyHandler, Request, build_opener

import msgspec
from msgspec import Meta

from avlmaps.core.errors import LanguageError
from avlmaps.core.machine import is_loopback
from avlmaps.language.word_classes import table

HOSTED_URL = "https://api.openai.com/v1"
MOST_BYTES = 1 << 20
_PREFIX = "AVLMAPS_CHAT_"
_MODELS_WAIT_S = 10.0
_SHORTEST_KEY = 8
_BUSY = frozenset({408, 425, 429, 500, 502, 503, 504, 529})
_STATUSES = {401: "key", 403: "key", 404: "model", 429: "busy"}
Shape = TypeVar("Shape")
Messages = Sequence[Mapping[str, str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatSettings:
    """Which chat model writes programs, where it is served, and within which limits."""

    model: str | None = None  # None: the only one that the server offers
    base_url: str = HOSTED_URL  # of the API; that of a server on the same machine mostly ends in /v1
    api_key: str | None = field(default=None, repr=False)  # servers on the same machine mostly need none
    timeout_s: Annotated[float, Meta(gt=0, le=86400)] = 120.0  # for one command, with all attempts and corrections
    retries: Annotated[int, Meta(ge=0, le=10)] = 2  # of a request where the server is busy, fails, or breaks off
    rounds: Annotated[int, Meta(ge=0, le=10)] = 2  # of corrections to a program that cannot be used or that failed
    temperature: Annotated[float, Meta(ge=0, le=2)] | None = 0.0  # None: as the server likes, as for ``seed``
    max_tokens: Annotated[int, Meta(ge=1)] = 2048  # of an answer, with what a reasoning model thinks
    seed: int | None = 0
    replay: Path | None = None  # JSONL: written with every exchange where it is missing, else read instead of asking

    def __post_init__(self) -> None:
        for name, kind in get_type_hints(type(self), include_extras=True).items():
            try:
                if name != "replay":
                    msgspec.convert(getattr(self, name), kind)
            except msgspec.ValidationError as fault:
                raise LanguageError(f"The chat setting {name} is out of bounds ({fault}); give another.") from None
        try:
            split = urlsplit(self.base_url)
            _ = split.port
            is_address = split.scheme in ("http", "https") and bool(split.hostname)
        except ValueError:
            is_address = False
        if not is_address or not self.base_url.isprintable() or " " in self.base_url:
            shown = "What was given" if "@" in self.base_url else repr(self.base_url)  # a password is not repeated
            raise LanguageError(table("chat/faults")["no_address"].format(shown=shown, hosted=HOSTED_URL))
        if self.hosted and not self.base_url.startswith("https:"):
            raise LanguageError(f"{self.shown_url} would be sent the key in clear; give {HOSTED_URL}.")
        if self.api_key is not None and not (self.api_key.isascii() and self.api_key.isprintable()):
            raise LanguageError("The key for the chat model holds characters that no key has; copy it again.")

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ, **given: Any) -> "ChatSettings":
        """Return settings; what is not given (or None) is read from ``AVLMAPS_CHAT_MODEL`` and so on.

        ``OPENAI_BASE_URL`` and ``OPENAI_API_KEY`` are a pair: the key goes to that address (or the hosted one where
        none is set) and to no other; for another address there is ``AVLMAPS_CHAT_API_KEY``.
        """
        chosen = {name: value for name, value in given.items() if value is not None}
        for name, kind in get_type_hints(cls, include_extras=True).items():
            text = environment.get(_PREFIX + name.upper(), "").strip()
            if text and name not in chosen:
                chosen[name] = _converted(name, text, kind)
        openai_url = environment.get("OPENAI_BASE_URL", "").strip() or HOSTED_URL
        chosen.setdefault("base_url", openai_url)
        if "api_key" not in chosen and chosen["base_url"].rstrip("/") == openai_url.rstrip("/"):
            chosen["api_key"] = environment.get("OPENAI_API_KEY", "").strip() or None
        return cls(**chosen)

    @property
    def hosted(self) -> bool:
        """Whether the address is OpenAI's own."""
        return urlsplit(self.base_url).hostname == urlsplit(HOSTED_URL).hostname

    @property
    def on_this_machine(self) -> bool:
        """Whether the address is of the same machine, to which no proxy leads."""
        host = urlsplit(self.base_url).hostname or ""
        return is_loopback(host) or host.endswith(".localhost")

    @property
    def shown_url(self) -> str:
        """The address without a user, a password or a query, as errors may show it."""
        split = urlsplit(self.base_url)
        return f"{split.scheme}://{split.netloc.rpartition('@')[2]}{split.path.rstrip('/')}"


def _converted(name: str, text: str, kind: Any) -> Any:
    if kind == Path | None:
        return Path(text)
    try:
        return msgspec.convert(None if text.lower() == "none" else text, kind, strict=False)
    except msgspec.ValidationError as fault:
        raise LanguageError(f"The variable {_PREFIX}{name.upper()} is {text!r} ({fault}); give another.") from None


class ModelReply(msgspec.Struct, frozen=True):
    """The answer of a model; what it or its server leaves out is empty."""

    content: str
    refusal: str | None = None  # where the server marks refusals
    finish: str | None = "stop"  # "stop", "length", "content_filter", "tool_calls", or what else the server says
    model: str = ""
    tokens: tuple[int, int] = (0, 0)  # read and written


class _Exchange(msgspec.Struct):
    request: str
    asked: str
    answer: ModelReply


class Replay:
    """The exchanges of a JSONL file; neither a key nor the address of the server is in it.

    A request is known by its messages; what was asked often is answered in that order.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.recording = path, not path.exists()
        if self.recording and not os.access(path.parent, os.W_OK):  # said before an answer is paid for
            raise LanguageError(f"The replay file {path} cannot be written: its folder is not there, or read-only.")
        self._answers: dict[str, list[ModelReply]] = {}
        try:
            raw = b"" if self.recording else path.read_bytes()
            for line in raw[: raw.rfind(b"\n") + 1].splitlines():  # a kill tears the last line
                known = msgspec.json.decode(line, type=_Exchange)
                self._answers.setdefault(known.request, []).append(known.answer)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
            raise LanguageError(f"The replay file {path} cannot be read ({fault}); give another.") from None

    def answer(self, messages: Messages) -> ModelReply:
        """Return the recorded answer to these very messages; raises LanguageError where they were never asked."""
        answers = self._answers.get(_fingerprint(messages), [])
        if not answers:
            asked = quoted(messages[-1]["content"], 120)
            raise LanguageError(table("chat/faults")["no_answer"].format(path=self.path, asked=asked))
        return answers.pop(0) if len(answers) > 1 else answers[0]

    def add(self, messages: Messages, answer: ModelReply) -> None:
        """Write one exchange at the end of the file."""
        line = msgspec.json.encode(_Exchange(_fingerprint(messages), messages[-1]["content"], answer))
        try:
            with self.path.open("ab") as file:
                file.write(line + b"\n")
        except OSError as fault:
            raise LanguageError(f"The replay file {self.path} cannot be written ({fault.strerror}).") from None


def _fingerprint(messages: Messages) -> str:
    return sha256(msgspec.json.encode(messages, order="sorted")).hexdigest()


def quoted(text: str, most: int = 200) -> str:
    """Return a text of somebody else's as one quoted line that a terminal can show, cut where it is long."""
    plain = " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
    return f"“{plain if len(plain) <= most else plain[: most - 1] + '…'}”"


@dataclass(slots=True, eq=False)
class _Fault(Exception):  # noqa: N818 - sentences are made of it
    kind: str
    told: str = ""
    status: int = 0
    retry_after_s: float | None = None


class _Part(msgspec.Struct):
    text: str | None = None
    refusal: str | None = None


class _Message(msgspec.Struct):
    content: str | list[_Part] | None = None
    refusal: str | None = None


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
    """One server. What it turned out not to take (a temperature, a seed) is ``left_out`` from then on."""

    def __init__(self, settings: ChatSettings) -> None:
        if settings.hosted and not settings.api_key:
            raise LanguageError(table("chat/faults")["no_key"].format(url=settings.shown_url))
        self.left_out: list[str] = []
        self._settings = settings
        most = "max_completion_tokens" if settings.hosted else "max_tokens"
        wanted = {"temperature": settings.temperature, "seed": settings.seed, most: settings.max_tokens}
        self._optional = {name: value for name, value in wanted.items() if value is not None}
        self._opener = build_opener(_NoRedirect(), *([ProxyHandler({})] if settings.on_this_machine else []))

    def complete(self, model: str, messages: Messages, deadline: float | None = None) -> ModelReply:
        """Return the model's answer before a deadline of the monotonic clock; raises LanguageError where none came."""
        settings = self._settings
        deadline = monotonic() + settings.timeout_s if deadline is None else deadline
        attempt = 0
        while True:
            asked = {"model": model, "messages": messages, **self._optional}
            try:
                answer = _reply(self._asked("chat/completions", deadline, asked))
                return msgspec.structs.replace(answer, content=self._without_key(answer.content))
            except _Fault as fault:
                if self._adapted(fault):
                    continue
                wait_s = min(0.5 * 2**attempt, 8.0) if fault.retry_after_s is None else fault.retry_after_s
                passes = fault.kind == "broken" or fault.status in _BUSY
                if not passes or attempt >= settings.retries or monotonic() + wait_s > deadline:
                    raise LanguageError(self._sentence(fault, model)) from None
            sleep(wait_s)
            attempt += 1

    def model(self) -> str:
        """Return the only model that the server offers; raises LanguageError where there is none or several."""
        offered = () if self._settings.hosted else self._models()
        if len(offered) == 1:
            return offered[0]
        choice = _listed(offered) or "the name that the server was started with"
        raise LanguageError(table("chat/faults")["no_model"].format(url=self._settings.shown_url, choice=choice))

    def _models(self) -> tuple[str, ...]:
        try:
            raw = self._asked("models", monotonic() + min(self._settings.timeout_s, _MODELS_WAIT_S))
            return tuple(model.id for model in _decoded(raw, _Models).data)
        except _Fault as fault:
            if fault.kind == "unreachable":
                raise LanguageError(self._sentence(fault, "")) from None
            return ()

    def _asked(self, path: str, deadline: float, parameters: Mapping[str, Any] | None = None) -> bytes:
        headers = {"Authorization": f"Bearer {self._settings.api_key or 'none'}", "Content-Type": "application/json"}
        body = None if parameters is None else msgspec.json.encode(parameters)
        request = Request(f"{self._settings.base_url.rstrip('/')}/{path}", body, headers)
        try:
            with self._opener.open(request, timeout=max(deadline - monotonic(), 0.01)) as response:
                return _read(response, deadline)
        except HTTPError as fault:
            raise _of_status(fault, deadline) from None
        except (OSError, HTTPException) as fault:
            kind, reason = ("unreachable", fault.reason) if isinstance(fault, URLError) else ("broken", fault)
            kind = "timeout" if isinstance(reason, TimeoutError) else kind
            raise _Fault(kind, str(reason) or type(reason).__name__) from None

    def _adapted(self, fault: _Fault) -> bool:
        """Leave out, or name otherwise, the parameter that the server does not take; return whether there was one."""
        wrong = next((name for name in self._optional if re.search(rf"\b{name}\b", fault.told)), None)
        if fault.status not in (400, 422) or wrong in (None, "max_completion_tokens"):
            return False
        value = self._optional.pop(wrong)
        if wrong == "max_tokens":
            self._optional["max_completion_tokens"] = value
        else:
            self.left_out.append(wrong)
        return True

    def _sentence(self, fault: _Fault, model: str) -> str:
        settings = self._settings
        status = f"HTTP {fault.status}: {quoted(fault.told)}" if fault.told else f"HTTP {fault.status}"
        offered = _listed(self._models()) if fault.kind == "model" and not settings.hosted else ""
        sentence = table("chat/faults")[fault.kind].format(
            url=settings.shown_url,
            model=model,
            timeout_s=settings.timeout_s,
            told=status if fault.status else fault.told,
            start="start the server there (Ollama: ollama serve)" if settings.on_this_machine else "check the network",
            key="OPENAI_API_KEY" if settings.hosted else "AVLMAPS_CHAT_API_KEY",
            offered=offered or "one that the server has",
            wait=f"in {fault.retry_after_s:.0f} s" if fault.retry_after_s else "later",
        )
        return self._without_key(sentence)

    def _without_key(self, text: str) -> str:
        """Return a text without the key, which some servers repeat; what is shorter than any key is none."""
        key = self._settings.api_key or ""
        return text.replace(key, "…") if len(key) >= _SHORTEST_KEY else text


def _read(response: Any, deadline: float) -> bytes:
    body = bytearray()
    while chunk := response.read1(1 << 16):
        body += chunk
        if len(body) > MOST_BYTES:
            raise _Fault("garbled", f"more than {MOST_BYTES >> 10} KiB")
        if monotonic() > deadline:
            raise _Fault("timeout")
    if getattr(response, "length", None):
        raise _Fault("broken", "less came than was promised")
    return bytes(body)


def _reply(raw: bytes) -> ModelReply:
    completion = _decoded(raw, _Completion)
    if not completion.choices:
        raise _Fault("other", _message(completion.error), 200)
    choice, usage = completion.choices[0], completion.usage if isinstance(completion.usage, dict) else {}
    content, refusal = choice.message.content or "", choice.message.refusal
    if not isinstance(content, str):
        refusal = refusal or next((part.refusal for part in content if part.refusal), None)
        content = "".join(part.text or "" for part in content)
    read, written = (usage.get(f"{name}_tokens") for name in ("prompt", "completion"))
    tokens = (read if isinstance(read, int) else 0, written if isinstance(written, int) else 0)
    return ModelReply(content, refusal, choice.finish_reason, quoted(completion.model or "", 100).strip("“”"), tokens)


def _of_status(fault: HTTPError, deadline: float) -> _Fault:
    try:
        raw = _read(fault, deadline)
    except (_Fault, OSError, HTTPException):
        raw = b""
    try:
        told = fault.headers.get("location") or _message(msgspec.json.decode(raw))
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        told = "" if raw.lstrip()[:1] == b"<" else raw.decode("utf-8", "replace").strip()
    wait = fault.headers.get("retry-after") or ""
    seconds = float(wait) if re.fullmatch(r"\d{1,9}(\.\d+)?", wait) else None  # it may be a date
    return _Fault(_STATUSES.get(fault.code, "other"), told, fault.code, seconds)


def _message(body: Any) -> str:
    told = body.get("error", body) if isinstance(body, dict) else body
    if isinstance(told, dict):
        told = " ".join(str(told[name]) for name in ("param", "message", "detail", "error") if told.get(name))
    return told if isinstance(told, str) else ""


def _decoded(raw: bytes, shape: type[Shape]) -> Shape:
    try:
        return msgspec.json.decode(raw, type=shape)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
        is_page = raw.lstrip()[:1] == b"<"
        raise _Fault("garbled", "an HTML page" if is_page else f"something else ({quoted(str(fault))})") from None


def _listed(models: Sequence[str], most: int = 8) -> str:
    more = f" and {len(models) - most} more" if len(models) > most else ""
    return f"one of {', '.join(models[:most])}{more}" if models else ""
