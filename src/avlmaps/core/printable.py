"""Text from outside made safe to print.

Names in a map, answers of a robot, programs of a language model and file names are foreign text. Printed as they are,
control characters move a terminal's cursor or change its settings, and marks of direction show a line in another order
than it has. Everything that prints such text passes it through here.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any, cast

# All of Cc, Cs, Zl and Zp, and every Cf that is invisible or turns the direction of writing. The two joiners U+200C
# and U+200D stay: Persian words, Indian scripts and emoji are spelt with them.
_UNSAFE = (
    "\x00-\x1f\x7f-\x9f\xad\u0600-\u0605\u061c\u06dd\u070f\u0890\u0891\u08e2\u180e\u200b\u200e\u200f\u2028-\u202e"
    "\u2060-\u2064\u2066-\u206f\ud800-\udfff\ufeff\ufff9-\ufffb\U000110bd\U000110cd\U00013430-\U0001343f\U0001bca0-\U0001bca3"
    "\U0001d173-\U0001d17a\U000e0001\U000e0020-\U000e007f"
)
UNSAFE = re.compile(f"[{_UNSAFE}]")
"""One character that is not printed as it is."""
_SHORT = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}


def printable(text: object, most: int | None = None) -> str:
    """Return a text on one line that a terminal shows as it is written: what is unsafe becomes its escape.

    A text of more than ``most`` characters ends in an ellipsis.
    """
    safe = UNSAFE.sub(lambda found: _escaped(found.group()), str(text))
    return safe if most is None or len(safe) <= most else safe[: max(most - 1, 0)] + "…"


def shortened(answer: Any) -> Any:
    """Return JSON without digits that no measurement has: six of a small number, six after the point of others."""
    if isinstance(answer, float):
        return (round(answer, 6) if abs(answer) >= 0.1 else float(f"{answer:.6g}")) + 0.0  # -0.0 is 0.0
    if isinstance(answer, Mapping):
        return {key: shortened(value) for key, value in cast("Mapping[Any, Any]", answer).items()}
    if isinstance(answer, list | tuple):
        return [shortened(value) for value in cast("Sequence[Any]", answer)]
    return answer


def printable_json(encoded: str) -> str:
    """Return a line of JSON with the unsafe characters in its strings escaped as JSON does; its values stay."""
    return UNSAFE.sub(lambda found: _utf16_escapes(found.group()), encoded)


def plot_text(text: object, most: int | None = None) -> str:
    """Return a text for a plot: printable, and with its dollar signs as they are, not as the marks of a formula."""
    return printable(text, most).replace("$", r"\$")


def _escaped(character: str) -> str:
    code = ord(character)
    width, letter = (2, "x") if code < 0x100 else (4, "u") if code < 0x10000 else (8, "U")
    return _SHORT.get(character, f"\\{letter}{code:0{width}x}")


def _utf16_escapes(character: str) -> str:
    halves = character.encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{halves[at : at + 4]}" for at in range(0, len(halves), 4))
