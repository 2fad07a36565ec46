"""The build: stretches of frames that add up, frames that cannot be read, and folders that are not to be touched."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "recordings"))
