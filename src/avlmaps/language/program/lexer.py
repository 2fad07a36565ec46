"""From text to tokens; everything that no program may contain is refused here, by name and line.

Python's own parser is not used: it opens files to quote them in errors, warns through hooks, changes between versions
and can be made to blow up by nesting. What is read here means the same in Python, which a test holds it to.
"""

import re
from dataclasses import dataclass
from enum import Enum, auto

from avlmaps.core.errors import ProgramError
from avlmaps.core.printable import UNSAFE, printable
from avlmaps.language.program.budget import refused

LARGEST = 10**15
"""No number in a program is further from zero: below it, whole numbers and floats are both exact."""

_LONGEST_NUMBER = 40
_DIGITS = r"[0-9](?:_?[0-9])*"
_WHOLE = re.compile(r"0(?:_?0)*|[1-9](?:_?[0-9])*")
_FLOAT = re.compile(rf"(?:{_DIGITS}\.(?:{_DIGITS})?|\.{_DIGITS})(?:[eE][+-]?{_DIGITS})?|{_DIGITS}[eE][+-]?{_DIGITS}")
_ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|.)")
_ESCAPES = {"\\": "\\", "'": "'", '"': '"', "n": "\n", "t": "\t"}


def number(line: int, text: str) -> int | float:
    """Return the number that is written so, exactly as Python reads it.

    Raises:
        ProgramError: it is no plain decimal number, or further from zero than ``LARGEST``.
    """
    if len(text) > _LONGEST_NUMBER:
        raise refused(line, f"the number `{text[:12]}...` has more than {_LONGEST_NUMBER} characters; round it")
    value: int | float
    if _WHOLE.fullmatch(text):
        value = int(text)
    elif _FLOAT.fullmatch(text):
        value = float(text)
    else:
        raise refused(line, f"`{text}` is no number; write it in plain digits, such as 12 or 0.5")
    return bounded(line, value)


def bounded(line: int, value: int | float) -> int | float:
    """Return a number, unless it is too far from zero, infinite or none at all."""
    # Not a number is on neither side.
    if not -LARGEST <= value <= LARGEST:
        raise refused(line, "a number came out beyond 1e15 in size; programs reckon in metres and degrees")
    return value


def string(line: int, text: str) -> str:
    """Return the string that is written so, quotes and all, exactly as Python reads it.

    Raises:
        ProgramError: it has an escape that is not of a quote, a backslash, a line end, a tab or a character by number.
    """
    if text[0] in "rR":
        return text[2:-1]
    return _ESCAPE.sub(lambda found: _unescaped(line, found.group()), text[1:-1])


def _unescaped(line: int, escape: str) -> str:
    if escape[1] in _ESCAPES:
        return _ESCAPES[escape[1]]
    code = int(escape[2:], 16) if len(escape) > 2 else 0
    if 0x20 <= code <= 0x10FFFF and not 0xD800 <= code <= 0xDFFF:
        if UNSAFE.match(chr(code)):
            raise refused(
                line, f"the string has `{escape}`, which is not seen or turns the direction of writing; leave it out"
            )
        return chr(code)
    raise refused(
        line,
        f"the string has a backslash before {escape[1:]!r}, which makes no character; write `\\\\` for a backslash",
    )


MOST_CHARACTERS = 20_000
LONGEST_NAME = 64
DEEPEST_BLOCK = 10

KEYWORDS = frozenset(
    {"and", "break", "continue", "elif", "else", "False", "for", "if", "in", "is", "None", "not", "or", "pass", "True"}
)
# What is no part of a program, by what is to be written instead.
_INSTEAD = {
    "count with a bounded loop, such as `for i in range(10):`": "while",
    "write the steps one after the other": "def return yield class lambda async await",
    "the skills and `len, min, max, abs, range, round` are all there is": "import from",
    "call skills one after the other": "with",
    "a skill that fails ends the program by itself": "try except finally raise",
    "use `if`": "assert",
    "every name is seen everywhere": "global nonlocal",
    "let the name be, or give it another value": "del",
    "give a value a name with `name = value`": "as",
    "multiply with `*`, and write each argument": "**",
    "multiply with `*`": "**=",
    "give the value its name on a line before, with `=`": ":=",
    "there are no decorators and no matrices": "@",
    "write a list, [...]": "{ }",
    "use `not`": "~ !",
    "use `and`": "&",
    "use `or`": "|",
    "use arithmetic": "^ << >>",
    "nothing is declared in a program": "->",
    "write `pass` where nothing is to be done": "...",
}
_REFUSED = {text: instead for instead, texts in _INSTEAD.items() for text in texts.split()}
_TOKEN = re.compile(
    r"""
    (?P<space>[ \t]+) | (?P<comment>\#.*)
    | (?P<string>[rR]?(?:'(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*"))
    | (?P<prefixed>[A-Za-z_]+(?=['"])) | (?P<open>['"])
    | (?P<number>(?:[0-9]|\.[0-9])(?:(?<=[eE])[+-]|[A-Za-z0-9_.])*)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
    | (?P<sign>\*\*=|//=|\.\.\.|\*\*|//|:=|->|==|!=|<=|>=|<<|>>|[-+*/%]=|[-+*/%<>=()\[\]{},:.;@&|^~!])
    | (?P<on>\\\n)
    """,
    re.VERBOSE,
)
# A group that can be empty always matches.
_LINE_START = re.compile(r"([ \t]*)((?:#[^\n]*)?)")


class Form(Enum):
    """The kind of a token."""

    NAME = auto()
    WORD = auto()
    NUMBER = auto()
    STRING = auto()
    SIGN = auto()
    LINE_END = auto()
    INDENT = auto()
    DEDENT = auto()
    END = auto()


@dataclass(frozen=True, slots=True)
class ProgramToken:
    """One token.

    Attributes:
        form: what it is.
        text: as written; for a number and a string too.
        line: counted from 1.
        value: of a number or a string.
    """

    form: Form
    text: str
    line: int
    value: int | float | str | None = None

    @property
    def shown(self) -> str:
        """The token as an error names it."""
        words = {Form.LINE_END: "the end of the line", Form.INDENT: "an indented line", Form.END: "the end"}
        words[Form.DEDENT] = "the end of the block"
        return words.get(self.form) or (f"`{self.text}`" if len(self.text) <= 40 else f"`{self.text[:40]}...`")


def tokens_of(text: str) -> list[ProgramToken]:
    """Return the tokens of a program, lines and blocks marked.

    Raises:
        ProgramError: the text is too long, or has something that no program may contain.
    """
    if len(text) > MOST_CHARACTERS:
        raise ProgramError(
            f"The program has {len(text)} characters, more than {MOST_CHARACTERS}; use a loop, or split it in two."
        )
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    _check_characters(text)
    return _Lexer(text).run()


def _check_characters(text: str) -> None:
    # Characters that are invisible or turn the direction of writing can hide what a line does.
    found = next((found for found in UNSAFE.finditer(text) if found.group() not in "\n\t"), None)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        raise refused(line, f"the character U+{ord(found.group()):04X} has no place in a program; remove it")


class _Lexer:
    """Goes through a text once, keeping the indentation of the open blocks and the open brackets."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.line = 1
        self.indents = [""]
        self.brackets: list[tuple[str, int]] = []
        self.found: list[ProgramToken] = []

    def run(self) -> list[ProgramToken]:
        while self.at < len(self.text):
            if not self.brackets and self._at_line_start() and not self._indentation():
                continue
            if self.text[self.at] == "\n":
                self._line_end()
            else:
                self._one()
        if self.brackets:
            bracket, line = self.brackets[-1]
            raise refused(line, f"the bracket `{bracket}` is never closed; close it")
        if self.found and self.found[-1].form is not Form.LINE_END:
            self._add(Form.LINE_END, "")
        self.found += [ProgramToken(Form.DEDENT, "", self.line) for _ in self.indents[1:]]
        self._add(Form.END, "")
        return self.found

    def _add(self, form: Form, text: str, value: int | float | str | None = None) -> None:
        self.found.append(ProgramToken(form, text, self.line, value))

    def _at_line_start(self) -> bool:
        return not self.found or self.found[-1].form is Form.LINE_END

    def _line_end(self) -> None:
        if not self.brackets and not self._at_line_start():
            self._add(Form.LINE_END, "")
        self.line += 1
        self.at += 1

    def _indentation(self) -> bool:
        """Read the start of a line; return whether anything but space and a comment follows."""
        blank, comment = _LINE_START.match(self.text, self.at).groups()  # type: ignore[union-attr]
        self.at += len(blank) + len(comment)
        if comment or self.at == len(self.text) or self.text[self.at] == "\n":
            if self.at < len(self.text):
                self._line_end()
            return False
        if blank != self.indents[-1] and blank.startswith(self.indents[-1]):
            if len(self.indents) > DEEPEST_BLOCK:
                raise refused(self.line, f"blocks nest more than {DEEPEST_BLOCK} deep; write a flatter program")
            self.indents.append(blank)
            self._add(Form.INDENT, blank)
            return True
        while blank != self.indents[-1]:
            self.indents.pop()
            if not self.indents:
                raise refused(self.line, "its indentation fits no line above; indent each block by four spaces")
            self._add(Form.DEDENT, "")
        return True

    def _one(self) -> None:
        found = _TOKEN.match(self.text, self.at)
        if found is None:
            character = self.text[self.at]
            raise refused(
                self.line,
                f"the character {character!r} (U+{ord(character):04X}) has no meaning here; names are written in the "
                "letters a to z, phrases between quotes",
            )
        text, kind = found.group(), found.lastgroup
        self.at = found.end()
        if kind in ("space", "comment"):
            return
        match kind:
            case "string":
                self._string(text)
            case "prefixed":
                prefix = printable(text, 40)
                raise refused(
                    self.line, f"a string has no `{prefix}` before its quote; write it plainly, or join with +"
                )
            case "open":
                raise refused(self.line, f"the string that starts with {text} does not end on its line; close it")
            case "number":
                self._add(Form.NUMBER, text, number(self.line, text))
            case "name":
                self._name(text)
            case "sign":
                self._sign(text)
            case "on":
                self._line_goes_on()

    def _line_goes_on(self) -> None:
        if self._at_line_start() or self.at == len(self.text):
            raise refused(self.line, "a backslash goes between two halves of a line; remove it")
        self.line += 1

    def _string(self, text: str) -> None:
        if text in ("''", '""') and self.text.startswith(text[0], self.at):
            raise refused(self.line, "strings have one quote on each side; write a comment with #")
        self._add(Form.STRING, text, string(self.line, text))

    def _name(self, text: str) -> None:
        self._refuse(text)
        if len(text) > LONGEST_NAME:
            raise refused(self.line, f"the name `{text[:20]}...` is longer than {LONGEST_NAME} letters; shorten it")
        if text.startswith("__"):
            raise refused(self.line, f"`{text}` starts with two underscores, as no name may; choose another name")
        self._add(Form.WORD if text in KEYWORDS else Form.NAME, text)

    def _refuse(self, text: str) -> None:
        if text in _REFUSED:
            raise refused(self.line, f"`{text}` is not part of a program; {_REFUSED[text]}")

    def _sign(self, text: str) -> None:
        self._refuse(text)
        if text in ("(", "["):
            self.brackets.append((text, self.line))
        elif text in (")", "]") and (not self.brackets or self.brackets.pop()[0] != {")": "(", "]": "["}[text]):
            raise refused(self.line, f"the bracket `{text}` closes nothing that is open; match the brackets")
        self._add(Form.SIGN, text)
