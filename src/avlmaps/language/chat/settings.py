"""The settings of a chat translator: which model, where it is, and how long to wait for it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from avlmaps.core.errors import LanguageError
from avlmaps.core.machine import is_loopback

HOSTED_URL = "https://api.openai.com/v1"
_PREFIX = "AVLMAPS_CHAT_"
# The least and the most of a setting that is a number.
_BOUNDS = {
    "timeout_s": (0.001, 86400), "retries": (0, 10), "rounds": (0, 10), "max_tokens": (1, 1_000_000),
    "temperature": (0, 2),
}  # fmt: skip
_KINDS = {
    "timeout_s": (float, "a number of seconds"), "retries": (int, "a whole number"), "rounds": (int, "a whole number"),
    "temperature": (float, "a number or 'none'"), "max_tokens": (int, "a whole number"),
    "seed": (int, "a whole number or 'none'"), "replay": (Path, "the path of a file"),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatSettings:
    """Which chat model writes programs, where it is served, and within which limits.

    ``from_environment`` fills what is not given from ``AVLMAPS_CHAT_MODEL``, ``AVLMAPS_CHAT_TIMEOUT_S`` and so on.
    """

    model: str | None = None
    """Name of the model; without one, the only model that a server offers, or the one that was recorded."""
    base_url: str = HOSTED_URL
    """Address of the API; that of a server on the same machine ends in /v1 mostly."""
    api_key: str | None = field(default=None, repr=False)
    """The key; servers on the same machine mostly need none. Better set in the environment than on a command line."""
    timeout_s: float = 120.0
    """Seconds to wait for the program of one command, with all attempts and corrections."""
    retries: int = 2
    """How often a request is sent again where the server is busy, fails, or breaks off."""
    rounds: int = 2
    """How often the model may correct a program that cannot be used or that failed while it ran."""
    temperature: float | None = 0.0
    """How freely the model chooses its words, 0 to 2; none: as the server likes."""
    max_tokens: int = 2048
    """Most tokens of an answer, with what a reasoning model thinks."""
    seed: int | None = 0
    """Seed of the model's choices; none: as the server likes."""
    replay: Path | None = None
    """A JSONL file: written with every exchange where it is missing, else read instead of calling the model."""

    def __post_init__(self) -> None:
        split = _split(self.base_url)
        if split is None or split.scheme not in ("http", "https") or not split.hostname:
            shown = "What was given" if "@" in self.base_url else repr(self.base_url)  # a password is not repeated
            raise LanguageError(
                f"{shown} is no address of a chat server; give one like {HOSTED_URL} or http://localhost:11434/v1."
            )
        if self.hosted and split.scheme != "https":
            raise LanguageError(f"{self.shown_url} would be sent the key in clear; give {HOSTED_URL}.")
        if self.api_key is not None and not (self.api_key.isascii() and self.api_key.isprintable()):
            raise LanguageError("The key for the chat model holds characters that no key has; copy it again.")
        if self.temperature is not None:  # 0 and 0.0 are one request
            object.__setattr__(self, "temperature", float(self.temperature))
        for name, (least, most) in _BOUNDS.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise LanguageError(f"The chat setting {name} is {value}; give {least} to {most}.")

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ, **given: Any) -> "ChatSettings":
        """Return the settings that are given, and for what is not given (or None) those of the environment.

        ``OPENAI_BASE_URL`` and ``OPENAI_API_KEY`` are a pair: the key goes to that address (or the hosted one where
        none is set) and to no other; for another address there is ``AVLMAPS_CHAT_API_KEY``.

        Args:
            environment: variables by name.
            given: fields of the settings.

        Raises:
            LanguageError: a variable does not hold what its setting needs.
        """
        chosen = {name: value for name, value in given.items() if value is not None}
        for each in fields(cls):
            text = environment.get(_PREFIX + each.name.upper(), "").strip()
            if text and each.name not in chosen:
                chosen[each.name] = _read(each.name, text)
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


def _split(url: str) -> SplitResult | None:
    """Return the parts of an address; None where it has a port that is no number, or a broken IPv6 address."""
    try:
        split = urlsplit(url)
        _ = split.port
    except ValueError:
        return None
    return split if url.isprintable() and " " not in url else None


def _read(name: str, text: str) -> Any:
    kind, wanted = _KINDS.get(name, (str, "text"))
    if name in ("temperature", "seed") and text.lower() == "none":
        return None
    try:
        return kind(text)
    except ValueError:
        raise LanguageError(f"The variable {_PREFIX}{name.upper()} is {text!r}; give {wanted}.") from None
