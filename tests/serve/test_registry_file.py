"""``server.json`` describes this release, as the MCP registry wants it, and its words start the server."""

import json
import re
from pathlib import Path

from avlmaps.core.version import __version__

ROOT = Path(__file__).resolve().parents[2]


def test_server_json_is_of_this_release() -> None:
    entry = json.loads((ROOT / "server.json").read_text(encoding="utf-8"))
    (package,) = entry["packages"]
    assert entry["version"] == package["version"] == __version__
    assert re.fullmatch(r"[a-zA-Z0-9.-]+/[a-zA-Z0-9._-]+", entry["name"])
    assert len(entry["description"]) <= 100
    assert package["identifier"] == "avlmaps"
    assert package["transport"] == {"type": "stdio"}
    assert f"avlmaps=={__version__}" == package["runtimeArguments"][0]["value"]
    assert [one.get("value") or one.get("name") or one["valueHint"] for one in package["packageArguments"]] == [
        "serve", "map", "--stdio",
    ]  # fmt: skip
