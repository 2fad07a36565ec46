"""`python -m training.language.local_measure MODEL`: the reader, a local language model, and both on commands.

Commands come from a list that the reader was not fitted to (held_out.jsonl, or `--commands`), from a sample of the
lists of `avlmaps bench language`, and from sentences that are no order (tests/language/commands/gate_held_out.tsv, or
another table whose column `is` says "no"). What the model wrote is kept in a file: a run goes on where it ended.
"""

import argparse
import csv
import json
import random
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from training.language.rows import LISTS, lists

from avlmaps.core.errors import LanguageError
from avlmaps.language.commands import UnclearError, check_order, read_command
from avlmaps.language.intents import Clarify, Intent, Refuse, to_json
from avlmaps.language.learned.decision import Weighed
from avlmaps.language.local import LocalModel, LocalTranslator, Written
from avlmaps.language.sentence import Attachments
from avlmaps_sim.bench.language import Row, judge_intents, read_list

WAYS = ("reader", "model", "both")
_HELD_OUT = "held out"


class KeptModel(LocalModel):
    """A local model whose answers are kept in a file."""

    def __init__(self, model: str, kept: Path) -> None:
        self.kept = kept
        lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
        self._answers: dict[str, Any] = {row["command"]: row for row in map(json.loads, lines)}
        self._model = model
        self._loaded: LocalModel | None = None
        self.seconds: list[float] = []
        self.read: list[tuple[int, int]] = []

    def has(self, command: str) -> bool:
        """Return whether a program for a command was kept."""
        return command in self._answers

    def write(self, command: str, tokens: Sequence[Any]) -> Written:
        """Return the program of before, or ask the model."""
        if command not in self._answers:
            self._loaded = self._loaded or LocalModel(self._model)
            began = time.process_time()
            written = self._loaded.write(command, tokens)
            row = {"command": command, "program": written.program, "tokens": written.tokens,
                   "cpu_s": time.process_time() - began}  # fmt: skip
            self._answers[command] = row
            with self.kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row, ensure_ascii=False) + "\n")
        row = self._answers[command]
        self.seconds.append(row["cpu_s"])
        self.read.append(tuple(row["tokens"]))
        return Written(row["program"], tuple(row["tokens"]))


@dataclass(frozen=True, slots=True)
class Said:
    """A sentence, and what it should do: a row of a list, or None where it is no order."""

    text: str
    row: Row | None
    list: str


def sentences(commands: Path, no_orders: Path, count: int, seed: int) -> list[Said]:
    """Return commands of a list held out, of the other lists, and sentences that are no order, mixed."""
    draw = random.Random(seed)
    held = [(_HELD_OUT, row) for row in read_list(commands)]
    others = [(path.stem, row) for path in lists()["blind"] for row in read_list(path)]
    found: list[Said] = []
    for rows in (held, others):
        usable = [(name, row) for name, row in rows if "intents" in row and row.get("say") and not row.get("image")
                  and not row.get("clip")]  # fmt: skip
        found += [Said(str(row["say"]), row, name) for name, row in draw.sample(usable, min(len(usable), count))]
    with no_orders.open(encoding="utf-8", newline="") as file:
        closed = [row["sentence"] for row in csv.DictReader(file, delimiter="\t") if row["is"] == "no"]
    found += [Said(text, None, "no order") for text in draw.sample(closed, min(len(closed), count))]
    draw.shuffle(found)
    return found


def _by_reader(said: Said, translator: LocalTranslator) -> Sequence[Intent]:
    return read_command(said.text).intents


def _by_model(said: Said, translator: LocalTranslator) -> Sequence[Intent]:
    """Return what the model alone makes of a sentence, behind the gate and the dangers."""
    check_order(said.text)
    proposed: Weighed | None = translator.proposed(said.text)
    return (Clarify(),) if proposed is None else proposed.intents


def _by_both(said: Said, translator: LocalTranslator) -> Sequence[Intent]:
    return translator.read(said.text).intents


def outcome(said: Said, read: Callable[[Said, LocalTranslator], Sequence[Intent]], translator: LocalTranslator) -> str:
    """Return what became of a sentence: right, harmless, offered, asked back, misread; drives or stays for no order."""
    try:
        intents = read(said, translator)
    except UnclearError as asked:
        intents = (Clarify(str(asked), asked.choices),)
    except LanguageError:
        intents = (Clarify(),)
    stops = isinstance(intents[0], Refuse | Clarify)
    if said.row is None:
        return "stays" if stops else "drives"
    judged = judge_intents([to_json(one) for one in intents], said.row)
    if judged == "misread" and said.row.get("danger"):
        return "danger"
    return "offered" if judged == "asked back" and stops and _offers(intents[0], said.row) else judged


def _offers(question: Intent, row: Row) -> bool:
    """Return whether one of the answers that a question offers is what was meant."""
    for choice in getattr(question, "choices", ()):
        order = choice.removeprefix("I will ").rstrip(".")
        try:
            intents = read_command(order).intents
        except LanguageError:
            continue
        if judge_intents([to_json(one) for one in intents], row) == "right":
            return True
    return False


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m training.language.local_measure", description=__doc__)
    parser.add_argument("model", help="a GGUF file, or the address of a llama.cpp server")
    parser.add_argument(
        "--commands", type=Path, default=Path(__file__).parent / "held_out.jsonl", help="a list that is held out"
    )
    parser.add_argument(
        "--no-orders", type=Path, default=LISTS / "gate_held_out.tsv", help="sentences that are no order"
    )
    parser.add_argument("--count", type=int, default=50, help="sentences of each of the three sources")
    parser.add_argument("--answers", type=Path, default=Path("local_answers.jsonl"), help="what the model wrote")
    parser.add_argument("--most", type=int, default=1000, help="sentences in all")
    parser.add_argument("--alone", action="store_true", help="ask the model about every order, not only unsure ones")
    parser.add_argument("--seed", type=int, default=1, help="of the choice of sentences")
    given = parser.parse_args()
    model = KeptModel(given.model, given.answers)
    translator = LocalTranslator(model, replace(Attachments(), at=None))
    ways = dict(zip(WAYS, (_by_reader, _by_model, _by_both), strict=True))
    counts: dict[tuple[str, str], Counter[str]] = {}
    for number, said in enumerate(sentences(given.commands, given.no_orders, given.count, given.seed)[: given.most], 1):
        for way, read in ways.items():
            if way == "model" and not given.alone and not model.has(said.text):
                continue
            kind = "no orders" if said.row is None else _HELD_OUT if said.list == _HELD_OUT else "other lists"
            became = outcome(said, read, translator)
            counts.setdefault((kind, way), Counter())[became] += 1
        if number % 10 == 0:
            _print(counts, model)
    _print(counts, model)


def _print(counts: dict[tuple[str, str], Counter[str]], model: KeptModel) -> None:
    columns = ("right", "harmless", "offered", "asked back", "misread", "danger", "stays", "drives")
    print(f"| sentences | way | {' | '.join(columns)} |\n|---|---|{'---|' * len(columns)}")
    for (kind, way), found in sorted(counts.items()):
        print(f"| {sum(found.values())} {kind} | {way} | {' | '.join(str(found[name]) for name in columns)} |")
    asked = max(1, len(model.seconds))
    read, written = (sum(each[at] for each in model.read) / asked for at in (0, 1))
    seconds = sum(model.seconds) / asked
    print(f"a sentence: {read:.0f} tokens read, {written:.0f} written, {seconds:.1f} CPU s", flush=True)


if __name__ == "__main__":
    main()
