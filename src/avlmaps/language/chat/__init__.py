"""From a command to a program by a chat model: any endpoint of the OpenAI protocol, hosted or on the same machine.

The extra `chat` brings the official client; it is imported when a model is called, not before.
"""

from avlmaps.language.chat.prompt import system_prompt
from avlmaps.language.chat.settings import ChatSettings
from avlmaps.language.chat.translator import ChatTranslator

__all__ = ["ChatSettings", "ChatTranslator", "system_prompt"]
