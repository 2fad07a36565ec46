"""How many files a reader meets who follows a recording into its map."""

import sys
import threading
from inspect import CO_OPTIMIZED
from pathlib import Path
from types import FrameType

from build_fakes import SETTINGS, Walk, register_fakes, write_beeps

import avlmaps.maps
from avlmaps.maps.build import build_map

MOST = 26
ROOT = Path(avlmaps.maps.__file__).parent


class _Entered:
    """Notes the files below ``maps/`` of which a function runs, until the finished map is opened."""

    def __init__(self) -> None:
        self.files: set[str] = set()
        self.done = False

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        code = frame.f_code
        if code.co_name == "read" and code.co_filename.endswith("maps/store/folder.py"):
            self.done = True
        runs = event == "call" and code.co_flags & CO_OPTIMIZED  # no body of a module or a class that is loaded now
        if runs and not self.done and code.co_filename.startswith(f"{ROOT}/"):
            self.files.add(str(Path(code.co_filename).relative_to(ROOT)))


def test_a_recording_passes_through_few_files_of_maps(tmp_path: Path) -> None:
    profile, walk = register_fakes(), Walk(audio=write_beeps(tmp_path / "beeps.flac"))
    entered = _Entered()
    threading.setprofile(entered)
    sys.setprofile(entered)
    try:
        build_map(walk, tmp_path / "a.avlmap", profile, SETTINGS, progress=False)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    through = {"build.py", "mapper.py", "finish.py", "store/folder.py", "audio/segmentation.py"}
    assert entered.done and through <= entered.files
    assert len(entered.files) <= MOST, f"{len(entered.files)} files of maps/ for one build: {sorted(entered.files)}"
