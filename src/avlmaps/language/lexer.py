"""From a sentence to tokens: words, figures, file names, punctuation; and amounts with their units.

What is read by rule and not learnt stands here, its words in `amounts.toml`: numbers in figures and words, units, clock
directions, names of picture and sound files, and media in curly braces as the paper writes them.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from unicodedata import normalize

from avlmaps.language.word_classes import listed, table, word_list, words_of


@dataclass(frozen=True, slots=True)
class Token:
    """A word, figure, file name or mark."""

    text: str  # lower case, clitics apart ("don't" is ``do`` and ``not``); the path of a file
    raw: str  # as written
    kind: str  # ``word``, ``number``, ``image``, ``clip`` or ``punct``
    start: int  # among the sentence's characters
    end: int


_TABLE = table("amounts")
_list = partial(word_list, "amounts")
LENGTHS, _ANGLES, _TIMES = (_TABLE[name] for name in ("lengths", "angles", "times"))
_FOOT = LENGTHS["foot"]
_SMALL, _TENS = (_TABLE["words"][name].split("|") for name in ("small", "tens"))
_NUMBERS = {word: at for at, word in enumerate(_SMALL)} | {word: 10 * at for at, word in enumerate(_TENS, 2)}
_NUMBERS |= {"nought": 0, "fourty": 40}
WORDS = frozenset({
    *_NUMBERS, *_TABLE["vague"], *_TABLE["parts"], "hundred", "dozen", *LENGTHS, *_ANGLES, *_TIMES, *_list("sizes"),
    *_TABLE["short"],
})  # fmt: skip
_BEGIN_NUMBERS = frozenset({
    *_NUMBERS, *(words.split()[0] for words in _TABLE["vague"]), "half", "quarter", "quarters", "third", "an",
    "hundred", "thousand",
})  # fmt: skip
_LONGEST_NUMBER = 12  # words
_COUNTED_PARTS = {name: 1 / part for name, part in _TABLE["parts"].items() if name != "half"}
_PARTS = {name: 1 / part for name, part in _TABLE["parts"].items() if name != "thirds"}
# These the networks read as words: "a quarter turn", "half a turn", "three quarters of a turn".
_READ_AS_WORDS = (0.25, 0.5, 0.75)
_CHARACTERS = str.maketrans("‘’“”–—−‐‑﹣－…º", "''\"\"-------.°")
_MARKS = {"@": "at", "->": ">", "=>": ">", "\n": "."}
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
  | (?P<minus>(?<![^ =(\[{{,:;])-(?=\.?\d|pi\b))
  | (?P<not>(?<!\S)!(?=[^\W\d_]))
  | (?P<none>(?<=\S)-(?!>)|-(?=\d)|["'`*])
  | (?P<punct>->|=>|<-|\.+|[,;:!?()<>=\n-]|[^\w\s])
    """,
    re.IGNORECASE | re.VERBOSE,
)
_SPOKEN_END = re.compile(r"(?<=\w)[ ,]+(?:question mark|exclamation (?:mark|point))[ .?!]*$", re.IGNORECASE)


def tokenise(sentence: str) -> list[Token]:
    """Return the tokens of a sentence, in their order."""
    plain = without_spoken_end(normalize("NFC", sentence).translate(_CHARACTERS))
    tokens: list[Token] = []
    for found in _TOKEN.finditer(plain):
        kind, raw, start, end = found.lastgroup or "punct", found[0], found.start(), found.end()
        if kind == "brace":
            inner = tokenise(raw[1:-1])
            media = any(t.text in ("image", "picture", "photo", "sound") for t in inner)
            tokens += [Token("{", "{", "punct", start, start + 1), *inner] if media else inner
        elif kind in ("image", "clip"):
            tokens.append(Token(raw.strip("\"'"), raw, kind, start, end))
        elif kind == "word" and raw.lower() == "till" and tokens and tokens[-1].text in _list("before_nouns"):
            tokens.append(Token("till", raw, "word", start, end))  # "the till" is no "until"
        elif kind == "word":
            tokens += _words(raw, start)
        elif kind in ("minus", "not"):  # a minus leads to a question back; programs write "!kitchen"
            tokens.append(Token(kind, raw, "word", start, end))
        elif kind != "none":
            word = "word" if kind in ("clock", "model", "run_on") or raw == "°" else kind
            # "turn left! turn right" are two orders, and "stop!" is one
            stops = raw.startswith(".") or (raw == "!" and plain[end:].strip(" !.?"))
            text = _MARKS.get(raw, "." if stops else raw.lower())
            tokens.append(Token("o'clock" if kind == "clock" else text, raw, word, start, end))
    return tokens


def without_spoken_end(text: str) -> str:
    """Return a text without the name of the mark that ends it, as dictation has it: "the sofa question mark"."""
    return _SPOKEN_END.sub("", text)


def _words(raw: str, start: int) -> list[Token]:
    lower, end = raw.lower(), start + len(raw)
    at, short = lower.rfind("'"), _TABLE["short"].get(lower)
    if short is not None:
        return [Token(word, raw, "word", start, end) for word in short.split()]
    if lower.endswith("n't"):
        return [Token(word, raw, "word", start, end) for word in (lower[:-3], "not")]
    rest = _TABLE["clitics"].get(lower[at:]) if at > 0 else None
    if rest is None:
        return [Token(lower.replace("'", ""), raw, "word", start, end)]
    rest = "is" if rest == "'s" and lower[:at] in _list("is") else rest
    middle = start + at
    return [Token(lower[:at], raw[:at], "word", start, middle), Token(rest, raw[at:], "word", middle, end)]


@cache
def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(rf"{words_of('amounts')[name]}(?= |$)")


def spelled(words: Sequence[str]) -> tuple[int, float] | None:
    """Return how many words a number takes that some words begin with, and the number; None where none does."""
    found = _pattern("spelled").match(" ".join(words[:_LONGEST_NUMBER]))
    if found is None:
        return None
    size = found[0].count(" ") + 1
    if found["run"]:
        return size, float("".join(str(_NUMBERS[word]) for word in found["run"].split()))
    if found["half"]:
        return size, _folded(found["half"].split()[:-4]) * 1000 + 500.0
    digits = "".join(str(_NUMBERS[word]) for word in (found["digits"] or "").split())
    return size, float(f"{_folded((found['whole'] or found['alone'] or '').split())}.{digits or 0}")


def _folded(words: Sequence[str]) -> int:
    thousands = part = 0
    for word in words:
        if word == "hundred":
            part = 100 * (part or 1)
        elif word == "thousand":
            thousands, part = 1000 * (part or 1), 0
        elif word in _NUMBERS:
            value = _NUMBERS[word]
            part = 100 * part + value if 0 < part < 10 and value >= 20 else part + value  # "one eighty"
    return thousands + part


def in_figures(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens with numbers of several words in figures, and turns that are no whole number in degrees.

    "Two hundred and five" is 205, "a third of a full turn" 120 degrees, "one and a half times" 540 degrees.
    """
    words = [token.text if token.kind in ("word", "number") else "|" for token in tokens]
    found: list[Token] = []
    at = 0
    while at < len(words):
        end, turns = _turns(list(tokens), at)
        part = _pattern("part").match(" ".join(words[at : at + _LONGEST_NUMBER]))
        number = spelled(words[at:])
        before = next((token.text for token in reversed(found) if token.text not in _list("round")), "")
        begins = not found or found[-1].kind == "punct" or before in {"and", "then"} | _list("turns") | _list("makes")
        figures, more = "", ["degrees"]
        if turns is not None and begins:
            while found and found[-1].text in _list("round") | _list("makes"):
                found.pop()
            if not found or found[-1].text not in _list("turns"):
                found.append(replace(tokens[at], text="turn", kind="word"))
            figures = f"{360.0 * turns:g}"
        elif part and part[0].count(" ") > 1 and (angle := _part_of_a_turn(part)) % 90.0:  # no "third turn"
            end, figures = at + part[0].count(" ") + 1, f"{angle:g}"
        elif number is not None and number[0] > 1:
            end, more = at + number[0], []
            figures = f"{number[1]:g}" if number[1] < 1e5 else str(int(number[1]))
        if not figures:
            found.append(tokens[at])
            at += 1
            continue
        raw = " ".join(token.raw for token in tokens[at:end])
        whole = replace(tokens[at], text=figures, raw=raw, kind="number", end=tokens[end - 1].end)
        found += [whole, *(replace(whole, text=word, kind="word") for word in more)]
        at = end
    return found


def _part_of_a_turn(found: re.Match[str]) -> float:
    count = _NUMBERS[found["count"]] if found["count"] else 1
    return 360.0 * count / _TABLE["turns"][found["part"]]


def _turns(tokens: list[Token], at: int) -> tuple[int, float | None]:
    numbers = number_at(tokens, at) or [(at + 1, 1.0)] * (tokens[at].text in ("a", "an", "another"))
    for end, turns in sorted(numbers, reverse=True):
        while end < len(tokens) and tokens[end].text in ("full", "complete", "whole", "more", "entire"):
            end += 1
        unit = tokens[end].text if end < len(tokens) else ""
        if unit not in listed("rounds") and unit != "times":
            continue
        if [token.text for token in tokens[end + 1 : end + 4]] == ["and", "a", "half"]:  # "a turn and a half"
            end, turns = end + 3, turns + 0.5
        decimal = tokens[at].kind == "number" and "." in tokens[at].text.replace(",", ".")
        whole = turns == int(turns) and not (unit == "circles" and turns > 1)
        return (at, None) if whole or (turns in _READ_AS_WORDS and not decimal) else (end + 1, turns)
    return at, None


def number_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the numbers that begin at a token, each with where it ends: figures, words, "half", "a couple of"."""
    token, found = tokens[i] if i < len(tokens) else None, list[tuple[int, float]]()
    if token is None or (token.kind != "number" and token.text not in _BEGIN_NUMBERS):
        return found
    if token.kind == "number":
        whole, _, part = token.text.replace(",", ".").partition("/")
        value = float(whole) / float(part) if part and float(part) else float(whole)
        return _with_part(tokens, i + 1, value)
    words = [each.text for each in tokens[i : i + _LONGEST_NUMBER]]
    for size in (2, 1):
        value = _TABLE["vague"].get(" ".join(words[:size]))
        if value is not None and len(words) >= size:
            found.append((i + size + (words[size : size + 1] == ["of"]), float(value)))
    if token.text in _PARTS:
        size = 1 + (words[1:2] == ["of"])
        size += words[size : size + 1] in (["a"], ["an"], ["the"])
        found.append((i + size, _PARTS[token.text]))
    number = spelled(words)
    if number is not None:
        size, value = number
        if words[size : size + 1] in (["quarters"], ["thirds"]):
            is_of = words[size + 1 : size + 2] == ["of"]
            found.append((i + size + 1 + is_of, value * _COUNTED_PARTS[words[size]]))
        found += _with_part(tokens, i + size, value)
    return found


def _with_part(tokens: list[Token], end: int, value: float) -> list[tuple[int, float]]:
    match [token.text for token in tokens[end : end + 3]]:
        case ["and", "a" | "an", part] if part in _PARTS:
            return [(end + 3, value + _PARTS[part]), (end, value)]
        case ["and", part, *_] if part in _PARTS:
            return [(end + 2, value + _PARTS[part]), (end, value)]
        case ["and", count, part] if _NUMBERS.get(count, 20) < 20 and part in _COUNTED_PARTS:
            return [(end + 3, value + _NUMBERS[count] * _COUNTED_PARTS[part]), (end, value)]
        case ["point" | "decimal", digit, *_] if _NUMBERS.get(digit, 20) < 20:
            return [(end + 2, value + _NUMBERS[digit] / 10), (end, value)]
        case _:
            return [(end, value)]


def begins_amount(token: Token) -> bool:
    """Return whether an amount, with or without a unit, may begin with a token; with most none does."""
    return token.kind == "number" or token.text in _BEGIN_NUMBERS or token.text in _list("ones")


def amounts_at(tokens: list[Token], i: int, units: Mapping[str, float]) -> list[tuple[int, float]]:
    """Return the amounts with a unit that begin at a token: "2 m", "a metre and a half", "half a step"."""
    found: list[tuple[int, float]] = []
    if i >= len(tokens) or not begins_amount(tokens[i]):
        return found
    numbers = number_at(tokens, i)
    if tokens[i].text in _list("ones"):
        numbers = [*numbers, (i + 1, 1.0)]
    for end, value in numbers:
        part_of = end < len(tokens) and end > i and tokens[end - 1].text == "of" and tokens[end].text in ("a", "an")
        end += part_of  # "three quarters of an hour"
        while end < len(tokens) and tokens[end].text in _list("sizes"):
            end += 1
        unit = _unit(tokens, end, units)
        if unit is not None:
            found += [(at, round(amount * unit, 4)) for at, amount in _with_part(tokens, end + 1, value)]
            found += _and_smaller(tokens, end + 1, value * unit, unit, units)
    return found


def _and_smaller(
    tokens: list[Token], at: int, amount: float, unit: float, units: Mapping[str, float]
) -> list[tuple[int, float]]:
    """Return an amount with a smaller one: "four feet six inches", "1 min 30", "a metre [and] twenty", "six foot 3"."""
    joined = at < len(tokens) and tokens[at].text == "and"
    for end, value in number_at(tokens, at + joined):
        ends = end >= len(tokens) or tokens[end].kind == "punct"
        is_unit = any(_unit(tokens, end, each) for each in (LENGTHS, _ANGLES, _TIMES))
        bare = end >= len(tokens) or not (is_unit or tokens[end].text in _list("counted"))
        parts = 100 if units is LENGTHS and unit == 1.0 else 60 if units is _TIMES and unit == 60.0 else 0
        inches = units is LENGTHS and unit == _FOOT and not joined and 1 <= value < 12
        hundredths = (ends or not joined) and 10 <= value < parts
        if bare and value == int(value) and (inches or hundredths):
            return [(end, round(amount + value * unit / (12 if inches else parts), 4))]
        smaller = _unit(tokens, end, units)
        if smaller is not None and smaller < unit and tokens[end].text not in _list("no_parts"):
            return [(end + 1, round(amount + value * smaller, 4))]
    return []


def _unit(tokens: Sequence[Token], at: int, units: Mapping[str, float]) -> float | None:
    if at >= len(tokens):
        return None
    word, behind = tokens[at].text, tokens[at + 1].text if at + 1 < len(tokens) else ""
    if word == "in" and behind in _list("after_in"):
        return None
    return units.get(word) or (units.get(word.removesuffix("s")) if len(word) > 2 else None)


def clock_at(tokens: list[Token], i: int) -> list[tuple[int, float]]:
    """Return the clock direction that begins at a token ("3 o'clock"), in degrees clockwise from straight ahead."""
    return [
        (end + 1, (value % 12) * 30.0 if value % 12 <= 6 else (value % 12) * 30.0 - 360.0)
        for end, value in number_at(tokens, i)
        if end < len(tokens) and tokens[end].text == "o'clock" and 1 <= value <= 12
    ]


length_at, angle_at, duration_at = (partial(amounts_at, units=units) for units in (LENGTHS, _ANGLES, _TIMES))
READS: Mapping[str, Callable[[list[Token], int], list[tuple[int, float]]]] = {
    "clock": clock_at, "m": length_at, "deg": angle_at, "s": duration_at, "n": number_at,
}  # fmt: skip
"""What reads each kind of amount at a token: metres, degrees, seconds or a count, each with where it ends."""
