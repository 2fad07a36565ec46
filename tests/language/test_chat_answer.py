"""Which program is read out of a model's answer, and which answers hold none."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply, UnusableAnswerError, program_text, quoted, without_thoughts

GO = 'robot.move_to_object("sofa")'
TURN = "robot.turn(90)"


@pytest.mark.parametrize(
    "content",
    [
        f"```python\n{GO}\n```",
        f"```\n{GO}\n```",
        f"```py\n{GO}\n```\n",
        f"~~~python\n{GO}\n~~~",
        f"````python\n{GO}\n````",
        f"``` python \n{GO}\n```",
        f"Here is the program:\n\n```python\n{GO}\n```\nIt drives to the sofa.",
        f"1. So:\n   ```python\n   {GO}\n   ```",
        f"```python\n{GO}\n```\nOnce more:\n```python\n{GO}\n```",
        f"```python\n{GO}\n```\n```python\n\n```",
        f"```\n{GO}\n```\n```",
        f"```python\n{GO}\n```\nIt prints\n```text\nnothing\n```",
        f"```python\n{GO}\n```\nIt prints\n```text\nnothing",
        f"```python\r\n{GO}\r\n```",
        GO,
        f"\n\n{GO}\n",
        f"`{GO}`",
        f"```{GO}```",
        f"<think>I could ```python\n{TURN}\n```</think>\n```python\n{GO}\n```",
        f"the robot should ```python\n{TURN}\n``` or so</think>{GO}",
        f"[THINK]hm[/THINK]```python\n{GO}\n```",
        f"<thinking>\nhm\n</thinking>\n{GO}",
    ],
)
def test_the_program_is_found_in_whatever_stands_around_it(content: str) -> None:
    assert program_text(ModelReply(content)) == GO


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (ModelReply(""), "empty"),
        (ModelReply(" \n "), "empty"),
        (ModelReply("<think>I go on and on"), "empty"),
        (ModelReply("", tool_calls=1, finish="tool_calls"), "called a tool"),
        (ModelReply(f"```python\n{GO}"), "never closed"),
        (ModelReply(f"```python\n{GO}\n```\nand, cut off:\n```python\nrobot.mo"), "never closed"),
        (
            ModelReply(f"First:\n```python\n{GO}\n```\nThen:\n```python\n{TURN}\n```"),
            "2 code blocks that differ; write one",
        ),
        (ModelReply(f"First idea:\n```\n{TURN}\n```\nBetter:\n```py\n{GO}\n```"), "2 code blocks that differ"),
        (ModelReply(f"```text\n{GO}\n```\n```text\n{TURN}\n```"), "2 code blocks that differ"),
        (ModelReply("```python\n\n```"), "block is empty"),
        (ModelReply("```python\n```"), "block is empty"),
    ],
)
def test_an_answer_without_a_program_may_be_corrected(answer: ModelReply, why: str) -> None:
    with pytest.raises(UnusableAnswerError, match=why):
        program_text(answer)


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (ModelReply("", refusal="I can't help with that."), "refuses the command: “I can't help with that.”"),
        (ModelReply("half of", finish="content_filter"), "refuses the command"),
        (ModelReply("I'm sorry, but I can't assist with that request."), "refuses the command: “I'm sorry"),
        (ModelReply("I’m sorry, I cannot do this."), "refuses the command"),
        (ModelReply("<think>bad</think>I cannot write this."), "refuses the command: “I cannot write this.”"),
        (ModelReply("Unfortunately, that is against my rules."), "refuses"),
        (ModelReply("```python\n# cannot: the robot has no arms\n```"), "cannot be done: “the robot has no arms”"),
        (ModelReply("# cannot: the robot has no arms"), "cannot be done: “the robot has no arms”"),
        (ModelReply("Cannot: it has no arms"), "cannot be done"),
        (
            ModelReply(f"```python\n{GO}\n```", finish="length", tokens=(9, 77)),
            "cut off after 77 tokens; raise AVLMAPS_CHAT_MAX",
        ),
    ],
)
def test_a_refusal_and_a_cut_answer_end_it(answer: ModelReply, why: str) -> None:
    with pytest.raises(LanguageError, match=why) as told:
        program_text(answer)
    assert not isinstance(told.value, UnusableAnswerError)


def test_a_phrase_that_looks_like_a_refusal_inside_a_program_is_a_phrase() -> None:
    program = 'robot.face("sorry sign")\n# cannot: be moved'
    assert program_text(ModelReply(f"```python\n{program}\n```")) == program


@given(st.text(max_size=300))
def test_a_text_of_somebody_elses_is_one_short_line_without_control_characters(text: str) -> None:
    shown = quoted(text, 50)
    assert shown.isprintable()
    assert len(shown) <= 52


@given(st.text(alphabet="ab<>/think`\n []THINK", max_size=60))
def test_what_comes_after_the_last_thought_is_all_that_is_left(text: str) -> None:
    assert without_thoughts(f"<think>{text}</think>{GO}") == GO
    assert "</think>" not in without_thoughts(text)


@given(st.text(alphabet="`~ \npython(ab)", max_size=80))
def test_no_answer_is_read_into_anything_but_a_program_or_a_sentence(text: str) -> None:
    try:
        program = program_text(ModelReply(text))
    except LanguageError as fault:
        assert str(fault)
    else:
        assert program.strip()


def test_a_block_is_read_back_as_it_was_written() -> None:
    program = 'for i in range(3):\n    robot.turn(10)\n    if i == 1:\n        robot.face("~~~")'
    assert program_text(ModelReply(f"Text\n```python\n{program}\n```\nmore text")) == program


@pytest.mark.parametrize(
    "text",
    [
        "(" * 2_000_000,
        "`" * 2_000_000,
        "`" * 1_000_000 + "a" * 1_000_000,
        "~" * 2_000_000 + "`",
        "```" + "a" * 2_000_000 + "`",
        "# cannot:" + " " * 2_000_000 + "\x00",
        "<think>" * 1_000_000,
        "</think>" * 1_000_000,
        "```\n" * 100_000,
        "\n" * 2_000_000,
        " " * 2_000_000 + "x",
        "#!" * 1_000_000 + "i am",
    ],
    ids=range(12),
)
def test_reading_an_answer_takes_no_longer_than_it_is_long(text: str) -> None:
    # What grows with the square of the length would take hours here, and the limit of a test end it.
    with suppress(LanguageError):
        program_text(ModelReply(text))
