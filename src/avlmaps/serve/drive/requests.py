"""What clients of the driving server may send: one type for each request; anything else is refused."""

from typing import Annotated

from msgspec import Meta, Struct

from avlmaps.language.commands import MOST_CHARACTERS

Words = Annotated[str, Meta(max_length=MOST_CHARACTERS, description="A command, such as 'go to the sofa'.")]
Program = Annotated[str, Meta(max_length=20_000, description="Skills as a program, instead of a command.")]
Token = Annotated[str, Meta(min_length=1, max_length=200, description="The token of the plan that is confirmed.")]


class PlanRequest(Struct, forbid_unknown_fields=True):
    """A command or a program to plan; nothing moves."""

    words: Words = ""
    program: Program = ""


class ConfirmRequest(Struct, forbid_unknown_fields=True):
    """The token of a plan that a person has read."""

    token: Token


class NothingRequest(Struct, forbid_unknown_fields=True):
    """Nothing is sent."""
