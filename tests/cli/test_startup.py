"""The package, the command line and its help load nothing heavy."""

import subprocess
import sys

import pytest

HEAVY = {"numpy", "scipy", "cv2", "numba", "onnxruntime", "matplotlib", "soundfile", "av", "rosbags", "torch"}


def loaded_by(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint(' '.join(sorted({{name.partition('.')[0] for name in sys.modules}})))"
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    return set(out.splitlines()[-1].split())


@pytest.mark.parametrize("words", [["--help"], ["query", "--help"]])
def test_the_package_and_help_load_no_heavy_library(words: list[str]) -> None:
    quiet = "contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit)"
    code = f"import io, contextlib, avlmaps\nfrom avlmaps.cli import main\nwith {quiet}: main({words})"
    assert loaded_by(code) & HEAVY == set()


def test_every_public_name_can_be_had() -> None:
    import avlmaps

    for name in avlmaps.__all__:
        assert getattr(avlmaps, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        avlmaps.nothing  # noqa: B018


def test_ctrl_c_while_the_command_line_is_loading_ends_in_a_sentence() -> None:
    interrupt = (
        "import builtins\nreal = builtins.__import__\n"
        "def load(name, *rest):\n    if name == 'tyro': raise KeyboardInterrupt\n    return real(name, *rest)\n"
        "builtins.__import__ = load\nfrom avlmaps.cli import main\nmain(['--help'])"
    )
    done = subprocess.run([sys.executable, "-c", interrupt], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "avlmaps: stopped\n")
