"""A server of the chat protocol, called through the official `openai` client.

The client makes the requests; attempts, the deadline, the limit on what is read and the sentences for faults are here,
the same for every server: one deadline holds all attempts, nothing endless is read, no redirect is followed (it would
carry the command elsewhere), no proxy stands before this very machine, and a key appears in no message.
"""

import os
import re
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from ssl import SSLContext
from threading import Thread
from time import monotonic, sleep
from typing import Any

from avlmaps.core.errors import LanguageError
from avlmaps.core.extras import install_command
from avlmaps.language.chat.answer import ModelReply, quoted
from avlmaps.language.chat.protocol import EndpointFault, read_answer, read_error, read_models
from avlmaps.language.chat.replay import ChatRequest
from avlmaps.language.chat.settings import NO_KEY, ChatSettings, variable


def fault_sentence(fault: EndpointFault, settings: ChatSettings, model: str, attempts: int, offered: str) -> str:
    """Return the sentence for a fault."""
    url = settings.shown_url
    match fault.kind:
        case "unreachable":
            start = "start the server there (Ollama: ollama serve)" if settings.on_this_machine else "check the network"
            return f"The chat server {url} cannot be reached ({fault.message}): {start}, or correct its address."
        case "timeout":
            return (
                f"{model!r} at {url} gave no answer within {settings.timeout_s:g} s: raise "
                f"{variable('timeout_s')}, or take a smaller model."
            )
        case "broken":
            return f"{url} broke off in the middle {_times(attempts)} ({fault.message}): look into the server's log."
        case "huge":
            return f"{url} answered with more than {fault.message}, which no program needs: ask another model."
        case "garbled":
            return (
                f"{url} does not speak the chat protocol: it answered with {_garbled(fault.message)}; its address "
                "must be that of the API, which mostly ends in /v1."
            )
        case "empty":
            return (
                f"{url} answered without any choice: look into the server's log, or ask another model than {model!r}."
            )
        case _:
            return _of_status(fault, settings, model, attempts, offered)


def _of_status(fault: EndpointFault, settings: ChatSettings, model: str, attempts: int, offered: str) -> str:
    url = settings.shown_url
    told = f"HTTP {fault.status}" + (f": {quoted(fault.message)}" if fault.message.strip() else "")
    match fault.status:
        case 401 | 403:
            key = "OPENAI_API_KEY" if settings.hosted else variable("api_key")
            held = "does not accept the key" if settings.api_key else "asks for a key"
            return f"{url} {held} ({told}): set {key} to one that may use {model!r}."
        case 404:
            mend = f"set {variable('model')} to one of {offered}" if offered else f"correct {variable('model')}"
            path = "" if offered or settings.hosted else ", or the address, which mostly ends in /v1"
            return f"{url} has no model {model!r} ({told}): {mend}{path}."
        case 429 if fault.code == "insufficient_quota":
            return f"The account at {url} has no credit left ({told}): add some, or ask a server of your own."
        case 429:
            wait = f"in {fault.retry_after_s:.0f} s" if fault.retry_after_s else "later"
            return f"{url} has had too many requests ({told}): try again {wait}."
        case status if 300 <= status < 400:
            return f"{url} sends on to another address ({told}): give that one, if it is meant."
        case status if status >= 500:
            return f"{url} failed {_times(attempts)} ({told}): try again later, or look into the server's log."
        case _:
            return (
                f"{url} does not take the request ({told}): ask another model than {model!r}, or change the settings."
            )


def _garbled(message: str) -> str:
    return message if message == "an HTML page" else f"something that is not what it should be ({quoted(message)})"


def _times(attempts: int) -> str:
    return "once" if attempts == 1 else f"{attempts} times"


MOST_BYTES = 1 << 20
_MOST_ERROR_BYTES = 1 << 16
_MOST_MODELS_WAIT_S = 10.0
_SHORTEST_KEY = 8
_BUSY = frozenset({408, 425, 429, 500, 502, 503, 504, 529})
# Headers that the client adds for the hosted service alone; the one it reads back from its own request has to stay.
_FOR_THE_HOSTED = re.compile(r"openai-(?:organization|project)|x-stainless-(?!raw-response)")


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
        self._deadline = 0.0
        self._openai, self._http = _client_library()
        self._http_error: type[Exception] = self._http.HTTPError

    def complete(self, request: ChatRequest) -> ModelReply:
        """Return the server's answer to a request.

        Raises:
            LanguageError: none came; one sentence says why and what to do.
        """
        self._deadline = monotonic() + self._settings.timeout_s
        attempt = 0
        while True:
            try:
                answer = read_answer(self._asked("chat", **self._parameters(request)))
                return replace(answer, content=self._without_key(answer.content))
            except EndpointFault as fault:
                if self._adapted(fault):
                    continue
                wait_s = self._wait_s(fault, attempt)
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
        """Return the models that the server offers, none where it does not say."""
        self._deadline = monotonic() + min(self._settings.timeout_s, _MOST_MODELS_WAIT_S)
        try:
            return read_models(self._asked("models"))
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
        messages = [{"role": message.role, "content": message.content} for message in request.messages]
        kept = {name: value for name, value in optional.items() if value is not None and name not in self.left_out}
        return {"model": request.model, "messages": messages, **kept}

    def _asked(self, resource: str, **parameters: Any) -> bytes:
        """Return the body of one request's answer; raises EndpointFault where none came before the deadline.

        The HTTP library bounds each read, but not all of them together (headers that trickle in have no end), nor the
        search for the host's name. So a thread asks, and is left where it is late, its connection closed under it.
        """
        deadline = self._deadline
        answer: Future[bytes] = Future()
        with self._client(deadline) as client:

            def ask() -> None:
                try:
                    answer.set_result(self._exchanged(client, resource, parameters, deadline))
                except BaseException as fault:  # noqa: BLE001 - raised below, where it is waited for
                    answer.set_exception(fault)

            Thread(target=ask, name="avlmaps-chat", daemon=True).start()
            try:
                return answer.result(max(deadline - monotonic(), 0.01))
            except (self._openai.OpenAIError, self._http_error) as fault:
                raise _endpoint_fault(fault) from None
            except TimeoutError:
                raise EndpointFault("timeout") from None

    def _exchanged(self, client: Any, resource: str, parameters: dict[str, Any], deadline: float) -> bytes:
        """Return the body of an answer to one request, however long it takes until it begins."""
        ask = client.models.with_streaming_response.list
        if resource == "chat":
            ask = client.chat.completions.with_streaming_response.create
        with ask(**parameters, timeout=max(deadline - monotonic(), 0.01)) as response:
            return _read(response.iter_bytes(), MOST_BYTES, deadline)

    def _client(self, deadline: float) -> Any:
        """Return a new client: one for each request, so that no connection is left open between commands."""

        def on_response(response: Any) -> None:
            self._on_response(response, deadline)

        trust_env = not self._settings.on_this_machine
        return self._openai.OpenAI(
            api_key=self._settings.api_key or NO_KEY,
            base_url=self._settings.base_url,
            max_retries=0,
            http_client=self._openai.DefaultHttpxClient(
                verify=_trusted(self._http, trust_env, os.environ.get("SSL_CERT_FILE"), os.environ.get("SSL_CERT_DIR")),
                trust_env=trust_env,
                follow_redirects=False,
                event_hooks={"request": [self._on_request], "response": [on_response]},
            ),
        )

    def _on_request(self, request: Any) -> None:
        """Take away what the client adds from the environment of the hosted service when another is called."""
        if not self._settings.hosted:
            for header in [name for name in request.headers if _FOR_THE_HOSTED.match(name)]:
                del request.headers[header]

    def _on_response(self, response: Any, deadline: float) -> None:
        """Stop at every status that is no success, before the client reads a body without limit."""
        if response.status_code >= 300:
            try:
                body = _read(response.iter_bytes(), _MOST_ERROR_BYTES, deadline)
            except (EndpointFault, self._http_error):
                body = b""
            fault = read_error(response.status_code, body, response.headers.get("retry-after"))
            if response.status_code < 400:
                fault.message = str(response.headers.get("location", ""))
            raise fault

    def _adapted(self, fault: EndpointFault) -> bool:
        """Leave out, or name otherwise, the parameter that the server does not take; return whether there was one."""
        if fault.status not in (400, 422):
            return False
        if _names(fault, "max_tokens") and self._most_tokens_word == "max_tokens":
            self._most_tokens_word = "max_completion_tokens"
            return True
        for name in ("temperature", "seed"):
            if name not in self.left_out and _names(fault, name):
                self.left_out.append(name)
                return True
        return False

    def _wait_s(self, fault: EndpointFault, attempt: int) -> float | None:
        """Return how long to wait before another attempt, None where there is to be none."""
        passes = fault.kind == "broken" or (fault.status in _BUSY and fault.code != "insufficient_quota")
        if not passes or attempt >= self._settings.retries:
            return None
        wait_s = min(0.5 * 2**attempt, 8.0) if fault.retry_after_s is None else fault.retry_after_s
        return wait_s if monotonic() + wait_s < self._deadline else None

    def _sentence(self, fault: EndpointFault, model: str, attempts: int) -> str:
        offered = self._models() if fault.status == 404 and not self._settings.hosted else ()
        sentence = fault_sentence(fault, self._settings, model, attempts, _listed(offered))
        return self._without_key(sentence)

    def _without_key(self, text: str) -> str:
        """Return a text without the key, which some servers repeat; what is shorter than any key is none."""
        key = self._settings.api_key or ""
        return text.replace(key, "…") if len(key) >= _SHORTEST_KEY else text


def _client_library() -> tuple[Any, Any]:
    """Return the official client and its HTTP library, which differs between its versions."""
    try:
        import openai
    except ImportError:
        raise LanguageError(f"The chat models need the openai client: {install_command('chat')}") from None
    return openai, import_module(openai.DefaultHttpxClient.__mro__[1].__module__.partition(".")[0])


@lru_cache(maxsize=4)
def _trusted(http_library: Any, trust_env: bool, *_environment: str | None) -> SSLContext:
    """Return the certificates that the HTTP library trusts, read once: reading them takes longer than a request."""
    return http_library.create_ssl_context(trust_env=trust_env)


def _read(chunks: Iterator[bytes], most: int, deadline: float) -> bytes:
    """Return a body; one that is too long, or that trickles in beyond the deadline, raises EndpointFault."""
    body = bytearray()
    for chunk in chunks:
        body += chunk
        if len(body) > most:
            raise EndpointFault("huge", message=f"{most >> 10} KiB")
        if monotonic() > deadline:
            raise EndpointFault("timeout")
    return bytes(body)


def _endpoint_fault(fault: Exception) -> EndpointFault:
    """Return the meaning of an error of the client or of its HTTP library."""
    causes: list[BaseException] = [fault]
    while (cause := causes[-1].__cause__ or causes[-1].__context__) is not None and cause not in causes:
        causes.append(cause)
    ours = next((cause for cause in causes if isinstance(cause, EndpointFault)), None)
    if ours is not None:
        return ours
    names = {type(cause).__name__ for cause in causes}
    if names & {"APITimeoutError", "ReadTimeout", "ConnectTimeout", "WriteTimeout", "PoolTimeout"}:
        return EndpointFault("timeout")
    reason = next((str(cause) for cause in reversed(causes) if str(cause)), type(fault).__name__)
    if "DecodingError" in names:
        return EndpointFault("garbled", message=reason)
    return EndpointFault("unreachable" if names & {"ConnectError", "ProxyError"} else "broken", message=reason)


def _names(fault: EndpointFault, parameter: str) -> bool:
    return fault.param == parameter or (not fault.param and bool(re.search(rf"\b{parameter}\b", fault.message)))


def _listed(models: tuple[str, ...], most: int = 8) -> str:
    return ", ".join(models[:most]) + (f" and {len(models) - most} more" if len(models) > most else "")
