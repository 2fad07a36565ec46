"""Programs that want out, and a run over many of them in a process that tells of everything they reach.

Run as a script: python hostile_programs.py COUNT SEED FILE [--leak | --hang]; it prints one JSON object. FILE holds
the number of the program that is run, so that one that never ends is known. With --leak the parser is replaced by one
that lets Python run code, with --hang by one that never ends, to show that the watch over the process sees it.
"""
# ruff: noqa: E501 -- tables of programs

import json
import os
import signal
import sys
from collections import Counter
from collections.abc import Callable
from random import Random
from typing import Any

VALID = (
    'robot.move_to("chair")\n',
    'a = robot.get_major_map(obj="backpack")\nb = robot.get_map(sound="glass breaking")\n'
    "robot.move_to(robot.get_max_pos_3d(a * b))\n",
    'img = robot.load_image("./006899.png")\np = robot.get_max_pos_3d(robot.get_major_map(img=img))\n'
    'q = robot.get_pos("backpack")\nmiddle = (p + q) / 2\nrobot.move_to(middle)\n',
    "for i in range(4):\n    robot.move_forward(1.5)\n    robot.turn(90)\n",
    'for name in ["sofa", "table", "lamp"]:\n    if name == "table":\n        continue\n    robot.move_to_left(name)\n',
    "n = 3\nwhile_not = 1\nif n > 2 and not n == 5:\n    robot.face('tv')\nelif n in (1, 2):\n    pass\nelse:\n    "
    "robot.turn_absolute(270)\n",
    "places = []\nfor what in ('a', 'b', 'c'):\n    places = places + [get_pos(what)]\nmove_to(places[-1] * 0.5)\n",
    "a, b = 7, 2\nc = a // b + a % b - -a * b / 4\nturn(min(c, 90) if c < 100 else max(1, 2, 3))\n",
    "total = 0\nfor i in range(1, 10, 3):\n    total += round(i / 2, 1)\n    if total > 5: break\nmove_forward(abs(total))",
    'clip = load_sound("a.wav")\nmove_in_between(get_map(sound=clip), b=get_contour("rug")[0])\n',
    "x = len(get_contour('rug'))\nmove_north('table', distance_m=x * 0.25)\nwith_object_on_left(target='sofa')\n",
)
ESCAPES = (
    "().__class__.__bases__[0].__subclasses__()",
    "''.__class__.__mro__[1].__subclasses__()[104].__init__.__globals__['sys']",
    "robot.__class__.__init__.__globals__['__builtins__']['eval']('1')",
    "robot.move_to.__func__.__code__", "robot.move_to.__self__", "robot.__dict__", "getattr(robot, '__class__')",
    "setattr(robot, 'move_to', print)", "vars(robot)", "dir()", "globals()", "locals()['robot']", "type(robot)",
    "type('X', (), {})()", "__import__('os').system('id')", "__builtins__", "__builtins__['open']('/etc/passwd')",
    "__loader__.load_module('os')", "__spec__", "eval('1+1')", "exec('import os')", "compile('1', '', 'eval')",
    "open('/etc/passwd').read()", "input()", "breakpoint()", "help()", "exit()", "quit()", "print('x')",
    "import os", "import os; os.system('id')", "from os import system", "from . import x", "import socket as s",
    "(lambda: 1)()", "lambda: (yield)", "def f(): pass", "async def f(): await x", "class X: pass", "return 1",
    "yield 1", "raise SystemExit", "assert False", "del robot", "global robot", "nonlocal robot",
    "with open('/etc/passwd') as f: x = f", "try:\n    1 / 0\nexcept Exception as e:\n    e.__traceback__.tb_frame",
    "try:\n    pass\nfinally:\n    pass", "while True: pass", "while 1:\n    robot.turn(1)", "[x for x in range(10)]",
    "[robot for robot in [1]]", "(x for x in ().__class__.__base__.__subclasses__())", "{x: x for x in range(3)}",
    "{1, 2}", "{'a': 1}", "[*range(3)]", "robot.move_to(*['a'])", "robot.move_to(**{'target': 'a'})",
    "f'{robot.__class__}'", "f\"{__import__('os')}\"", "rb'abc'", "'%s' % robot", "x = '%c' % 10000000000", "x = '%1000000000d' % 1",
    "'{0.__class__}'.format(robot)", "'{}'.format_map(robot)", "''.join(['a'])", "x = 'a' * 1000", "x = 3 * [1]", "9**9**9", "2 ** 63",
    "1 << 10 ** 9", "10 ** 10 ** 10", "1e400", "-1e400", "x = 999999999999999 + 2", "x = 1e15 * 1e15", "0x41414141", "0b1", "0o7", "1j", "x = 1_0_0",
    "x = (y := 1)", "(robot := 1)", "@robot\ndef f(): pass", "@x", "a @ b", "x: int = 1", "x = y = 1", "a, *b = [1, 2]",
    "robot = 1", "move_to = 1", "range = 3", "len = max", "for robot in [1]: pass", "robot, x = 1, 2", "robot += 1",
    "robot.move_to = 1", "robot.x = 1", "a = robot", "a = robot.move_to", "a = move_to\na('x')", "a = [robot]", "(robot)",
    "robot.move_to('x')('y')", "'a'.upper()", "[].append(1)", "a = []\na.append(a)", "a = []\na[0] = 1", "a = [1]\na += a",
    "x = 'abc'[0]", "[1, 2, 3][0:2]", "x = [1][1e3]", "x = [1][True]", "x = [1]['a']", "x = ()[0]", "x = None[0]", "robot[0]", "robot.turn[0]",
    "robot.turn(None)", "robot.turn('90')", "robot.turn(True)", "robot.turn()", "robot.turn(1, 2)", "robot.turn(x=1)",
    "robot.turn(angle_deg=1, angle_deg=2)", "robot.turn(1, angle_deg=2)", "robot.turn(angle_deg=1, 2)", "robot.fly('x')",
    "robot.get_map()", "robot.get_map('a', 'b')", "robot.get_map(None)", "robot.get_max_pos_3d('x')", "robot.move_to([])",
    "x = robot.get_map('a') * 2", "x = robot.get_map('a') + robot.get_map('b')", "x = robot.get_map('a') == robot.get_map('a')",
    "if robot.get_map('a'): pass", "if robot.get_pos('a'): pass", "x = not robot.get_pos('a')", "x = -robot.get_pos('a')",
    "robot.get_pos('a').x", "robot.get_pos('a').__class__", "x = robot.get_pos('a') * 1e15 * 1e15", "x = robot.get_pos('a') / 0",
    "x, y, z = robot.get_pos('a')", "for c in 'abc': pass", "for c in robot.get_pos('a'): pass", "x = len(5)", "len()", "x = max([])",
    "max(1, key=2)", "x = min('a', 'b')", "x = abs('a')", "x = round(1.5, 1_000_000_000)", "x = round(123, -400)", "x = range(1, 2, 0)", "x = range(1.5)",
    "x = range(1_000_000_000_000_000)", "x = max(range(1_000_000_000_000_000))", "x = range(1_000_000_000_000_000)\nfor i in x: pass", "x = 1 / 0", "x = 1 // 0", "x = 1 % 0", "x = 1.0 % 0.0",
    "1 is 1", "x is robot", "1 if 2", "break", "continue", "else: pass", "elif 1: pass", "if 1:\npass", "  x = 1", "x = (1",
    "x = 1)", "x = (1]", "'unclosed", '"""doc"""', "'''a\nb'''", "x = 'a' 'b'", "x = 1 \\\n+ 2", "\\", "\\\n", "$x", "x?", "`x`",
    "x = 1 if True else", "not", "not not not", "1 + not 2", "x = ...", "...", ";", "x = 1;; y = 2", ":", ",", "=", "a = ", "= a",
    "print", "match x:\n    case 1: pass", "type X = int", "exec", "__debug__", "None = 1", "True = False", "()", "() = 1",
    "a, a = 1, 2\nturn(a)", "x = 1\nx()", "len(len)", "range", "0777", "1.2.3", "1..real", "5 .real", "1if 1else 2", "0_", "1__0",
    "r'\\' + 'x'", "x = 'tv'\nrobot.move_to(x2)", "robot.move_too('tv')", "robot.turn(angel_deg=1)", "x = get_mapp('tv')", "'\\N{DIGIT ONE}'", "'\\x00'", "'\\ud800'", "'\\U00110000'", "'\\0'", "load_image('\\x00')", "'\\\n'",
    "load_image('../' + '../' + 'etc/passwd')", "move_to('unicorn')", "get_pos('unicorn')\nmove_to('chair')",
    "raise", "await x", "async for x in y: pass", "x = yield", "a = b'x'", "u'x'", "robot . turn ( 1 )", "robot.turn(1)\x0c", "#",
    "if x := 1: pass", "print(*'abc')", "a = a", "x = x + 1", "i += 1", "(a) = 1", "[a] = [1]", "a[0] += 1", "robot.turn(1) = 2",
    "turn(1 if turn(2) else 3)", "turn(turn(1))", "x = turn(1)\nmove_to(x)", "x = [turn(1)]\nmove_to(x[0])", "turn(turn)",
)  # fmt: skip
LARGEST = (
    "(" * 20_000, "[" * 19_000 + "]", "-" * 19_990 + "1", "not " * 4_900 + "1", "x = " + "1 if 1 else " * 1500 + "1",
    "x = " + "(" * 9_000 + "1" + ")" * 9_000, "x" * 19_999, "x = " + "9" * 19_000, "x = " + "1+" * 9_000 + "1",
    "x = '" + "\\x41" * 4_000 + "'", "if 1:\n" + " if 1:\n" * 2_000, "{" * 20_000, "a." * 9_000 + "b", "robot." * 3_000,
    "len(" * 4_000 + ")" * 4_000, "x = " + "a[" * 6_000 + "]" * 6_000, "x = " + "1," * 9_000, "x = 1" + " and 1" * 3_000,
    "x = 1" + " < 1" * 4_000, "\n" * 20_000, "#" * 20_000, "'" * 20_000, '"' * 19_999, "\\\n" * 9_000, ";" * 19_000,
    "\ud800" * 100, "x = '" + "\U0001f600" * 10_000 + "'", "x = 1_" + "0_" * 9_000, "x = ." + "." * 9_000, "x" * 20_001,
    "\n".join(f"a{i} = 1" for i in range(1500)) + "\nturn(b)", "if 1:\n turn(1)\n" + "elif 1:\n turn(1)\n" * 800,
    "a0 = 1\n" + "\n".join(f"a{i} = a{i + 1} if a{i} else 1" for i in range(500)),
    "x = 0.5 in range(1000000000000000)", "x = 'x' not in range(-1000000000000000, 1000000000000000)",
    "x = robot.get_pos('x') in range(1000000000000000)", "x = range(3) in range(1000000000000000)",
    "x = [range(1000000000000000)] == [range(999999999999999)]\nturn(len(range(1000000000000000)))",
)  # fmt: skip
WORDS = (
    "robot", "turn", "move_to", "get_map", "get_pos", "x", "y", "a", "_", "__class__", "__globals__", "eval", "open", "os", "if",
    "else", "elif", "for", "in", "not", "and", "or", "is", "while", "lambda", "def", "import", "class", "with", "try", "yield",
    "return", "None", "True", "False", "range", "len", "max", "round", "1", "0", "2.5", "1e9", "10**9", "'a'", '"b"', "''", "(",
    ")", "[", "]", "{", "}", ",", ":", ";", ".", "=", "==", "!=", "<", ">=", "+", "-", "*", "/", "//", "%", "**", "@", ":=", "->",
    "...", "+=", "\n", "\n    ", "\n        ", "#", "\\", "'", '"', "f'", "\t", " ", "\x00", "\ufeff", "\u202e", "\u200b", "é", "ｅ",
)  # fmt: skip
# NFKC turns each of these into the letter that it looks like, and so would Python's own parser.
ALIKE = {
    "a": "ａ𝐚ª", "b": "ｂ𝓫", "c": "ｃ𝒄", "e": "ｅ𝑒ℯ", "g": "ｇ", "i": "ｉⁱ", "l": "ｌ", "m": "ｍ", "n": "ｎ", "o": "ｏº", "r": "ｒ", "s": "ｓſ",
    "t": "ｔ", "v": "ｖ", "x": "ｘ", "_": "＿︳﹍", ".": "．。․", "(": "（", ")": "）", "'": "’＇", "=": "＝", "1": "１١", "0": "０٠",
}  # fmt: skip


def _giant(random: Random) -> str:
    """Return a program that is small to write and large to parse or to run."""
    many = random.choice((3, 10, 30, 60, 100, 300, random.choice((300, 3000))))
    what = random.choice(("[]", "(1, 2)", "'abc'", "[1, 2, 3]", "get_map('x')", "1", "1.5", "get_pos('x')", "range(9)"))
    sign = random.choice(("+", "-", "*", "and", "or", "==", "<", "in", "%", ","))
    opening, closing = random.choice((("(", ")"), ("[", "]"), ("len(", ")"), ("get_pos(", ")"), ("-(", ")")))
    return random.choice((
        lambda: f"x = {opening * many}1{closing * many}",
        lambda: f"x = {opening * many}",
        lambda: f"x = {random.choice(('-', '+', 'not ', '- + ')) * many}1",
        lambda: "x = " + f" {sign} ".join([what] * many),
        lambda: f"a = {what}\n" + f"a = {random.choice(('(a, a)', '[a, a]', 'a + a', 'a * a', '[a] + [a]', 'a, a'))}\n" * many,
        lambda: f"a = {what}\nfor i in range({10**random.randint(1, 15)}):\n    a = {random.choice(('(a, a)', '[a]', 'a + a', 'a * a', 'a'))}\n",
        lambda: f"a = {what}\n" + f"a {sign if sign in '+-*%' else '+'}= a\n" * many + "b = [a, a] == [a, a]\nmove_to(a)\n",
        lambda: "\n".join("    " * i + f"for i{i} in range(99):" for i in range(min(many, 14))) + "\n" + "    " * min(many, 14) + "pass",
        lambda: "\n".join(" " * i + "if 1:" for i in range(min(many, 150))) + "\n" + " " * min(many, 150) + "pass",
        lambda: "if 0:\n    pass\n" + "elif 0:\n    pass\n" * many + "else:\n    turn(1)",
        lambda: f"x = {'9' * many}\ny = x * x\nturn(y)",
        lambda: f"x = 1{'0' * many}.{'1' * many}e{many}",
        lambda: f"x = '{'a' * many}'\n" + "x = x + x\n" * min(many, 60) + "move_to(x)",
        lambda: f"{'v' * many} = 1\nturn({'v' * many})",
        lambda: "turn(1)\n" * many,
        lambda: f"for i in range({many}):\n    for j in range({many}):\n        get_pos('y')\n",
        lambda: f"x = {what}\nfor i in range({many}):\n    x = max(x, i) if i > {many // 2} else x\n    x = [x, x]\n",
        lambda: "x = 1" + " if 1 else 2" * many,
        lambda: "x = 1" + " if 1 else (2" * many + ")" * many,
        lambda: "#" + "x" * many * 10,
        lambda: "\n" * many * 5 + "turn(1)",
        lambda: f"x = {what} {random.choice(('in', 'not in'))} range({10**random.randint(1, 15)})\nturn(1 if x else 2)",
        lambda: f"x = range({10**random.randint(1, 15)})\ny = max(x)\nz = 5 in x\nw = [x, x] == [x, x]\nturn(len(x))",
        lambda: f"p = get_pos('x')\nfor i in range({many}):\n    p = p * 1000\nmove_to(p)",
        lambda: f"h = get_map('x')\nfor i in range({many}):\n    h = h * h\nmove_to(h)",
        lambda: "x = [" + "[], " * many + "]\ny = x + x\nz = y == y",
        lambda: f"n = 0\nfor i in range({many}):\n    n = n * 10 + 9\n    m = n // 7 % 13 - n\n    turn(m)",
    ))()  # fmt: skip


def _soup(random: Random) -> str:
    return " ".join(random.choice(WORDS) for _ in range(random.randint(1, 40)))


def _value(random: Random, deep: int) -> str:
    """Return an expression, mostly of Python's grammar."""
    if deep == 0:
        return random.choice(("1", "0", "2.5", "'a'", "x", "y", "a", "None", "True", "robot", "()", "[]", "'unicorn'"))
    inner = lambda: _value(random, deep - random.randint(1, deep))  # noqa: E731
    sign = random.choice(("+", "-", "*", "/", "//", "%", "<", "==", "!=", "in", "and", "or", "is", "not in", "**", "@"))
    return random.choice((
        lambda: f"{inner()} {sign} {inner()}",
        lambda: f"({inner()} {sign} {inner()})",
        lambda: f"{random.choice(('-', 'not ', '+', '~', '*'))}{inner()}",
        lambda: f"[{inner()}, {inner()}][{inner()}]",
        lambda: f"({inner()}, {inner()})",
        lambda: f"{inner()} if {inner()} else {inner()}",
        lambda: f"{random.choice(('len', 'max', 'range', 'abs', 'round', 'min', 'eval', 'open', 'get_map', 'get_pos'))}({inner()})",
        lambda: f"robot.{random.choice(('get_pos', 'get_map', 'turn', 'get_contour', '__class__', 'fly'))}({inner()})",
        lambda: f"{inner()}.{random.choice(('x', '__class__', '__mul__', 'append', 'format'))}",
        lambda: f"{inner()}({inner()})",
        lambda: f"[{inner()} for x in {inner()}]",
        lambda: f"(lambda: {inner()})()",
        lambda: f"f'{{{inner()}}}'" if "'" not in (found := inner()) else found,
    ))()  # fmt: skip


def _block(random: Random, deep: int, indent: str = "") -> str:
    lines = []
    for _ in range(random.randint(1, 3)):
        kind = random.randint(0, 9 if deep else 5)
        value = _value(random, random.choice((0, 1, 1, 2, 3)))
        if kind < 3:
            lines.append(f"{indent}{random.choice(('x', 'y', 'a', 'x, y', 'robot', 'len'))} = {value}\n")
        elif kind < 5:
            lines.append(f"{indent}robot.{random.choice(('turn', 'move_to', 'face', 'get_map'))}({value})\n")
        elif kind == 5:
            lines.append(f"{indent}{random.choice(('x', 'y', 'a'))} {random.choice('+-*/%')}= {value}\n")
        elif kind < 8:
            head = random.choice(
                (f"for x in {value}", f"for y in range({value})", f"if {value}", f"while {value}", "try")
            )
            lines.append(f"{indent}{head}:\n{_block(random, deep - 1, indent + '    ')}")
        else:
            lines.append(f"{indent}{random.choice(('pass', 'break', 'continue', value, 'return ' + value))}\n")
    return "".join(lines)


def _mutated(random: Random, text: str) -> str:
    """Return a program with a few of its characters or words moved, doubled, lost or replaced."""
    for _ in range(random.randint(1, 4)):
        at, other = sorted((random.randint(0, len(text)), random.randint(0, len(text))))
        text = random.choice((
            lambda at=at, text=text: text[:at] + random.choice(WORDS) + text[at:],
            lambda at=at, text=text: text[:at] + random.choice(WORDS) + text[at + 1 :],
            lambda at=at, other=other, text=text: text[:at] + text[min(other, at + 12) :],
            lambda at=at, other=other, text=text: text[:at] + text[at : at + 20] + text[at:],
            lambda at=at, text=text: text[:at] + "\n" + random.choice(ESCAPES) + "\n" + text[at:],
        ))()  # fmt: skip
    return text


def _disguised(random: Random) -> str:
    """Return an escape or a program, some letters of which only look like themselves."""
    text = random.choice((*ESCAPES, *VALID, "eval('1')", "__import__('os')", "robot.__class__"))
    return "".join(
        random.choice(ALIKE[letter]) if letter in ALIKE and random.random() < 0.2 else letter for letter in text
    ) + random.choice(("", "", "\u200b", "\u00a0", "\u202e", "\u2028x = 1", "\r\nturn(1)", "\x0bturn(1)"))


def _spliced(random: Random) -> str:
    parts = [random.choice((*VALID, *ESCAPES)) for _ in range(random.randint(1, 3))]
    text = "\n".join(parts)
    if random.random() < 0.3:
        head = random.choice(("for x in range(3):", "if 1:", "for x in [1, 'a', None]:"))
        text = f"{head}\n" + "\n".join("    " + line for line in text.split("\n"))
    return text


def _working(random: Random) -> str:
    from helpers.working_programs import working_program

    return working_program(random, 1)


_WAYS: tuple[tuple[int, Callable[[Random], str]], ...] = (
    (5, lambda random: _block(random, 3)),
    (4, _working),
    (3, lambda random: _mutated(random, _working(random))),
    (2, lambda random: _mutated(random, random.choice(VALID))),
    (2, lambda random: _mutated(random, random.choice(ESCAPES))),
    (3, _spliced),
    (2, _soup),
    (2, _disguised),
    (1, _giant),
)


def hostile_programs(count: int, seed: int) -> "list[str]":
    """Return as many programs, the same for the same seed: the tables as they stand, then others by rule."""
    random = Random(seed)
    ways = [way for often, way in _WAYS for _ in range(often)]
    programs = [*ESCAPES, *VALID, *LARGEST]
    programs += [random.choice(ways)(random) for _ in range(count - len(programs))]
    return programs[:count]


# Time of the processor after which a program is taken never to end; the alarm ends the process, for in the middle of
# what Python does in one go nothing else would.
_MOST_SECONDS = 10.0


class _Watch:
    """Tells of every event of the interpreter that an audit hook sees while a program is parsed and run."""

    def __init__(self) -> None:
        self.on = False
        self.seen: list[tuple[str, str]] = []
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: Any) -> None:
        # Python's parser is asked, of a file without a name; its errors look for the line in that file.
        if (event, arguments[1:2]) == ("compile", ("",)) or (event, arguments[:1]) == ("open", ("",)):
            return
        if self.on:
            self.on = False
            self.seen.append((event, repr(arguments)[:200]))
            raise RuntimeError(f"a program reached {event}")


def _leak(text: str) -> Any:
    exec(compile("1", "", "exec"))
    return text


def _hang(text: str) -> Any:
    return text in range(10**15)


def main(count: int, seed: int, where: int, parse: Callable[[str], Any], most_s: float) -> dict[str, Any]:
    import resource

    from avlmaps.core.errors import ProgramError
    from avlmaps.language.program import Budget, parse_program, run_program
    from helpers.recording_robot import RecordedHeat, RecordingRobot

    budget = Budget(steps=1500, skill_calls=20, elements=3000, seconds=20.0)
    watch, told, said, faults = _Watch(), Counter[str](), set[str](), []
    largest, calls, programs = 0, 0, hostile_programs(count, seed)
    run_program(parse_program(VALID[1]), RecordingRobot(), budget)
    memory_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for index, text in enumerate(programs):
        robot, trace, error = RecordingRobot(), None, None
        os.pwrite(where, f"{index:9}".encode(), 0)
        signal.setitimer(signal.ITIMER_PROF, most_s)
        watch.on = True
        try:
            program = parse(text)
            trace = run_program(program, robot, budget)
            error = trace.error
        except ProgramError as fault:
            error = str(fault)
        except BaseException as fault:  # noqa: BLE001
            faults.append(f"{type(fault).__name__}: {fault} of {text[:200]!r}")
        watch.on = False
        signal.setitimer(signal.ITIMER_PROF, 0)
        told["ended" if trace and trace.ok else "stopped" if trace else "refused"] += 1
        if error is not None:
            said.add("".join(letter for letter in error if letter.isalpha())[:40])
            faults += [] if _is_one_sentence(error) else [f"no sentence: {error!r} of {text[:200]!r}"]
        if trace is not None:
            written = json.dumps(trace.to_json(), allow_nan=False)
            largest, calls = max(largest, len(written)), calls + len(robot.calls)
            faults += [f"{len(robot.calls)} calls of {text[:200]!r}"] if len(robot.calls) > budget.skill_calls else []
        faults += [f"asked for {name} of {text[:200]!r}" for name in (*robot.looked_up, *RecordedHeat.looked_into)]
        RecordedHeat.looked_into.clear()
    grown_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory_kb) / 1024
    return {
        "programs": count, **told, "calls": calls, "sentences": len(said), "events": watch.seen[:5], "faults": faults[:5],
        "largest_trace": largest, "grown_mb": grown_mb,
    }  # fmt: skip


def _is_one_sentence(error: str) -> bool:
    return (
        error.startswith(("Line ", "The program "))
        and error.endswith((".", "?"))
        and len(error) < 900
        and error.isprintable()
    )


if __name__ == "__main__":
    from avlmaps.language.program import parse_program

    reads = _leak if "--leak" in sys.argv else _hang if "--hang" in sys.argv else parse_program
    file = os.open(sys.argv[3], os.O_WRONLY | os.O_CREAT)
    told = main(int(sys.argv[1]), int(sys.argv[2]), file, reads, 0.3 if reads is _hang else _MOST_SECONDS)
    print(json.dumps(told))  # noqa: T201
