"""Hammer the parser with random word salads, injections and paths: python tests/language/hammer_parser.py COUNT [SEED].

Prints what is not an error of the family, goals for nonsense are not judged here, and the times a sentence takes.
"""

import sys
import time

from test_commands import salads

from avlmaps.core.errors import AvlmapsError
from avlmaps.language.commands import read_command
from avlmaps.language.program import parse_program
from avlmaps.language.program.writing import write_program
from avlmaps.language.questions import read_question


def main(count: int, seed: int) -> None:
    """Read so many sentences and print what came of them."""
    spent: list[float] = []
    driven = 0
    for text in salads(count, seed):
        begin = time.process_time()
        try:
            read = read_command(text)
            if read.stops is None:
                driven += 1
                parse_program(write_program(read.intents))
            read_question(text[:400])
        except AvlmapsError:
            pass
        except Exception as fault:  # noqa: BLE001
            sys.stdout.write(f"{type(fault).__name__}: {fault}: {text!r}\n")
        spent.append((time.process_time() - begin) * 1e3)
    spent.sort()
    sys.stdout.write(
        f"{count} sentences, {driven} with a program; {spent[count // 2]:.0f} ms median, "
        f"{spent[int(0.95 * count)]:.0f} ms for 95 %, {spent[-1]:.0f} ms at most\n"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
