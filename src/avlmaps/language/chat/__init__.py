"""From a command to a program by a chat model: any endpoint of the OpenAI protocol, hosted or on the same machine.

The protocol is spoken over HTTP by this package itself; nothing else has to be installed.
"""

from avlmaps.language.chat.settings import ChatSettings
from avlmaps.language.chat.translator import ChatTranslator, system_prompt

__all__ = ["ChatSettings", "ChatTranslator", "system_prompt"]
