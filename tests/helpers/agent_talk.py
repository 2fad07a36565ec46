"""An agent without a network: its messages go straight to a server of agents."""

import asyncio
import base64
import json
from collections.abc import Callable
from typing import Any

from avlmaps.serve.agents import AgentServer


class Agent:
    """Sends messages, and holds each answer to what the protocol wants of it."""

    def __init__(self, server: AgentServer) -> None:
        self.server, self._number = server, 0

    def ask(self, method: str, tell: Callable[[Any], None] | None = None, **params: Any) -> Any:
        """Return the result of a request, or its error."""
        self._number += 1
        message = {"jsonrpc": "2.0", "id": self._number, "method": method, "params": params}

        async def heard() -> Any:
            answer = await self.server.answer(message, tell)
            await asyncio.sleep(0)  # what was told from another thread
            return answer

        answer = json.loads(json.dumps(asyncio.run(heard())))
        assert (answer["jsonrpc"], answer["id"]) == ("2.0", self._number)
        return answer["result"] if "result" in answer else answer["error"]

    @property
    def tools(self) -> dict[str, Any]:
        """The tools by their names."""
        return {tool["name"]: tool for tool in self.ask("tools/list")["tools"]}

    def text(self, tool: str, **arguments: Any) -> str:
        """Return the one text that a tool answers, its picture or its error left out."""
        return self.ask("tools/call", name=tool, arguments=arguments)["content"][0]["text"]

    def call(self, tool: str, **arguments: Any) -> Any:
        """Return the JSON that a tool answers."""
        result = self.ask("tools/call", name=tool, arguments=arguments)
        assert not result.get("isError"), result
        assert len(result["content"]) == 1, "no picture that nobody wants"
        return json.loads(result["content"][0]["text"])

    def refused(self, tool: str, **arguments: Any) -> str:
        """Return the sentence of a tool that refuses a call."""
        result = self.ask("tools/call", name=tool, arguments=arguments)
        assert result["isError"] is True, result
        return result["content"][0]["text"]

    def drawn(self, tool: str, **arguments: Any) -> tuple[Any, bytes]:
        """Return the JSON and the picture that a tool answers."""
        text, picture = self.ask("tools/call", name=tool, arguments={**arguments, "picture": True})["content"]
        return json.loads(text["text"]), base64.b64decode(picture["data"])
