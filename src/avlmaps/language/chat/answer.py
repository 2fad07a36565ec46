"""The program in a model's answer, and nothing else of it: no thoughts, no prose, no half of a block."""

import re
from textwrap import dedent

import msgspec

from avlmaps.core.errors import LanguageError

_THOUGHT_TAGS = ("think", "thinking", "thought", "reasoning")
_THOUGHT_END = re.compile(rf"</(?:{'|'.join(_THOUGHT_TAGS)})>|\[/THINK\]", re.IGNORECASE)
_THOUGHT_BEGIN = re.compile(rf"<(?:{'|'.join(_THOUGHT_TAGS)})>|\[THINK\]", re.IGNORECASE)
_ONE_LINE = re.compile(r"^(`+)(?:python[ \t]+)?([^`\n]+)\1$")
_PYTHON = frozenset({"", "python", "py", "python3", "robot"})
_CANNOT = re.compile(r"(?:#[ \t]*)?cannot[ \t]*:", re.IGNORECASE)
_REFUSAL = re.compile(
    r"^\W*(?:(?:i['’]?m|i am|we are|we['’]re) (?:very |so |really |afraid )?(?:sorry|unable|not able|i can)"
    r"|sorry\b|i (?:can['’]?t|cannot|won['’]?t|will not|must decline|must refuse)|unfortunately\b|as an ai\b)",
    re.IGNORECASE,
)


class UnusableAnswerError(LanguageError):
    """An answer holds no program; the model may try once more."""


class ModelReply(msgspec.Struct, frozen=True):
    """The answer of a model.

    Attributes:
        content: its text, empty where it gave none.
        refusal: the sentence with which it refused, where the server marks refusals.
        finish: why it ended: "stop", "length", "content_filter", "tool_calls", or what else the server says.
        tool_calls: how many tools it wanted to call.
        model: the model that answered, as the server names it.
        tokens: how many tokens were read and written, 0 where the server does not say.
    """

    content: str
    refusal: str | None = None
    finish: str | None = "stop"
    tool_calls: int = 0
    model: str = ""
    tokens: tuple[int, int] = (0, 0)


def program_text(answer: ModelReply) -> str:
    """Return the program that an answer holds: its one code block, or all of it where it has no block.

    Raises:
        UnusableAnswerError: it holds none, or several that differ (each may be one step of the whole); why is said so
            that the model can do better.
        LanguageError: the model refused, says that the command cannot be done, or was cut off.
    """
    if answer.refusal or answer.finish == "content_filter":
        raise LanguageError(_refused(answer.refusal or answer.content or "its provider's filter stopped the answer"))
    if answer.finish == "length":
        raise LanguageError(
            f"The answer of the chat model was cut off after {answer.tokens[1] or 'too many'} tokens; "
            "raise AVLMAPS_CHAT_MAX_TOKENS, or the length of context that the server allows."
        )
    said = without_thoughts(answer.content)
    if not said.strip():
        tools = "It called a tool instead of writing a program." if answer.tool_calls else "The answer is empty."
        raise UnusableAnswerError(f"{tools} There are no tools: write the program as text in one code block.")
    program = _only_block(said)
    written = said.strip() if program is None else program
    lines = [line.strip() for line in written.splitlines() if line.strip()]
    if len(lines) == 1 and (cannot := _CANNOT.match(lines[0])):
        why = quoted(lines[0][cannot.end() :]) if lines[0][cannot.end() :].strip() else "it does not say why"
        raise LanguageError(f"The chat model says that the command cannot be done: {why}; say it in other words.")
    if program is None and _REFUSAL.match(written):
        raise LanguageError(_refused(written))
    if not lines:
        raise UnusableAnswerError("The code block is empty.")
    return written


def without_thoughts(content: str) -> str:
    """Return an answer without what a reasoning model thought aloud before it.

    Some servers cut off the tag that begins the thoughts, so everything before the last tag that ends them goes. Of
    thoughts that never end nothing is left.
    """
    end = 0
    for thought_end in _THOUGHT_END.finditer(content):
        end = thought_end.end()
    said = content[end:].lstrip()
    return "" if _THOUGHT_BEGIN.match(said) else said


def quoted(text: str, most: int = 200) -> str:
    """Return a text of somebody else's as one quoted line that a terminal can show, cut where it is long."""
    plain = " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
    return f"“{plain if len(plain) <= most else plain[: most - 1] + '…'}”"


def _refused(text: str) -> str:
    return f"The chat model refuses the command: {quoted(text)}; say it in other words, or ask another model."


def _only_block(said: str) -> str | None:
    """Return the one code block that can be Python, None where there is no block at all."""
    if one_line := _ONE_LINE.match(said.strip()):
        return one_line[2].strip()
    blocks: list[tuple[str, str]] = []
    begun: tuple[str, str] | None = None
    inside: list[str] = []
    for line in said.splitlines():
        fence, language = _fence(line)
        if begun is None:
            if fence:
                begun, inside = (fence, language), []
        elif fence.startswith(begun[0]) and not language:
            blocks.append((begun[1], dedent("\n".join(inside)).strip("\n")))
            begun = None
        else:
            inside.append(line)
    if begun is not None and (not blocks or (begun[1] in _PYTHON and "".join(inside).strip())):
        raise UnusableAnswerError("The code block is never closed, so it may be half a program.")
    fitting = [text for language, text in blocks if language in _PYTHON] or [text for _, text in blocks]
    different = list(dict.fromkeys(text for text in fitting if text.strip()))
    if len(different) > 1:
        raise UnusableAnswerError(
            f"There are {len(different)} code blocks that differ; write one block with all steps in it."
        )
    return different[0] if different else fitting[0] if fitting else None


def _fence(line: str) -> tuple[str, str]:
    """Return the fence that a line is, and the language after it; an empty one where it is none."""
    plain = line.strip()
    sign = plain[:1]
    rest = plain.lstrip(sign) if sign in ("`", "~") else plain
    fence = plain[: len(plain) - len(rest)]
    if len(fence) < 3 or "`" in rest:
        return "", ""
    return fence, rest.split()[0].lower() if rest.split() else ""
