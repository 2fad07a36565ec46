"""Settings come from what is given, then the environment, then the defaults; a key goes only where it belongs."""

from pathlib import Path
from typing import Any

import pytest

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.settings import HOSTED_URL, ChatSettings


def test_the_defaults_are_the_hosted_service_and_choices_that_repeat() -> None:
    settings = ChatSettings.from_environment({})
    assert settings == ChatSettings()
    assert (settings.base_url, settings.temperature, settings.seed, settings.api_key) == (HOSTED_URL, 0.0, 0, None)
    assert settings.hosted and not settings.on_this_machine


def test_every_setting_can_come_from_the_environment() -> None:
    environment = {
        "AVLMAPS_CHAT_MODEL": " qwen ",
        "AVLMAPS_CHAT_BASE_URL": "http://localhost:11434/v1",
        "AVLMAPS_CHAT_API_KEY": "key",
        "AVLMAPS_CHAT_TIMEOUT_S": "7.5",
        "AVLMAPS_CHAT_RETRIES": "1",
        "AVLMAPS_CHAT_ROUNDS": "0",
        "AVLMAPS_CHAT_TEMPERATURE": "None",
        "AVLMAPS_CHAT_MAX_TOKENS": "64",
        "AVLMAPS_CHAT_SEED": "none",
        "AVLMAPS_CHAT_REPLAY": "chat.jsonl",
    }
    assert ChatSettings.from_environment(environment) == ChatSettings(
        model="qwen",
        base_url="http://localhost:11434/v1",
        api_key="key",
        timeout_s=7.5,
        retries=1,
        rounds=0,
        temperature=None,
        max_tokens=64,
        seed=None,
        replay=Path("chat.jsonl"),
    )


@pytest.mark.parametrize(
    ("environment", "given", "key"),
    [
        ({"OPENAI_API_KEY": "k"}, {}, "k"),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1/"}, {}, "k"),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1/"}, {"base_url": "http://lab:8000/v1"}, "k"),
        ({"OPENAI_API_KEY": "k"}, {"base_url": "http://lab:8000/v1"}, None),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1"}, {"base_url": HOSTED_URL}, None),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_BASE_URL": "http://lab:8000/v1"}, {}, None),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_API_KEY": "c"}, {"base_url": "http://lab:8000/v1"}, "c"),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_API_KEY": "c"}, {}, "c"),
        ({"OPENAI_API_KEY": "  "}, {}, None),
    ],
)
def test_a_key_goes_to_its_own_address_and_to_no_other(
    environment: dict[str, str], given: dict[str, str], key: str | None
) -> None:
    assert ChatSettings.from_environment(environment, **given).api_key == key


@pytest.mark.parametrize(
    ("url", "is_here"),
    [
        ("http://localhost:11434/v1", True),
        ("http://127.0.0.1/v1", True),
        ("http://127.8.9.1:1/v1", True),
        ("http://[::1]:8000/v1", True),
        ("http://ollama.localhost/v1", True),
        ("http://192.168.0.2/v1", False),
        ("http://localhost.example.org/v1", False),
        ("https://127.0.0.1.example.org/v1", False),
        (HOSTED_URL, False),
    ],
)
def test_which_addresses_are_of_this_machine(url: str, is_here: bool) -> None:
    assert ChatSettings(base_url=url).on_this_machine == is_here


def test_a_password_in_an_address_is_not_shown() -> None:
    settings = ChatSettings(base_url="https://me:secret@lab.example:8443/v1/?token=secret")
    assert settings.shown_url == "https://lab.example:8443/v1"
    assert ChatSettings(base_url="http://[::1]:8/v1").shown_url == "http://[::1]:8/v1"


@pytest.mark.parametrize(
    "url", ["", "localhost:11434", "ftp://x/v1", "http://", "http://x:port/v1", "http://[::1/v1", "http://a b/", "h\n"]
)
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(LanguageError, match="no address of a chat server; give one like"):
        ChatSettings(base_url=url)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"timeout_s": 0.0}, "timeout_s is 0.0; give"),
        ({"timeout_s": float("nan")}, "timeout_s is nan; give"),
        ({"rounds": -1}, "rounds is -1; give 0 to 10"),
        ({"retries": 11}, "retries is 11; give 0 to 10"),
        ({"temperature": 2.5}, "temperature is 2.5; give 0 to 2"),
        ({"temperature": float("nan")}, "temperature is nan"),
        ({"max_tokens": 0}, "max_tokens is 0; give 1 to"),
        ({"base_url": "http://api.openai.com/v1"}, "sent the key in clear; give https://api.openai.com/v1"),
        ({"base_url": "http://API.openai.com:443"}, "sent the key in clear"),
        ({"api_key": "sk-\nx"}, "key for the chat model holds characters"),
        ({"api_key": "schlüssel"}, "key for the chat model holds characters"),
    ],
)
def test_what_no_setting_can_be_is_refused(given: dict[str, Any], why: str) -> None:
    with pytest.raises(LanguageError, match=why) as told:
        ChatSettings(**given)
    assert "schlüssel" not in str(told.value)


@pytest.mark.parametrize(
    ("name", "text", "wanted"),
    [
        ("TIMEOUT_S", "soon", "a number of seconds"),
        ("SEED", "1.5", "a whole number or 'none'"),
        ("ROUNDS", "two", "whole"),
    ],
)
def test_a_variable_that_holds_something_else_is_named(name: str, text: str, wanted: str) -> None:
    with pytest.raises(LanguageError, match=f"The variable AVLMAPS_CHAT_{name} is {text!r}; give .*{wanted}"):
        ChatSettings.from_environment({f"AVLMAPS_CHAT_{name}": text})
