"""The answers of servers of the chat protocol: completions, lists of models and errors, read strictly and forgivingly.

Strictly, since a garbled answer must not become a program; forgivingly, since servers differ in all that does not
matter here (extra fields, missing counts, text in parts, three shapes of an error).
"""

from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from time import time
from typing import Any, TypeVar

import msgspec

from avlmaps.language.chat.answer import ModelReply

Shape = TypeVar("Shape")
_LONGEST_NAME = 100


@dataclass(slots=True, eq=False)
class EndpointFault(Exception):  # noqa: N818 - never leaves this package: sentences are made of it
    """Why no answer came.

    Attributes:
        kind: "status" (an HTTP status that is no success), "unreachable", "timeout", "broken" (the connection ended
            in the middle), "huge", "garbled" (not the protocol) or "empty" (no choice in it).
        status: the HTTP status, 0 where there is none.
        message: what the server or the system says of it.
        param: the parameter that the server does not take, where it says so.
        code: the server's own word for the fault, where it has one.
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


def read_answer(raw: bytes) -> ModelReply:
    """Return the first choice of a completion.

    Raises:
        EndpointFault: it is none, it has no choice, or it is an error in the clothes of a success.
    """
    completion = _decoded(raw, _Completion)
    if completion.error and not completion.choices:
        raise read_error(200, raw, None)
    if not completion.choices:
        raise EndpointFault("empty")
    choice = completion.choices[0]
    parts = choice.message.content if isinstance(choice.message.content, list) else []
    content = choice.message.content if isinstance(choice.message.content, str) else ""
    usage = completion.usage if isinstance(completion.usage, dict) else {}
    return ModelReply(
        content=content or "".join(part.text or "" for part in parts),
        refusal=choice.message.refusal or next((part.refusal for part in parts if part.refusal), None),
        finish=choice.finish_reason,
        tool_calls=len(choice.message.tool_calls or ()),
        model="".join(letter for letter in completion.model or "" if letter.isprintable())[:_LONGEST_NAME],
        tokens=(_count(usage.get("prompt_tokens")), _count(usage.get("completion_tokens"))),
    )


def read_models(raw: bytes) -> tuple[str, ...]:
    """Return the names of the models that a server offers; raises EndpointFault where it is no list of them."""
    return tuple(model.id for model in _decoded(raw, _Models).data)


def read_error(status: int, raw: bytes, retry_after: str | None) -> EndpointFault:
    """Return the fault in a body of an HTTP error, in any of the usual shapes."""
    fault = EndpointFault("status", status, retry_after_s=_seconds(retry_after))
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
        raise EndpointFault("garbled", message="an HTML page" if is_page else str(fault)) from None


def _count(value: object) -> int:
    return value if isinstance(value, int) and 0 <= value < 1 << 40 else 0


def _seconds(retry_after: str | None) -> float | None:
    """Return the seconds of a Retry-After header, which holds a number of them or a date."""
    if not retry_after:
        return None
    try:
        seconds = float(retry_after)
        return max(seconds, 0.0) if seconds < 1e9 else None  # not a number is no time to wait either
    except ValueError:
        pass
    try:
        return max(parsedate_to_datetime(retry_after).timestamp() - time(), 0.0)
    except (ValueError, OverflowError):
        return None
