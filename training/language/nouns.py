"""`python -m training.language.nouns`: nouns that writers use as names and the word table lacks, and names of places.

They go to ``nouns.txt`` and ``places.txt`` of ``src/avlmaps/language``. A name whose head is one of the first is no
misspelling; one whose head is one of the second is a room or another area. The voices of the first fold add none, so
that what is measured on them holds for strangers.
"""

from collections import Counter
from pathlib import Path

from training.language.augment import targets_of
from training.language.pool import HELD_OUT, collected

from avlmaps.core.words import singulars_of
from avlmaps.language.intents import TargetKind
from avlmaps.language.lexer import WORDS
from avlmaps.language.names import is_known, may_name
from avlmaps.language.word_classes import listed
from avlmaps.perception.embedded.words import is_word

_FOLDER = Path(__file__).parents[2] / "src/avlmaps/language"
_OFTEN, _MOSTLY = 2, 0.6  # how often a head is said, and which share of that as an area


def main() -> None:
    """Run the command."""
    for name in ("nouns", "places"):
        (_FOLDER / f"{name}.txt").write_text("", encoding="utf-8")
    nouns: set[str] = set()
    said: Counter[tuple[str, TargetKind]] = Counter()
    for row in collected():
        if row.voice in HELD_OUT:
            continue
        targets = {target for target in targets_of(row.meaning) if target.kind in (TargetKind.OBJECT, TargetKind.AREA)}
        for head, kind in {(target.name.lower().split()[-1], target.kind) for target in targets}:
            if not head.isalpha() or len(head) < 3:
                continue
            said[head, kind] += 1
            known = is_known(head) or any(is_word(one) or may_name(one) for one in (head, *singulars_of(head)))
            if not known:
                nouns.add(head)
    places: set[str] = set()
    for (head, kind), count in list(said.items()):
        mostly = count >= _OFTEN and count >= _MOSTLY * (count + said[head, TargetKind.OBJECT])
        if kind is TargetKind.AREA and mostly and head not in WORDS and head not in listed("never"):
            places.add(head)
    for name, words in (("nouns", nouns), ("places", places)):
        (_FOLDER / f"{name}.txt").write_text("\n".join(sorted(words)) + "\n", encoding="utf-8")
        print(f"{len(words)} {name}")


if __name__ == "__main__":
    main()
