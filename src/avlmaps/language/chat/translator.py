"""From a command to a program by a chat model, corrected where it cannot be used or where it failed.

The prompt is `prompt.md` with the skills in it. The command is data: it comes as one JSON string on one line, cut to a
length, and the prompt says so. That helps an honest model. The interpreter protects the robot from any other.
"""

import ast
import json
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from textwrap import dedent
from time import monotonic

from avlmaps.core.errors import LanguageError, ProgramError
from avlmaps.language.chat.endpoint import ChatSettings, Endpoint, ModelReply, Replay, quoted
from avlmaps.language.commands import check_order
from avlmaps.language.program import ROBOT, Program, parse_program, skills
from avlmaps.language.program.parser import called
from avlmaps.language.translator import Translation
from avlmaps.language.word_classes import table

_MOST_SAID_CHARACTERS = 4000
_MOST_DONE = 40
_TURNS = table("chat/turns")
_MOVES_NOTHING = _TURNS["moves_nothing"]
_LOADERS = frozenset({"load_image", "load_sound"})
_TAGS = "think|thinking|thought|reasoning"
# Some servers cut off the tag that begins the thoughts: all before the last tag that ends them is thought.
_THOUGHTS = re.compile(rf".*(?:</(?:{_TAGS})>|\[/THINK\])", re.IGNORECASE | re.DOTALL)
_ENDLESS_THOUGHT = re.compile(rf"\s*(?:<(?:{_TAGS})>|\[THINK\])", re.IGNORECASE)
_ONE_LINE = re.compile(r"^(`+)(?:python[ \t]+)?([^`\n]+)\1$")
_FENCE = r"^[ \t]*(`{3,}|~{3,})[ \t]*(\w*)[^\n`]*$\n?"
_BLOCK = re.compile(rf"{_FENCE}(.*?)^[ \t]*\1[`~]*[ \t]*$", re.MULTILINE | re.DOTALL)
_OPEN_BLOCK = re.compile(rf"{_FENCE}(.*)", re.MULTILINE | re.DOTALL)
_PYTHON = frozenset({"", "python", "py", "python3", "robot"})
_CANNOT = re.compile(r"(?:#[ \t]*)?cannot[ \t]*:(.*)", re.IGNORECASE)
_REFUSAL = re.compile(
    r"^\W*(?:(?:i['’]?m|i am|we are|we['’]re) (?:very |so |really |afraid )?(?:sorry|unable|not able|i can)"
    r"|sorry\b|i (?:can['’]?t|cannot|won['’]?t|will not|must decline|must refuse)|unfortunately\b|as an ai\b)",
    re.IGNORECASE,
)
Message = dict[str, str]


class UnusableAnswerError(LanguageError):
    """An answer holds no program; the model may try once more."""


class ChatTranslator:
    """Programs by any model behind an endpoint of the OpenAI chat protocol, or from a file of what one answered.

    A program that does not parse, or that loads a file which the command does not name, goes back to the model with
    the sentence that says why; so does one that failed while it ran, with what was done before. Each command has
    `ChatSettings.rounds` such corrections in all. A program that moves nothing goes back as well; one that asks for
    something again is taken the second time, for the model may know that nothing more was said.
    """

    name = "chat"

    def __init__(self, settings: ChatSettings | None = None) -> None:
        self._settings = settings or ChatSettings.from_environment()
        self._replay = Replay(self._settings.replay) if self._settings.replay else None
        self._endpoint: Endpoint | None = None
        self._model = self._settings.model
        self._command, self._rounds_used = "", 0

    def program_for(self, command: str) -> Translation:
        """Return the program that the model writes for a command; it parses, but has not run.

        Raises UnclearError before any model is asked where the sentence is no order, or a danger.
        """
        check_order(plain_command(command))
        self._command, self._rounds_used = command, 0
        return self._translated(command, _opening(command))

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return a program for the rest of a command, see `Translator.repair`; None where no round is left."""
        if command != self._command:
            self._command, self._rounds_used = command, 0
        if self._rounds_used >= self._settings.rounds:
            return None
        self._rounds_used += 1
        failed = (_message("assistant", program_message(program)), _message("user", failed_message(error, done)))
        return self._translated(command, (*_opening(command), *failed))

    def _translated(self, command: str, messages: tuple[Message, ...]) -> Translation:
        corrected: list[str] = []
        read = written = 0
        deadline = monotonic() + self._settings.timeout_s
        while True:
            answer = self._asked(messages, deadline)
            read, written = read + answer.tokens[0], written + answer.tokens[1]
            is_last = self._rounds_used >= self._settings.rounds
            try:
                program = program_text(answer)
                parsed = _parsed(program, answer)
                check_files(parsed, plain_command(command))
                insists = parsed.skills and (is_last or _MOVES_NOTHING in corrected)
                if not (insists or any(skills()[skill].moves for skill in parsed.skills)):
                    raise UnusableAnswerError(_MOVES_NOTHING)
                return Translation(program, self._notes(answer.model, corrected, read, written))
            except (ProgramError, UnusableAnswerError) as fault:
                why = quoted(str(fault), 300).strip("“”")  # it may quote what a model wrote
                if is_last:
                    attempts = f"{self._rounds_used + 1} attempt{'s' * (self._rounds_used > 0)}"
                    told = {"model": answer.model or self._model, "attempts": attempts, "why": why}
                    raise LanguageError(table("chat/faults")["unusable"].format_map(told)) from None
                said = without_thoughts(answer.content).strip()[:_MOST_SAID_CHARACTERS] or "(nothing)"
                messages = (*messages, _message("assistant", said), _message("user", unusable_message(str(fault))))
                corrected.append(why)
            self._rounds_used += 1

    def _asked(self, messages: tuple[Message, ...], deadline: float) -> ModelReply:
        replay = self._replay
        if replay and not replay.recording:
            return replay.answer(messages)
        if self._endpoint is None:
            self._endpoint = Endpoint(self._settings)
        self._model = self._model or self._endpoint.model()
        answer = self._endpoint.complete(self._model, messages, deadline)
        if replay:
            replay.add(messages, answer)
        return answer

    def _notes(self, model: str, corrected: Sequence[str], read: int, written: int) -> tuple[str, ...]:
        replayed = self._replay is not None and not self._replay.recording
        where = f"replayed from {self._settings.replay}" if replayed else f"at {self._settings.shown_url}"
        tokens = f", {read} tokens read and {written} written" if read or written else ""
        left_out = self._endpoint.left_out if self._endpoint else ()
        return (
            f"Written by {model or self._model} {where}{tokens}.",
            *(f"Corrected, because: {fault}" for fault in corrected),
            *(f"The server does not take a {name}, so the next answer may be another." for name in left_out),
        )


def program_text(answer: ModelReply) -> str:
    """Return the program that an answer holds: its one code block, or all of it where it has no block.

    Raises:
        UnusableAnswerError: it holds none, or several that differ (each may be one step of the whole).
        LanguageError: the model refused, says that the command cannot be done, or was cut off.
    """
    if answer.refusal or answer.finish == "content_filter":
        raise LanguageError(_refused(answer.refusal or answer.content or "its provider's filter stopped the answer"))
    if answer.finish == "length":
        raise LanguageError(table("chat/faults")["cut_off"].format(tokens=answer.tokens[1] or "too many"))
    said = without_thoughts(answer.content).strip()
    if not said:
        raise UnusableAnswerError(_TURNS["empty"])
    program = _only_block(said)
    written = said if program is None else program
    if cannot := _CANNOT.fullmatch(written.strip()):
        why = quoted(cannot[1]) if cannot[1].strip() else "it does not say why"
        raise LanguageError(f"The chat model says that the command cannot be done: {why}; say it in other words.")
    if program is None and _REFUSAL.match(written):
        raise LanguageError(_refused(written))
    if not written.strip():
        raise UnusableAnswerError("The code block is empty.")
    return written


def without_thoughts(content: str) -> str:
    """Return an answer without what a reasoning model thought aloud before it; of endless thoughts nothing is left."""
    said = _THOUGHTS.sub("", content, count=1)
    return "" if _ENDLESS_THOUGHT.match(said) else said


def _refused(text: str) -> str:
    return f"The chat model refuses the command: {quoted(text)}; say it in other words, or ask another model."


def _only_block(said: str) -> str | None:
    if one_line := _ONE_LINE.match(said):
        return one_line[2].strip()
    plain = said.replace("\r\n", "\n")
    blocks = [(language.lower(), dedent(text).strip("\n")) for _, language, text in _BLOCK.findall(plain)]
    begun = _OPEN_BLOCK.search(_BLOCK.sub("", plain))
    if begun and (not blocks or (begun[2].lower() in _PYTHON and begun[3].strip())):
        raise UnusableAnswerError("The code block is never closed, so it may be half a program.")
    fitting = [text for language, text in blocks if language in _PYTHON] or [text for _, text in blocks]
    different = list(dict.fromkeys(text for text in fitting if text.strip()))
    if len(different) > 1:
        raise UnusableAnswerError(_TURNS["differ"].format(count=len(different)))
    return next(iter([*different, *fitting]), None)


def check_files(program: Program, command: str) -> None:
    """Raise a ProgramError where a program loads a file which its command does not name, or does not write out."""
    for call in (call for call in program.calls if called(call) in _LOADERS):
        path = (*call.args, *(each.value for each in call.keywords))[0]
        name = path.value if isinstance(path, ast.Constant) else None
        if not isinstance(name, str) or not name.strip():
            raise ProgramError(f"Line {call.lineno}: `{called(call)}` takes the file's name written out in quotes.")
        plain = re.escape(name.removeprefix("./"))  # as a whole, and not as a part of another name
        if re.search(rf"(?<![\w/.-])(?:\./)?{plain}(?![\w/-]|\.\w)", command) is None:
            raise ProgramError(f"Line {call.lineno}: the file {name!r} is not named in the command.")


def _message(role: str, content: str) -> Message:
    return {"role": role, "content": content}


def _opening(command: str) -> tuple[Message, ...]:
    return (_message("system", system_prompt()), _message("user", command_message(command)))


def _parsed(program: str, answer: ModelReply) -> Program:
    try:
        return parse_program(program)
    except ProgramError as fault:
        if "`" in answer.content:
            raise
        raise UnusableAnswerError(_TURNS["no_block"].format(fault=fault)) from None


@cache
def system_prompt() -> str:
    """Return the prompt that precedes any command."""
    told = files("avlmaps.language.chat").joinpath("prompt.md").read_text(encoding="utf-8")
    lines = (f"- {ROBOT}.{skill.signature}: {skill.doc}" for skill in skills().values())
    return told.replace("{skills}", "\n".join(lines))


def command_message(command: str) -> str:
    """Return the turn that gives a command."""
    return f"Command: {json.dumps(plain_command(command), ensure_ascii=False)}"


def plain_command(command: str) -> str:
    """Return a command on one line, without control characters or halves of letters."""
    letters = command.encode("utf-8", "replace").decode("utf-8")
    return " ".join("".join(letter for letter in letters if letter.isprintable() or letter.isspace()).split())


def unusable_message(fault: str) -> str:
    """Return the turn that asks for a corrected program, none of which has run."""
    return _TURNS["unusable"].format(fault=_cut(fault))


def failed_message(error: str, done: Sequence[str]) -> str:
    """Return the turn that reports that a program failed while it ran, and asks for one that does the rest."""
    steps = "\n".join(f"- {_cut(step, 200)}" for step in done[-_MOST_DONE:])
    known = f"These steps were done:\n{steps}" if done else "What stands before the step that failed was done."
    return _TURNS["failed"].format(error=_cut(error), known=known)


def program_message(program: str) -> str:
    """Return the turn in which a model gave a program."""
    return f"```python\n{_cut(program, _MOST_SAID_CHARACTERS)}\n```"


def _cut(text: str, most: int = 600) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
