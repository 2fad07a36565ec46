"""``map.json`` with the checksum of what it says, as a program writes it that means what it says."""

import json

from avlmaps.maps.store.manifest_file import checksum_of


def signed(content: str) -> str:
    """Return the text of ``map.json`` with its checksum put right."""
    return json.dumps({**json.loads(content), "checksum": checksum_of(content.encode())})
