"""From a command to a program by a chat model, corrected where it cannot be used or where it failed.

The prompt is `prompt.md` with the skills from the one table in it. The command is data: it comes as one JSON string on
one line, cut to a length, and the prompt says so. That helps an honest model. The interpreter, which knows nothing but
skills, protects the robot from any other.
"""

import ast
import json
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from time import monotonic

from avlmaps.core.errors import LanguageError, ProgramError
from avlmaps.language.chat.answer import ModelReply, UnusableAnswerError, program_text, quoted, without_thoughts
from avlmaps.language.chat.endpoint import Endpoint
from avlmaps.language.chat.replay import ChatRequest, Message, Replay
from avlmaps.language.chat.settings import ChatSettings
from avlmaps.language.commands import check_order
from avlmaps.language.program import SKILLS, Program, parse_program, skill_lines
from avlmaps.language.program.parser import called
from avlmaps.language.translator import Translation

MOST_COMMAND_CHARACTERS = 500
_MOST_SAID_CHARACTERS = 4000
_MOST_DONE = 40
_MOVES_NOTHING = (
    "The program does not move the robot, so that nothing would be done; write the movements that the command says, "
    "or `# cannot: ` and the reason."
)
_LOADERS = frozenset({"load_image", "load_sound"})


class ChatTranslator:
    """Programs by any model behind an endpoint of the OpenAI chat protocol, or from a file of what one answered.

    A program that does not parse, or that loads a file which the command does not name, goes back to the model with
    the sentence that says why; so does one that failed while it ran, with what was done before. Each command has
    `ChatSettings.rounds` such corrections in all. A program that moves nothing goes back as well; one that asks for
    something again is taken the second time, for the model may know that nothing more was said.
    """

    def __init__(self, settings: ChatSettings | None = None) -> None:
        self._settings = settings or ChatSettings.from_environment()
        self._replay = Replay(self._settings.replay) if self._settings.replay else None
        self._endpoint: Endpoint | None = None
        self._model = self._settings.model
        self._command = ""
        self._rounds_used = 0

    @property
    def name(self) -> str:
        """The word by which a user chooses this translator."""
        return "chat"

    def program_for(self, command: str) -> Translation:
        """Return the program that the model writes for a command; it parses, but has not run.

        Raises:
            UnclearError: the sentence is no order, or a danger; no model is asked.
            LanguageError: the command is empty or too long, no answer came, or none held a program.
        """
        check_order(plain_command(command))
        self._command, self._rounds_used = command, 0
        return self._translated(command, _opening(command))

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        """Return a program for what is left of a command after its program failed, None where no round is left.

        The new program continues from where the robot stands: it is not to repeat what was done, and nothing that the
        failed program gave a name to is known in it.

        Args:
            command: what the person said.
            program: the program that failed.
            error: the sentence that says why.
            done: the steps that were done before it failed, one text each, such as `move_to(target="sofa")`. Without
                them the prompt says that all before the failing line was done; the model has to find that line.

        Raises:
            LanguageError: no answer came, or none held a program.
        """
        if command != self._command:
            self._command, self._rounds_used = command, 0
        if self._rounds_used >= self._settings.rounds:
            return None
        self._rounds_used += 1
        failed = (Message("assistant", program_message(program)), Message("user", failed_message(error, done)))
        return self._translated(command, (*_opening(command), *failed))

    def _translated(self, command: str, messages: tuple[Message, ...]) -> Translation:
        """Return the program that a conversation leads to, with as many corrections as are left."""
        corrected: list[str] = []
        read = written = 0
        deadline = monotonic() + self._settings.timeout_s
        while True:
            answer = self._asked(messages, deadline)
            read, written = read + answer.tokens[0], written + answer.tokens[1]
            try:
                program = program_text(answer)
                parsed = _parsed(program, answer)
                check_files(parsed, plain_command(command))
                check_moves(parsed, insisted=_MOVES_NOTHING in corrected or self._rounds_used >= self._settings.rounds)
                return Translation(program, self._notes(answer.model, corrected, read, written))
            except (ProgramError, UnusableAnswerError) as fault:
                if self._rounds_used >= self._settings.rounds:
                    raise LanguageError(
                        f"The chat model {answer.model or self._model!r} wrote no usable program in "
                        f"{_attempts(self._rounds_used + 1)}, the last time because: {_one_sentence(fault)} Say it in "
                        "other words, or ask another model."
                    ) from None
                said = without_thoughts(answer.content).strip()[:_MOST_SAID_CHARACTERS] or "(nothing)"
                messages = (*messages, Message("assistant", said), Message("user", unusable_message(str(fault))))
                corrected.append(_one_sentence(fault))
            self._rounds_used += 1

    def _asked(self, messages: tuple[Message, ...], deadline: float) -> ModelReply:
        settings, replay = self._settings, self._replay
        replayed = replay if replay and not replay.recording else None
        if self._model is None:
            self._model = (replayed.model or "") if replayed else self._server().model()
        request = ChatRequest(self._model, messages, settings.temperature, settings.seed, settings.max_tokens)
        if replayed:
            return replayed.answer(request)
        answer = self._server().complete(request, deadline)
        if replay:
            replay.add(request, answer)
        return answer

    def _server(self) -> Endpoint:
        if self._endpoint is None:
            self._endpoint = Endpoint(self._settings)
        return self._endpoint

    def _notes(self, model: str, corrected: Sequence[str], read: int, written: int) -> tuple[str, ...]:
        replay = self._replay
        replayed = replay is not None and not replay.recording
        where = f"replayed from {replay.path}" if replay and replayed else f"at {self._settings.shown_url}"
        tokens = f", {read} tokens read and {written} written" if read or written else ""
        notes = [f"Written by {model or self._model} {where}{tokens}."]
        notes += [f"Corrected, because: {fault}" for fault in corrected]
        for name in self._endpoint.left_out if self._endpoint else ():
            notes.append(f"The server does not take a {name}, so the next answer may be another.")
        return tuple(notes)


def check_moves(program: Program, *, insisted: bool = False) -> None:
    """Refuse a program that moves nothing: it would be reported as done, with nothing done.

    Args:
        program: what a model wrote.
        insisted: whether the model had this refusal before, or cannot have it; then a program that asks is taken.

    Raises:
        UnusableAnswerError: it moves nothing.
    """
    if any(SKILLS[skill].moves for skill in program.skills) or (insisted and program.skills):
        return
    raise UnusableAnswerError(_MOVES_NOTHING)


def check_files(program: Program, command: str) -> None:
    """Refuse a program that loads a file which its command does not name.

    Raises:
        ProgramError: it does, or its file's name is not written out.
    """
    for call in program.calls:
        if called(call) not in _LOADERS:
            continue
        path = (*call.args, *(each.value for each in call.keywords))[0]
        name = path.value if isinstance(path, ast.Constant) else None
        if not isinstance(name, str) or not name.strip():
            raise ProgramError(f"Line {call.lineno}: `{called(call)}` takes the file's name written out in quotes.")
        if not _names_file(command, name.removeprefix("./")):
            raise ProgramError(f"Line {call.lineno}: the file {name!r} is not named in the command.")


def _names_file(command: str, name: str) -> bool:
    """Return whether a file's name stands in a command as a whole, and not as a part of another."""
    return re.search(rf"(?<![\w/.-])(?:\./)?{re.escape(name)}(?![\w/-]|\.\w)", command) is not None


def _opening(command: str) -> tuple[Message, ...]:
    return (Message("system", system_prompt()), Message("user", command_message(command)))


def _parsed(program: str, answer: ModelReply) -> Program:
    """Return the parsed program; where the model wrote no code at all, say that rather than what is wrong with it."""
    try:
        return parse_program(program)
    except ProgramError as fault:
        if "`" not in answer.content:
            raise UnusableAnswerError(
                f"The answer has no code block, and by itself it is no program: {fault}"
            ) from None
        raise


def _one_sentence(fault: Exception) -> str:
    """Return a fault's sentence as a terminal can show it: it may quote what a model wrote."""
    return quoted(str(fault), 300).strip("“”")


def _attempts(count: int) -> str:
    return "1 attempt" if count == 1 else f"{count} attempts"


@cache
def system_prompt() -> str:
    """Return the prompt that precedes any command."""
    told = files("avlmaps.language.chat").joinpath("prompt.md").read_text(encoding="utf-8")
    return told.replace("{skills}", "\n".join(f"- {line}" for line in skill_lines()))


def command_message(command: str) -> str:
    """Return the turn that gives a command.

    Raises:
        LanguageError: the command is empty or too long.
    """
    return f"Command: {json.dumps(plain_command(command), ensure_ascii=False)}"


def plain_command(command: str) -> str:
    """Return a command on one line, without control characters or halves of letters.

    Raises:
        LanguageError: it is empty or too long.
    """
    letters = command.encode("utf-8", "replace").decode("utf-8")
    plain = " ".join("".join(letter for letter in letters if letter.isprintable() or letter.isspace()).split())
    if not plain:
        raise LanguageError("The command is empty; say where the robot shall go, such as: go to the sofa.")
    if len(plain) > MOST_COMMAND_CHARACTERS:
        raise LanguageError(
            f"The command has {len(plain)} characters, more than {MOST_COMMAND_CHARACTERS}; say it shorter, or in "
            "several commands."
        )
    return plain


def unusable_message(fault: str) -> str:
    """Return the turn that asks for a corrected program, none of which has run."""
    return (
        f"That cannot be used: {_cut(fault)}\nNothing of it was done. Answer with the whole corrected program in one "
        "Python code block, and nothing else."
    )


def failed_message(error: str, done: Sequence[str]) -> str:
    """Return the turn that reports that a program failed while it ran, and asks for one that does the rest."""
    steps = "\n".join(f"- {_cut(step, 200)}" for step in done[-_MOST_DONE:])
    known = f"These steps were done:\n{steps}\n" if done else "What stands before the step that failed was done.\n"
    return (
        f"The program failed while it ran: {_cut(error)}\n{known}The robot stands where they left it, and all names "
        "are forgotten. Do not repeat movements that were done. Answer with a program for what is left to do, in one "
        "Python code block, and nothing else; or with `# cannot: ` and the reason, if nothing else can be tried."
    )


def program_message(program: str) -> str:
    """Return the turn in which a model gave a program."""
    return f"```python\n{_cut(program, _MOST_SAID_CHARACTERS)}\n```"


def _cut(text: str, most: int = 600) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
