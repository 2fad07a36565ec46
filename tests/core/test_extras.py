"""The command that installs an extra works where it is printed: in a clone, elsewhere, and for an installed package."""

import shlex
import tomllib
from pathlib import Path

import pytest

from avlmaps.core import extras

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def fresh() -> None:
    extras._clone.cache_clear()


@pytest.mark.parametrize("place", [ROOT, Path("/")])
def test_in_a_clone_pip_installs_from_the_clone(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    for extra in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]:
        pip, install, what = shlex.split(extras.install_command(extra))
        folder, _, rest = what.partition("[")
        assert (pip, install, rest) == ("pip", "install", f"{extra}]")
        assert (place / folder).resolve() == ROOT.resolve()


def test_a_package_is_installed_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Installed:
        url = ""

        def read_text(self, name: str) -> str | None:
            return self.url or None

    installed = Installed()
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "lib" / "avlmaps" / "core" / "extras.py"))
    monkeypatch.setattr("importlib.metadata.distribution", lambda name: installed)
    assert extras.install_command("ros", "more") == "pip install 'avlmaps[ros]' more"
    for url in ('{"url": "https://example.org/a.zip"}', '{"url": "file:///nowhere"}', "no json", "[]"):
        installed.url = url
        fresh_command = (extras._clone.cache_clear(), extras.install_command("ros"))[1]
        assert fresh_command == "pip install 'avlmaps[ros]'"
    installed.url = f'{{"url": "{ROOT.as_uri()}"}}'
    extras._clone.cache_clear()
    assert shlex.split(extras.install_command("ros"))[2].startswith((".", str(ROOT)))
