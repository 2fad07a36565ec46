"""`python -m training.language.nouns`: the nouns that writers use as names and that the word table does not have.

They go to ``src/avlmaps/language/nouns.txt``. A name whose head is one of them is no misspelling. The voices of the
first fold add none, so that what is measured on them holds for strangers.
"""

from pathlib import Path

from training.language.augment import targets_of
from training.language.pool import HELD_OUT, collected

from avlmaps.core.inflection import singulars_of
from avlmaps.language.intents import Kind
from avlmaps.language.names import is_known, may_name
from avlmaps.perception.embedded.words import is_word

_FILE = Path(__file__).parents[2] / "src/avlmaps/language/nouns.txt"


def main() -> None:
    """Run the command."""
    heads: set[str] = set()
    _FILE.write_text("", encoding="utf-8")
    for row in collected():
        if row.voice in HELD_OUT:
            continue
        for target in targets_of(row.meaning):
            head = target.name.lower().split()[-1:]
            if target.kind not in (Kind.OBJECT, Kind.AREA) or not head or not head[0].isalpha() or len(head[0]) < 3:
                continue
            if not is_known(head[0]) and not any(
                is_word(one) or may_name(one) for one in (head[0], *singulars_of(head[0]))
            ):
                heads.add(head[0])
    _FILE.write_text("\n".join(sorted(heads)) + "\n", encoding="utf-8")
    print(f"{len(heads)} nouns")


if __name__ == "__main__":
    main()
