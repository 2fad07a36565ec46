"""Programs that are small to write and large to check or to run, and a run over many of them that measures each.

The grammar loves what bounds are broken by: brackets in brackets, `and` in `or` in `and`, lists that hold one list many
times over, chains as long as a program may be, loops in loops, strings and tuples that grow.

Run as a script: python program_bounds.py COUNT SEED [--calls]; it prints one JSON object: the most processor time that
one program took to be parsed, run and told, and by how much the process grew. With --calls it counts the calls of
functions as well, which are as many on every processor; that takes three times as long.
"""

import json
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from time import process_time
from types import FrameType
from typing import Any

_MOST = 20_000
# Names by the kind of value that they keep, so that most programs pass the checks and run.
_NAMES = {
    "number": ("n", "m"), "truth": ("p", "q"), "list": ("a", "b"), "tuple": ("u", "v"), "string": ("s", "t"),
    "heat": ("h",),
}  # fmt: skip
_LEAVES = {
    "number": ("1", "0", "2.5", "7"),
    "truth": ("True", "False", "n < m", "1 in a", "u == v"),
    "list": ("[]", "[1]", "[u, s]"),
    "tuple": ("()", "(1, 2)", "(a, n)"),
    "string": ("'x'", "''", "'abc'"),
    "heat": ("get_map('x')", "get_map(s)"),
}  # fmt: skip
_KINDS = tuple(_NAMES)
_OF_ANY: tuple[Callable[[str, str], str], ...] = (
    lambda inner, other: f"({inner} and {other})" if "get_map" not in inner and inner[:1] != "h" else inner,
    lambda inner, other: f"({other} or {inner})",
    lambda inner, other: f"({inner} if {inner if len(inner) < 40 else 'p'} else {other})",
    lambda inner, other: f"({inner} if p else {other})",
    lambda inner, other: f"(p and {inner})",
    lambda inner, other: f"[{other}, {inner}][1]",
)
_OF_KIND: dict[str, tuple[Callable[[str, str], str], ...]] = {
    "number": (
        lambda inner, other: f"({inner} + {other})",
        lambda inner, other: f"-({inner})",
        lambda inner, other: f"({other} - ({inner})) % 7",
        lambda inner, other: f"len([{inner}, {other}])",
        lambda inner, other: f"max({inner}, {other}, a)"[:-4] + ")",
    ),
    "truth": (
        lambda inner, other: f"not ({inner})",
        lambda inner, other: f"(({inner}) == ({other}))",
        lambda inner, other: f"(({inner}) in [{other}, a])",
        lambda inner, other: f"(({inner} and {other}) or {inner if len(inner) < 60 else other})",
    ),
    "list": (lambda inner, other: f"[{inner}, {other}]", lambda inner, other: f"({inner} + {other})"),
    "tuple": (lambda inner, other: f"({inner}, {other})", lambda inner, other: f"({other} + {inner})"),
    "string": (lambda inner, other: f"({inner} + {other})",),
    "heat": (lambda inner, other: f"({inner} * {other})",),
}


def _leaf(random: Random, kind: str) -> str:
    if random.random() < 0.002:  # now and then of another kind
        kind = random.choice(_KINDS)
    return random.choice((*_NAMES[kind], *_NAMES[kind], *_LEAVES[kind]))


def _nested(random: Random, kind: str, deep: int) -> str:
    """Return an expression nested to a depth in one of its parts, with small ones beside it."""
    ways = _OF_KIND[kind] if kind == "heat" else (*_OF_ANY, *_OF_KIND[kind])
    text, chosen = _leaf(random, kind), random.sample(ways, random.randint(1, min(4, len(ways))))
    for _ in range(deep):
        text = random.choice(chosen)(text, _leaf(random, kind))
    return text


def _chain(random: Random, kind: str, most: int) -> str:
    """Return an expression as long as that, its parts side by side."""
    leaf = random.choice((*_NAMES[kind], *_LEAVES[kind][:2]))
    many = max(1, most // (len(leaf) + 5))
    if kind == "truth":
        return random.choice((" and ", " or ")).join([f"({leaf})"] * many)
    if kind == "number":
        return random.choice((f"max({', '.join([leaf] * (many + 1))})", f"len([{', '.join([leaf] * many)}])"))
    if kind in ("list", "tuple"):
        inside = random.choice(_NAMES[random.choice(("list", "tuple", "number", "string"))])
        brackets = "[]" if kind == "list" else "()"
        return brackets[0] + f"{inside}," * (most // (len(inside) + 1)) + brackets[1]
    sign = " * " if kind == "heat" else " + "
    return sign.join([leaf] * min(many, 45))


def _line(random: Random, most: int) -> str:
    kind = random.choice(_KINDS)
    name, other = random.choice(_NAMES[kind]), random.choice(_NAMES[kind])
    grown = {"list": "[{0}, {1}]", "tuple": "({0}, {1})", "truth": "a == b", "number": "{0} * {1}", "heat": "{0} * {1}"}
    return random.choice((
        lambda: f"{name} = {_nested(random, kind, random.randint(1, 22))}",
        lambda: f"{name} = {_nested(random, kind, random.randint(1, 47))}",
        lambda: f"{name} = {_chain(random, kind, min(most, random.choice((40, 400, 4000, 18_000))))}",
        lambda: f"{name} = {_chain(random, kind, min(most, random.choice((20, 200, 2000, 6000))))}",
        lambda: f"{name} = {name} + {other}" if kind in ("list", "tuple", "string", "number") else f"{name} = {other}",
        lambda: f"{name} = {grown.get(kind, '{0} + {1}').format(name, other)}",
        lambda: f"s = '{'x' * random.randint(0, min(most, random.choice((20, 500, 15_000))))}'",
        lambda: f"{random.choice(('move_to(s)', 'get_map(t)', 'move_to(h)', 'turn(n)', 'h = get_map(s) * h'))}",
        lambda: f"p = {random.choice(_NAMES['list'])} == {random.choice(('a', 'b', 'u', 's'))}",
        lambda: f"p = {random.choice(('s < t', 's == t', 'a in b', 'u in v', 'n in range(999999)', 'a != [b]'))}",
        lambda: f"n = {random.choice(('len(a)', 'len(s)', 'max(range(9))', 'max(range(99999))', 'abs(-n)'))}",
        lambda: f"{name} = {_leaf(random, kind)}",
    ))()  # fmt: skip


def _block(random: Random, most: int, deep: int) -> list[str]:
    """Return lines of about as many characters as given, in blocks down to a depth."""
    lines: list[str] = []
    while most > 0:
        if deep and random.random() < 0.3:
            through = (f"range({random.choice((3, 100, 10_000, 10**15))})", "a", "u", "[a, b]", "(u, v, u)")
            head = random.choice((f"for i in {random.choice(through)}:", f"if {_nested(random, 'truth', 3)}:"))
            found = [head, *("    " + line for line in _block(random, most // 2, deep - 1) or ["pass"])]
        else:
            found = [_line(random, most)]
        lines += found
        most -= sum(len(line) + 1 for line in found)
        if random.random() < 0.05:
            break
    return lines


def bounded_program(random: Random) -> str:
    """Return one program, of at most the characters that a program may have."""
    start = [f"{name} = {leaf}" for kind, names in _NAMES.items() for name in names for leaf in [_LEAVES[kind][0]]]
    text = "\n".join([*start, *_block(random, random.choice((200, 1000, 5000, 19_000, 19_000)), random.randint(0, 6))])
    while len(text) > _MOST:  # a block that lost its only line ends the program in its head
        text = text[: text.rindex("\n")].rstrip()
    return text + ("\n" if not text.endswith(":") else " pass\n")


def main(count: int, seed: int, count_calls: bool = False) -> dict[str, Any]:
    """Run as many programs with the budget that users have; return what the worst of them took."""
    import resource

    from avlmaps.core.errors import ProgramError
    from avlmaps.language.program import parse_program, run_program
    from helpers.recording_robot import RecordingRobot

    random, told, worst_s, worst = Random(seed), Counter[str](), 0.0, ""
    calls, most_calls = 0, 0

    def counted(_frame: FrameType, event: str, _what: object) -> None:
        nonlocal calls
        calls += event.endswith("call")

    run_program(parse_program("robot.move_to('chair')"), RecordingRobot())  # all that is loaded once is there now
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(count):
        if number and number % 1000 == 0:  # a run of hours says how far it is
            sys.stderr.write(f"{number} programs, worst {worst_s:.3f} s of processor time\n")
        text, trace = bounded_program(random), None
        began, calls = process_time(), 0
        sys.setprofile(counted if count_calls else None)
        try:
            program = parse_program(text)
            trace = run_program(program, RecordingRobot())
            json.dumps(trace.to_json(), allow_nan=False)
            trace.lines()
        except ProgramError:
            pass
        finally:
            sys.setprofile(None)
        took_s, most_calls = process_time() - began, max(most_calls, calls)
        told["ended" if trace and trace.ok else "stopped" if trace else "refused"] += 1
        if took_s > worst_s:
            worst_s, worst = took_s, text
    grown_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb) / 1024
    found = {"programs": count, **told, "worst_s": round(worst_s, 3), "grown_mb": round(grown_mb, 1), "worst": worst}
    return found | ({"most_calls": most_calls} if count_calls else {})


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    measured = main(int(sys.argv[1]), int(sys.argv[2]), "--calls" in sys.argv)
    measured["worst"] = measured["worst"][:300]
    print(json.dumps(measured))  # noqa: T201
