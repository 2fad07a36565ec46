"""From a sentence to tokens: words, figures, file names, punctuation; and amounts with their units.

What is read by rule and not learnt stands here: numbers in figures and words, units, clock directions, names
of picture and sound files, and media in curly braces as the paper writes them.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import degrees
from unicodedata import normalize


@dataclass(frozen=True, slots=True)
class Token:
    """A word, figure, file name or mark.

    Attributes:
        text: lower case, clitics apart ("don't" is ``do`` and ``not``); the path of a file.
        raw: as it was written.
        kind: ``word``, ``number``, ``image``, ``clip`` or ``punct``.
        start: where it begins in the sentence.
        end: where it ends.
    """

    text: str
    raw: str
    kind: str
    start: int
    end: int


_DIGITS = {
    "zero": 0, "nought": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
    "eight": 8, "nine": 9,
}  # fmt: skip
_TEENS = {
    "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15, "sixteen": 16,
    "seventeen": 17, "eighteen": 18, "nineteen": 19,
}  # fmt: skip
TENS = {
    "twenty": 20, "thirty": 30, "forty": 40, "fourty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80,
    "ninety": 90,
}  # fmt: skip
SMALL = {**_DIGITS, **_TEENS}
_DECIMALS = frozenset({"point", "comma", "decimal", "dot"})
_PARTS_OF_TURNS = {
    "half": 2, "third": 3, "quarter": 4, "fifth": 5, "sixth": 6, "eighth": 8, "tenth": 10, "twelfth": 12,
}  # fmt: skip
_TURN_WORDS = frozenset({"turn", "circle", "rotation", "revolution", "spin"})
_WHOLE_TURNS = frozenset({"full", "whole", "complete"})
_CHARACTERS = str.maketrans("‘’“”–—−‐‑﹣－…º", "''\"\"-------.°")
_IMAGES = r"\.(?:png|jpe?g|bmp|webp|tiff?|gif)"
_CLIPS = r"\.(?:wav|flac|ogg|mp3|m4a|aac)"
_TOKEN = re.compile(
    rf"""
    (?P<brace>\{{[^{{}}]*\}})
  | (?P<image>"[^"]+{_IMAGES}"|'[^']+{_IMAGES}'|[^\s"',;:!?()<>{{}}]+{_IMAGES}(?![\w/]))
  | (?P<clip>"[^"]+{_CLIPS}"|'[^']+{_CLIPS}'|[^\s"',;:!?()<>{{}}]+{_CLIPS}(?![\w/]))
  | (?P<model>\d[dD]\b)
  | (?P<run_on>\d+(?:[.,]\d+){{2,}}|\d+(?:[.,]\d+)?(?:[_'-]\d+(?:[.,]\d+)?)+|\d{{1,3}},\d{{3}}(?!\d))
  | (?P<number>\d+(?:[.,]\d+)?(?:/\d+)?)
  | (?P<clock>o['\s]?clock\b)
  | (?P<word>[^\W\d_]+(?:['’][^\W\d_]+)*)
  | (?P<punct>->|=>|<-|\.+|[,;:!?()<>=\n-]|[^\w\s])
    """,
    re.IGNORECASE | re.VERBOSE,
)
_SPOKEN_END = re.compile(r"(?<=\w)[ ,]+(?:question mark|exclamation (?:mark|point))[ .?!]*$", re.IGNORECASE)
_CLITICS = {"'m": "am", "'re": "are", "'ve": "have", "'ll": "will", "'d": "would", "'s": "'s"}
_WHOLE = {
    "let's": "let us", "can't": "can not", "cannot": "can not", "won't": "will not", "shan't": "shall not",
    "dont": "do not", "cant": "can not", "im": "i am", "ive": "i have", "id": "i would", "thats": "that is",
    "theres": "there is", "whats": "what is", "wheres": "where is", "lets": "let us", "isnt": "is not",
    "gimme": "give me", "lemme": "let me", "wanna": "want to", "gonna": "going to", "gotta": "have to",
    "pls": "please", "plz": "please", "thx": "thanks", "u": "you", "ur": "your", "ya": "you", "goto": "go to",
    "i'd": "i would", "youre": "you are", "its": "its", "doesnt": "does not", "didnt": "did not", "'em": "them",
    "y'all": "you", "c'mon": "come on", "o'clock": "o'clock", "oclock": "o'clock", "okay": "ok", "gon": "going",
    "infront": "in front", "inbetween": "in between", "rite": "right", "tho": "though", "cuz": "because",
    "cos": "because", "til": "until", "till": "until", "nav": "navigate", "fwd": "forward", "r": "are",
}  # fmt: skip
_IS = frozenset({
    "that", "there", "what", "where", "it", "he", "she", "who", "here", "how", "someone", "somebody", "which",
    "everyone", "everybody", "something",
})  # fmt: skip
_PARTS = {"half": 0.5, "quarter": 0.25, "quarters": 0.25, "third": 1 / 3}
_COUNTED_PARTS = {"quarter": 0.25, "quarters": 0.25, "third": 1 / 3, "thirds": 1 / 3}
_VAGUE = {("a", "couple"): 2, ("a", "few"): 3, ("couple",): 2, ("few",): 3, ("several",): 3, ("a", "pair"): 2,
          ("a", "dozen"): 12, ("some",): 3}  # fmt: skip
_LONGEST_NUMBER = 12  # words
_BEGIN_NUMBERS = frozenset({*SMALL, *TENS, *_PARTS, *(words[0] for words in _VAGUE), "an", "hundred", "thousand"})
_ONES = frozenset({"a", "an", "another", "one"})
LENGTHS = {
    "m": 1.0, "metre": 1.0, "meter": 1.0, "mtr": 1.0, "cm": 0.01, "centimetre": 0.01, "centimeter": 0.01, "dm": 0.1,
    "mm": 0.001, "millimetre": 0.001, "millimeter": 0.001, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
    "yd": 0.9144, "yard": 0.9144, "in": 0.0254, "inch": 0.0254, "inche": 0.0254, "step": 0.5, "pace": 0.5, "km": 1000.0,
    "kilometre": 1000.0, "kilometer": 1000.0, "mile": 1609.344, "decimetre": 0.1, "decimeter": 0.1, "tile": 0.5,
}  # fmt: skip
_FOOT = LENGTHS["foot"]
_ANGLES = {"degree": 1.0, "deg": 1.0, "°": 1.0, "radian": degrees(1.0), "rad": degrees(1.0)}
_TIMES = {"second": 1.0, "sec": 1.0, "s": 1.0, "minute": 60.0, "min": 60.0, "moment": 2.0, "hour": 3600.0}
_SIZES = frozenset({
    "whole", "full", "good", "solid", "giant", "baby", "large", "huge", "quick", "slow", "more", "further", "big",
    "small", "little", "long", "short", "tiny", "another",
})  # fmt: skip


def tokenise(sentence: str) -> list[Token]:
    """Return the tokens of a sentence, in their order."""
    plain = without_spoken_end(normalize("NFC", sentence).translate(_CHARACTERS))
    tokens: list[Token] = []
    for found in _TOKEN.finditer(plain):
        kind, raw = found.lastgroup or "punct", found[0]
        if kind == "brace":
            inner = [Token(t.text, t.raw, t.kind, t.start, t.end) for t in tokenise(raw[1:-1])]
            media = any(t.text in ("image", "picture", "photo", "sound") for t in inner)
            tokens += [Token("{", "{", "punct", found.start(), found.start() + 1), *inner] if media else inner
        elif kind in ("image", "clip"):
            tokens.append(Token(raw.strip("\"'"), raw, kind, found.start(), found.end()))
        elif kind in ("model", "run_on"):
            tokens.append(Token(raw.lower(), raw, "word", found.start(), found.end()))
        elif kind == "word" and raw.lower() == "till" and tokens and tokens[-1].text in _BEFORE_NOUNS:
            tokens.append(Token("till", raw, "word", found.start(), found.end()))  # "the till" is no "until"
        elif kind == "word":
            tokens += _words(raw, found.start())
        elif raw == "-" and _is_minus(plain, found.start()):
            tokens.append(Token("minus", raw, "word", found.start(), found.end()))
        elif raw == "!" and re.match(r"(^|.*\s)![^\W\d_]", plain[: found.end() + 1], re.DOTALL):
            tokens.append(Token("not", raw, "word", found.start(), found.end()))  # as programs have it: "!kitchen"
        elif raw not in ("-", '"', "'", "`", "*", "_") or _stands_alone(plain, found.start(), raw):
            word = "word" if kind == "clock" or raw == "°" else kind
            text = _MARKS.get(raw, "." if _ends_an_order(plain, found.end(), raw) else raw.lower())
            tokens.append(Token("o'clock" if kind == "clock" else text, raw, word, found.start(), found.end()))
    return tokens


def _ends_an_order(text: str, end: int, raw: str) -> bool:
    """Return whether a mark is a full stop: "turn left! turn right" are two orders, and "stop!" is one."""
    return raw.startswith(".") or (raw == "!" and bool(text[end:].strip(" !.?")))


_MARKS = {"@": "at", "->": ">", "=>": ">", "\n": "."}


def without_spoken_end(text: str) -> str:
    """Return a text without the name of the mark that ends it, as dictation has it: "the sofa question mark"."""
    return _SPOKEN_END.sub("", text)


_BEFORE_NOUNS = frozenset({"the", "a", "this", "that", "my", "our", "your", "each", "every", "which", "nearest"})
_SIGNED = re.compile(r"\.?\d|pi\b", re.IGNORECASE)


def _is_minus(text: str, at: int) -> bool:
    """Return whether a hyphen is the sign of a number; a negative angle or distance leads to a question back."""
    return (at == 0 or text[at - 1] in " =([{,:;") and bool(_SIGNED.match(text, at + 1))


def _stands_alone(text: str, at: int, mark: str) -> bool:
    """Return whether a hyphen is a dash between words and not a part of one."""
    return mark == "-" and (at == 0 or text[at - 1].isspace()) and (at + 1 == len(text) or not text[at + 1].isdigit())


def _words(raw: str, start: int) -> list[Token]:
    lower, end = raw.lower(), start + len(raw)
    if lower in _WHOLE:
        return [Token(word, raw, "word", start, end) for word in _WHOLE[lower].split()]
    if lower.endswith("n't"):
        return [Token(word, raw, "word", start, end) for word in (lower[:-3], "not")]
    at = lower.rfind("'")
    if at > 0 and lower[at:] in _CLITICS:
        stem, rest = lower[:at], _CLITICS[lower[at:]]
        rest = "is" if rest == "'s" and stem in _IS else rest
        return [
            Token(stem, raw[:at], "word", start, start + at), Token(rest, raw[at:], "word", start + at, end)
        ]  # fmt: skip
    return [Token(lower.replace("'", ""), raw, "word", start, end)]


WORDS = frozenset({
    *SMALL, *TENS, *_PARTS, "hundred", "couple", "few", "several", "dozen", *LENGTHS, *_ANGLES, *_TIMES, *_SIZES,
    *_WHOLE, "o'clock",
})  # fmt: skip


def number_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the numbers that begin at a token, each with where it ends: figures, words, "half", "a couple of"."""
    found: list[tuple[int, float]] = []
    if i >= len(tokens):
        return found
    token = tokens[i]
    if token.kind != "number" and token.text not in _BEGIN_NUMBERS:
        return found
    if token.kind == "number":
        whole, _, part = token.text.replace(",", ".").partition("/")
        value = float(whole) / float(part) if part and float(part) else float(whole)
        return _with_part(tokens, i + 1, value)
    for words, value in _VAGUE.items():
        if tuple(t.text for t in tokens[i : i + len(words)]) == words:
            end = i + len(words)
            found.append((end + 1 if end < len(tokens) and tokens[end].text == "of" else end, float(value)))
    if token.text in _PARTS:
        end = i + 1
        end += end < len(tokens) and tokens[end].text == "of"
        end += end < len(tokens) and tokens[end].text in ("a", "an", "the")
        found.append((end, _PARTS[token.text]))
    found_words = spelled([each.text for each in tokens[i : i + _LONGEST_NUMBER]], 0)
    if found_words is not None:
        end, value = i + found_words[0], found_words[1]
        if tokens[end : end + 1] and tokens[end].text in ("quarters", "thirds"):
            is_of = end + 1 < len(tokens) and tokens[end + 1].text == "of"
            found.append((end + 1 + is_of, value * _COUNTED_PARTS[tokens[end].text]))
        found += _with_part(tokens, end, value)
    return found


def _with_part(tokens: list[Token], end: int, value: float) -> list[tuple[int, float]]:
    """Return a number, and the number with "and a half" or "point five" behind it."""
    found = [(end, value)]
    words = [t.text for t in tokens[end : end + 3]]
    if words[:1] == ["and"] and words[1:2] in (["a"], ["an"]) and words[2:] and words[2] in _PARTS:
        found.insert(0, (end + 3, value + _PARTS[words[2]]))
    elif words[:1] == ["and"] and words[1:2] and words[1] in _PARTS:
        found.insert(0, (end + 2, value + _PARTS[words[1]]))
    elif words[:1] == ["and"] and words[1:2] and words[1] in SMALL and words[2:] and words[2] in _COUNTED_PARTS:
        found.insert(0, (end + 3, value + SMALL[words[1]] * _COUNTED_PARTS[words[2]]))
    elif words[:1] in (["point"], ["decimal"]) and words[1:2] and words[1] in SMALL:
        found.insert(0, (end + 2, value + SMALL[words[1]] / 10))
    return found


def begins_amount(token: Token) -> bool:
    """Return whether an amount, with or without a unit, may begin with a token; with most none does."""
    return token.kind == "number" or token.text in _BEGIN_NUMBERS or token.text in _ONES


def amounts_at(tokens: list[Token], i: int, units: dict[str, float]) -> list[tuple[int, float]]:
    """Return the amounts with a unit that begin at a token: "2 m", "a metre and a half", "half a step"."""
    found: list[tuple[int, float]] = []
    if i >= len(tokens) or not begins_amount(tokens[i]):
        return found
    numbers = number_at(tokens, i)
    if tokens[i].text in _ONES:
        numbers = [*numbers, (i + 1, 1.0)]
    for end, value in numbers:
        part_of = end < len(tokens) and end > i and tokens[end - 1].text == "of" and tokens[end].text in ("a", "an")
        end += part_of  # "three quarters of an hour"
        while end < len(tokens) and tokens[end].text in _SIZES:
            end += 1
        if end < len(tokens):
            unit = _unit(tokens, end, units)
            if unit is not None:
                found += [(at, round(amount * unit, 4)) for at, amount in _with_part(tokens, end + 1, value)]
                found += _and_smaller(tokens, end + 1, value * unit, unit, units)
    return found


def _and_smaller(
    tokens: list[Token], at: int, amount: float, unit: float, units: dict[str, float]
) -> list[tuple[int, float]]:
    """Return an amount with a smaller one: "four feet six inches", "1 min 30", "a metre [and] twenty", "six foot 3"."""
    joined = at < len(tokens) and tokens[at].text == "and"
    at += joined
    for end, value in number_at(tokens, at):
        bare = end >= len(tokens) or not (is_unit(tokens, end) or tokens[end].text in _COUNTED)
        parts = 100 if units is LENGTHS and unit == 1.0 else 60 if units is _TIMES and unit == 60.0 else 0
        ends = end >= len(tokens) or tokens[end].kind == "punct"
        inches = units is LENGTHS and unit == _FOOT and not joined and 1 <= value < 12
        if bare and inches and value == int(value):
            return [(end, round(amount + value * unit / 12, 4))]
        if bare and (ends or not joined) and 10 <= value < parts and value == int(value):
            return [(end, round(amount + value * unit / parts, 4))]
        smaller = _unit(tokens, end, units) if end < len(tokens) else None
        if smaller is not None and smaller < unit and tokens[end].text not in _NO_PARTS:
            return [(end + 1, round(amount + value * smaller, 4))]
    return []


def is_unit(tokens: Sequence[Token], at: int) -> bool:
    """Return whether a unit stands at a token."""
    return at < len(tokens) and any(_unit(list(tokens), at, units) for units in (LENGTHS, _ANGLES, _TIMES))


def is_amount(tokens: Sequence[Token], at: int) -> bool:
    """Return whether a distance, an angle, a time or a clock direction begins at a token."""
    words = list(tokens)
    return any(read(words, at) for read in (length_at, angle_at, duration_at, clock_at))


def _unit(tokens: list[Token], at: int, units: dict[str, float]) -> float | None:
    word = tokens[at].text
    if units is LENGTHS and tokens[at].raw in ("'", '"'):
        return 0.3048 if tokens[at].raw == "'" else 0.0254
    if word == "in" and at + 1 < len(tokens) and tokens[at + 1].kind == "word" and tokens[at + 1].text in _AFTER_IN:
        return None
    return units.get(word) or (units.get(word.removesuffix("s")) if len(word) > 2 else None)


_NO_PARTS = frozenset({"step", "steps", "pace", "paces", "tile", "tiles"})
_COUNTED = frozenset({"times", "x", "laps", "rounds", "o'clock", ".", ")"})
_AFTER_IN = frozenset({"the", "a", "front", "between", "total", "my", "your", "this", "that", "here", "there", "from"})


def length_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the distances that begin at a token, in metres."""
    return amounts_at(tokens, i, LENGTHS)


def angle_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the angles that begin at a token, in degrees."""
    return amounts_at(tokens, i, _ANGLES)


def duration_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the times that begin at a token, in seconds."""
    return amounts_at(tokens, i, _TIMES)


def clock_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the clock direction that begins at a token ("3 o'clock"), in degrees clockwise from straight ahead."""
    return [
        (end + 1, (value % 12) * 30.0 if value % 12 <= 6 else (value % 12) * 30.0 - 360.0)
        for end, value in number_at(tokens, i)
        if end < len(tokens) and tokens[end].text == "o'clock" and 1 <= value <= 12
    ]


def spelled(words: Sequence[str], at: int) -> tuple[int, float] | None:
    """Return where the number in words ends that begins at a word, and the number; None where none begins."""
    found = _whole(words, at)
    end, value = found or (at, 0)
    if words[end : end + 1] and words[end] in _DECIMALS:
        digits = 0
        while end + 1 + digits < len(words) and words[end + 1 + digits] in _DIGITS:
            digits += 1
        if digits:
            figures = "".join(str(_DIGITS[word]) for word in words[end + 1 : end + 1 + digits])
            return end + 1 + digits, float(f"{value}.{figures}")
    if found and list(words[end : end + 4]) == ["and", "a", "half", "thousand"]:
        return end + 4, (value + 0.5) * 1000
    return None if found is None else (end, float(value))


def _whole(words: Sequence[str], at: int) -> tuple[int, int] | None:
    found = _below_thousand(words, at)
    if found is None or words[found[0] : found[0] + 1] != ["thousand"]:
        return found
    end, thousands = found[0] + 1, found[1]
    rest = _below_thousand(words, end + (words[end : end + 1] == ["and"]))
    return (end, thousands * 1000) if rest is None else (rest[0], thousands * 1000 + rest[1])


def _below_thousand(words: Sequence[str], at: int) -> tuple[int, int] | None:
    article = words[at : at + 1] == ["a"] and words[at + 1 : at + 2] in (["hundred"], ["thousand"])
    first = (at + 1, 1) if article else _below_hundred(words, at)
    if first is None:
        bare = words[at : at + 1] in (["hundred"], ["thousand"])
        if not bare:
            return None
        first = (at, 1)
    end, value = first
    if words[end : end + 1] == ["hundred"] and 0 < value < 20:
        end += 1
        rest = _below_hundred(words, end + (words[end : end + 1] == ["and"]))
        return (end, value * 100) if rest is None else (rest[0], value * 100 + rest[1])
    colloquial = _below_hundred(words, end) if 0 < value < 10 and words[end : end + 1] and words[end] in TENS else None
    return first if colloquial is None else (colloquial[0], value * 100 + colloquial[1])  # "one eighty"


def _below_hundred(words: Sequence[str], at: int) -> tuple[int, int] | None:
    word = words[at] if at < len(words) else ""
    if word in TENS:
        digit = _DIGITS.get(words[at + 1], 0) if at + 1 < len(words) else 0
        return (at + 2, TENS[word] + digit) if digit else (at + 1, TENS[word])
    value = _DIGITS.get(word, _TEENS.get(word))
    return None if value is None else (at + 1, value)


def part_of_a_turn(words: Sequence[str], at: int) -> tuple[int, float] | None:
    """Return where "a third of a full turn" ends that begins at a word, in degrees; None where none begins."""
    end, count = at, 1
    if words[at : at + 1] == ["a"]:
        end += 1
    elif words[at : at + 1] and words[at] in _DIGITS:
        end, count = at + 1, _DIGITS[words[at]]
    part = _PARTS_OF_TURNS.get(words[end].removesuffix("s").replace("halve", "half")) if end < len(words) else None
    if part is None or count == 0:
        return None
    end += 1
    end += words[end : end + 1] == ["of"]
    end += words[end : end + 1] in (["a"], ["the"], ["one"])
    while end < len(words) and words[end] in _WHOLE_TURNS:
        end += 1
    if end >= len(words) or words[end] not in _TURN_WORDS or end == at + 1:
        return None
    return end + 1, float(Fraction(360 * count, part))


def in_figures(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens with each number of several words, and each part of a turn that is no quarter, in figures."""
    words = [token.text if token.kind in ("word", "number") else "" for token in tokens]
    found: list[Token] = []
    at = 0
    while at < len(words):
        part = part_of_a_turn(words, at)
        number = spelled(words, at)
        if part is not None and part[1] % 90.0:
            end, figures, more = part[0], f"{part[1]:g}", ["degrees"]
        elif number is not None and number[0] > at + 1:
            (end, value), more = number, []
            figures = f"{value:g}" if value < 1e5 else str(int(value))
        else:
            found.append(tokens[at])
            at += 1
            continue
        raw = " ".join(token.raw for token in tokens[at:end])
        whole = replace(tokens[at], text=figures, raw=raw, kind="number", end=tokens[end - 1].end)
        found += [whole, *(replace(whole, text=word, kind="word") for word in more)]
        at = end
    return found
