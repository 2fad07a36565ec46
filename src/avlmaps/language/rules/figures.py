"""Amounts in figures: "one hundred and twenty degrees" becomes "120 degrees", "a square of two metres" four sides.

They apply before all other rewriting, so that no "and" or "a" within an amount is taken for another thing or order.
A number that no unit follows stays a word, for it may be part of a name; only a turn may leave its degrees unsaid.
"""

import re

from avlmaps.language.rules import words

_DEGREES = r"(?:degrees?|deg\b\.?|°)"
# A lone "a", "another" or "several" is left as it is said; "a hundred" and "a couple of" are amounts.
_SPELLED = re.compile(
    rf"\b(?!an?\b[ -](?!hundred|couple|few|pair)|another\b|several\b)({words.SPELLED})[ -]"
    rf"(?=(?:full |big |small |little )?(?:{words.UNIT}|{_DEGREES})\b)",
    re.IGNORECASE,
)
_SIDE = r"(?:to (?:the |your )?)?(?:left|right|clockwise|counter-?clockwise)(?: hand side)?"
_ENDS = r"(?=\s*(?:[.,;!?]|$)|,? (?:and|then|please)\b)"
_BEGINS = r"(?:^|(?<=[.,;:!?])\s*|(?<=\b(?:and|now) )|(?<=\bthen ))"
_CORNERS = {"triangle": 3, "square": 4, "pentagon": 5, "hexagon": 6}
# "with sides of", and what may follow their length: "long", "on each side".
_SIDES_OF = r"(?: (?:with|of))?(?: (?:the |a )?(?:sides?|edges?)(?: lengths?)?(?: of)?)?"
_ON_EACH_SIDE = r"(?: (?:sides?|edges?|long|on (?:each|a|every) side|(?:per|a|each) side))*"
# They apply in their order, to a text whose spelled amounts are figures already.
_AFTER = [
    (r"\s+or (?:so|thereabouts)\b", ""),
    # "turn left by ninety": degrees are all that a turn is counted in.
    (
        rf"\b((?:{words.TURN})(?: {_SIDE})?) (?:by )?(\d{{2,3}}|{words.WHOLE}){_ENDS}",
        lambda found: f"{found[1]} {words.number_of(found[2]):g} degrees",
    ),
    (rf"\b((?:{words.TURN})(?: a?round)? {_SIDE}) (?:by|for|through) (?=\d)", r"\1 "),
    (rf"\b((?:{words.TURN})) (?:by|for|through) (?=\d)", r"\1 "),
    # "turn around to the left by 30 degrees" is no half turn.
    (r"\b((?:turn|swing|spin|rotate|swivel)) a?round (?=(?:to the )?(?:left|right)\b[^.,;]*\d)", r"\1 "),
    (rf"\b(turn|rotate|spin) (?:a (?:little|bit)|slightly) ({_SIDE}),? (?=\d)", r"\1 \2 "),
    # "90 degrees to the left" on its own is an order.
    (rf"{_BEGINS}(\d+ {_DEGREES},? {_SIDE})\b", r" turn \1"),
    (
        rf"\b(?:do|make|take|perform|give (?:me|us)) (\d+|two|three|four|five|six|eight) quarter turns?(?: {_SIDE})?",
        lambda found: f"{_quarters(found[0])} {found[1]} times",
    ),
    (
        r"\b(?:do|make|perform|take) (?:a|one) (?:full|complete|whole)(?: \w+)? "
        r"(?:turn|circle|spin|rotation|revolution)(?: (?:on the spot|in place|where you (?:are|stand)))?",
        "turn in a full circle",
    ),
    # The sides of a figure are driven one by one, for no program can drive a figure as a whole.
    (
        r"\b(?:drive|make|do|go|walk|move|run|go round) (?:in )?a (square|triangle|pentagon|hexagon)"
        rf"{_SIDES_OF} ([\d.]+ ?(?:{words.UNIT}))\b{_ON_EACH_SIDE}"
        r"(?:,? (?:and )?turn(?:ing)? (left|right)[^.;]*)?",
        lambda found: _sides(found[1], found[2], found[3]),
    ),
    # Where the sides themselves follow, the figure says nothing more.
    (
        r"\b(?:drive|make|do|go|walk|move|run) (?:in )?(?:a|the shape of a) (?:square|triangle|circle|pentagon|hexagon)"
        r"\s*[:,] ?(?=\w)",
        "",
    ),
]
_PATTERNS = [(re.compile(pattern, re.IGNORECASE), instead) for pattern, instead in _AFTER]


def in_figures(text: str) -> str:
    """Return a text with its amounts in figures."""
    text = _SPELLED.sub(lambda found: f"{words.number_of(found[1]):g} ", text)
    for pattern, instead in _PATTERNS:
        text = pattern.sub(instead, text)
    return text


def _quarters(said: str) -> str:
    """Return one quarter turn to the side that was said: to the right where none was, as an order needs one."""
    return f"turn {'left' if words.side_of(said) == 'left' else 'right'} 90 degrees"


def _sides(figure: str, side: str, way: str | None) -> str:
    """Return a figure as its sides, one after the other, each with the turn at its corner."""
    corners = _CORNERS[figure.lower()]
    return f"do this {corners} times: go forward {side}, turn {way or 'right'} {360 / corners:g} degrees"
