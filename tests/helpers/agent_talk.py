"""What a tool of the agents' server answered, in the SDK's own client."""

import json
from typing import Any


def told(result: Any) -> Any:
    """Return the JSON of an answer; it is one text, which is not repeated as structured content."""
    assert not result.is_error, result.content
    assert result.structured_content is None
    return json.loads(result.content[0].text)


def texts(result: Any) -> list[str]:
    """Return the texts of an answer or an error."""
    return [part.text for part in result.content if part.type == "text"]
