"""From a command to a program by a chat model: any endpoint of the OpenAI protocol, hosted or on the same machine."""

from avlmaps.language.chat.endpoint import ChatSettings
from avlmaps.language.chat.translator import ChatTranslator, system_prompt

__all__ = ["ChatSettings", "ChatTranslator", "system_prompt"]
