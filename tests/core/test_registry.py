"""Backends are found by kind and name, made once, and a missing one says how to get it."""

import re
from collections.abc import Iterator

import pytest

from avlmaps.core import registry
from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.registry import Backend, Kind


@pytest.fixture(autouse=True)
def only_for_this_test() -> Iterator[None]:
    before = dict(registry._registered)
    yield
    registry._registered.clear()
    registry._registered.update(before)
    registry.forget_loaded()


def test_a_registered_backend_is_loaded_once():
    registry.register(Backend(Kind.WORDS, "fractions", "fractions:Fraction"))
    first = registry.load(Kind.WORDS, "fractions")
    assert first == 0
    assert registry.load(Kind.WORDS, "fractions") is first


def test_registering_again_replaces_the_backend():
    registry.register(Backend(Kind.WORDS, "mine", "fractions:Fraction"))
    registry.load(Kind.WORDS, "mine")
    registry.register(Backend(Kind.WORDS, "mine", "collections:Counter"))
    assert type(registry.load(Kind.WORDS, "mine")).__name__ == "Counter"


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(BackendError, match=r"There is no place backend called 'nope'; known are: .*vlad"):
        registry.load(Kind.PLACE, "nope")


def test_a_backend_of_an_older_map_says_what_to_do():
    with pytest.raises(BackendError, match=r"'rootsift' is gone; .* build the map again"):
        registry.load(Kind.LOCAL, "rootsift")


def test_a_missing_package_names_the_extra_to_install():
    backend = Backend(Kind.VIEWS, "far", "far.away:Model", extra="foundation", needs=("no_such_package_here",))
    registry.register(backend)
    assert backend.missing == ("no_such_package_here",)
    with pytest.raises(BackendError, match=re.escape(f"get it with: {install_command('foundation')}")):
        registry.load(Kind.VIEWS, "far")


def test_a_missing_package_without_an_extra_is_named_itself():
    registry.register(Backend(Kind.VIEWS, "far", "far.away:Model", needs=("no_such_package_here",)))
    with pytest.raises(BackendError, match="get it with: pip install no_such_package_here"):
        registry.load(Kind.VIEWS, "far")


def test_backends_are_listed_in_order_without_importing_them():
    listed = registry.backends()
    assert [(b.kind, b.name) for b in listed] == sorted((b.kind, b.name) for b in listed)
    assert {b.kind for b in listed} >= {Kind.WORDS, Kind.SOUNDS, Kind.LOCAL}


def test_another_packages_entry_point_is_a_backend(monkeypatch: pytest.MonkeyPatch):
    class Entry:
        def __init__(self, name: str) -> None:
            self.name, self.value = name, "collections:Counter"

    found = [Entry("sounds:theirs"), Entry("nonsense:x"), Entry("sounds")]
    monkeypatch.setattr(registry, "entry_points", lambda group: found if group == registry.ENTRY_POINT_GROUP else [])
    assert Backend(Kind.SOUNDS, "theirs", "collections:Counter") in registry.backends()
    assert type(registry.load(Kind.SOUNDS, "theirs")).__name__ == "Counter"
    assert not any(b.name in ("x", "") for b in registry.backends())


@pytest.mark.parametrize("target", ["no_such_module_here:Model", "fractions:NoSuchClass"])
def test_a_backend_that_cannot_be_imported_is_told_by_its_place(target: str):
    registry.register(Backend(Kind.VIEWS, "broken", target))
    with pytest.raises(BackendError, match=f"^The views backend 'broken' cannot be loaded from {target} "):
        registry.load(Kind.VIEWS, "broken")
