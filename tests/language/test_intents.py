"""The laws of typed intents."""

from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.intents import Go, Target, TargetKind
from avlmaps.language.program.writing import write_program

NAMES = st.sampled_from(["lamp", "table", "sofa", "door", "plant"])
LEAVES = st.builds(Target, st.sampled_from([TargetKind.OBJECT, TargetKind.AREA, TargetKind.SOUND]), NAMES)
CHAINS = st.recursive(
    LEAVES, lambda inner: st.builds(Target, st.just(TargetKind.OBJECT), NAMES, st.lists(inner, max_size=2).map(tuple))
)


def said(target: Target) -> set[str]:
    """Return every name in a target, before it is made."""
    return {target.name, *(name for one in target.near for name in said(one))}


@given(NAMES, st.lists(CHAINS, min_size=1, max_size=3))
def test_no_part_of_a_chain_is_lost_in_the_program(name: str, near: list[Target]) -> None:
    target = Target(TargetKind.OBJECT, name, tuple(near))
    assert all(not one.near for one in target.near)
    program = write_program((Go(target),))
    for word in set().union({name}, *(said(one) for one in near)):
        assert f'"{word}"' in program


def test_a_chain_keeps_the_order_of_its_words() -> None:
    table = Target(TargetKind.OBJECT, "table", (Target(TargetKind.OBJECT, "sofa"), Target(TargetKind.AREA, "kitchen")))
    lamp = Target(TargetKind.OBJECT, "lamp", (table, Target(TargetKind.OBJECT, "door")))
    assert [one.name for one in lamp.near] == ["table", "sofa", "kitchen", "door"]
