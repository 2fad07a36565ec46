"""One sentence for every way in which a chat server can fail to answer: what failed, and what to do."""

from avlmaps.language.chat.answer import quoted
from avlmaps.language.chat.protocol import EndpointFault
from avlmaps.language.chat.settings import ChatSettings, variable


def fault_sentence(fault: EndpointFault, settings: ChatSettings, model: str, attempts: int, offered: str) -> str:
    """Return the sentence for a fault.

    Args:
        fault: what happened.
        settings: of the server.
        model: the model that was called.
        attempts: how often it was called.
        offered: names of models that the server has, empty where it does not say.
    """
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
