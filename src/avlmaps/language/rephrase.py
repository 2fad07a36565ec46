"""Words of a command in the order and the person that the networks know: what is said of the robot is said to it.

Seven forms are rewritten, token by token, before a command is read:

- what another person should make the robot do: "send the robot to the lab", "tell it to turn left";
- a time before an order: "in five minutes go to the door", "go to the door in five minutes";
- a loop as programs have it: "for i in range(3): go to the door";
- a label as data sets have it: "the object of class lamp", "the sound labelled glass breaking";
- a point of the compass between the eight: "north north east" is "compass bearing 22.5";
- parts of turns: "turn one and a half times" is "turn 540 degrees";
- one beside the one before: "the lamp and then the one beside it" is "the lamp and then the other one".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

from avlmaps.language import lexer
from avlmaps.language.lexer import Token
from avlmaps.language.names import describes, is_entry, sounding_forms, sounding_thing, third_forms
from avlmaps.language.word_classes import listed, load_word_classes

_ROBOTS = frozenset({"robot", "bot", "machine", "rover", "droid", "vehicle", "unit", "roomba", "turtlebot", "agent"})
_ARTICLES = frozenset({"the", "my", "your", "our", "this", "that", "a"})
_PRONOUNS = frozenset({"it", "him", "her"})
_WANT = frozenset({"want", "need", "like"})
_PLACED = frozenset({"by", "at", "in", "near", "beside", "behind", "next", "over", "inside"})
_TURNED = frozenset({"turn", "rotate", "yaw", "spin", "pivot", "left", "right", "by", "clockwise", "counterclockwise"})
_WHOLE = frozenset({"full", "complete", "whole", "more", "entire"})
_SPINS = frozenset({"turn", "rotate", "spin", "pivot", "swivel", "yaw"})
_MAKES = frozenset({"do", "make", "take", "perform"})
# These the networks read as words: "a quarter turn", "half a turn", "three quarters of a turn".
_READ_AS_WORDS = (0.25, 0.5, 0.75)
_POINTS = {
    "north": 0, "northeast": 45, "east": 90, "southeast": 135, "south": 180, "southwest": 225, "west": 270,
    "northwest": 315,
}  # fmt: skip
_SHORT_POINTS = {
    "nne": 22.5, "ene": 67.5, "ese": 112.5, "sse": 157.5, "ssw": 202.5, "wsw": 247.5, "wnw": 292.5, "nnw": 337.5,
}  # fmt: skip
_A_POINT = 11.25  # degrees: a 32nd of the compass
_BESIDE = frozenset({"beside", "by", "near", "nearest", "closest", "alongside"})
_TELL = frozenset({"tell", "ask", "order", "command", "instruct"})
_LET = frozenset({"have", "let", "make"})
_BEFORE = frozenset({"and", "then", "please", "now", "next", "finally", "also", "first", "ok", "just", "you", "to"})
_NO_CLAUSE_END = frozenset(
    {"wait", "waiting", "stay", "heard", "was", "were", "rang", "barked", "pause", "hold", "count"}
)
_LABELLED = frozenset({"labelled", "labeled", "tagged", "named", "called", "titled"})
_LABELS = frozenset({"class", "type", "label", "category", "tag", "name"})
_SOUNDS = frozenset({"sound", "noise"})
_ANY = frozenset({"anything", "something", "one"})
_WHATEVER = frozenset({"what", "whatever", "whoever"})
_RELATIVE = frozenset({"that", "which", "who"})
_CUTS = frozenset({"then", "finally"})
# Who says what they heard, saw or think, and how: "I think I heard the kettle; go to the kitchen".
_SPEAKERS = frozenset({"i", "we", "he", "she", "they", "someone", "somebody", "everyone", "everybody"})
_FAR = 4  # words from who speaks to what they do: "my wife must have heard"
_ASKED_FOR = _BEFORE | {"can", "could", "would", "will", "so", "kindly", "robot", "maybe", "perhaps", "dear", ","}


def rephrased(tokens: Sequence[Token]) -> tuple[list[Token], list[str]]:
    """Return tokens with these forms rewritten, and one sentence for each that a person should know of."""
    notes: list[str] = []
    found = _unlabelled(_looped(_sounding(_in_degrees(_on_compass(_joined(tokens))))))
    found = said_to_it(_other(found, notes))
    return _waiting_first(found, notes), notes


def behind_remark(tokens: Sequence[Token]) -> int | None:
    """Return where the order begins, in characters, behind what a person heard, saw or thinks; None without both.

    What somebody heard is where to go only where the order names no place of its own: "I heard the phone, go there".
    """
    begin = next((at for at, token in enumerate(tokens) if token.text not in _BEFORE | {"well", ",", "robot"}), 0)
    if begin >= len(tokens) or tokens[begin].text not in _SPEAKERS:
        begin = begin + 1 if [token.text for token in tokens[begin : begin + 1]] == ["my"] else len(tokens)
    told = next(
        (at for at in range(begin, min(begin + _FAR, len(tokens))) if tokens[at].text in listed("remarks")), None
    )
    if told is None:
        return None
    for at in range(told + 1, len(tokens)):
        if tokens[at].kind != "punct" and tokens[at].text != "so":
            continue
        first = next((i for i in range(at + 1, len(tokens)) if tokens[i].text not in _ASKED_FOR), len(tokens))
        rest = [token.text for token in tokens[first:]]
        if rest[:1] and rest[0] in order_words():
            own = listed("pointing").isdisjoint(rest) and any(map(is_entry, rest))
            return tokens[first].start if own else None
    return None


def _joined(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens with "counter clockwise" as one word, and "sleep(5)" as a wait."""
    found: list[Token] = []
    for token in tokens:
        if token.raw in ("->", "=>"):  # "sofa -> table": one after the other
            token = _word(token, ",", "punct")
        if token.text == "wise" and found and found[-1].text == "clock":
            token = _word(found.pop(), "clockwise")
        if token.text == "clockwise" and found and found[-1].text in ("counter", "anti"):
            token = _word(found.pop(), "counterclockwise")
        elif (token.kind == "number" or token.text == "(") and found and found[-1].text == "sleep":
            found[-1] = _word(found[-1], "wait")
        found.append(token)
    return found


def _on_compass(tokens: list[Token]) -> list[Token]:
    """Return tokens with points between the eight, and degrees "on the compass", as "compass bearing 22.5"."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        end, bearing = _bearing(tokens, at)
        if bearing is None:
            found.append(tokens[at])
            at += 1
            continue
        if found and found[-1].text == "the":
            found.pop()
        found += [_word(tokens[at], "compass"), _word(tokens[at], "bearing")]
        found.append(_word(tokens[at], f"{bearing % 360:g}", "number"))
        at = end
    return found


def _bearing(tokens: list[Token], at: int) -> tuple[int, float | None]:
    """Return where a bearing ends that begins at a token, and its degrees; None where none does."""
    texts = [token.text for token in tokens[at : at + 5]]
    for end, degrees in lexer.angle_at(tokens, at):
        if [token.text for token in tokens[end : end + 3]] == ["on", "the", "compass"]:
            return end + 3, degrees
    if texts[0] in _SHORT_POINTS:
        return at + 1, _SHORT_POINTS[texts[0]]
    main = compass_point(texts[:1] if compass_point(texts[1:3])[0] == 2 else texts[:2])
    size = main[0]
    by = texts[size : size + 1] == ["by"]
    more, second = compass_point(texts[size + by : size + by + 2])
    first = main[1]
    if first is None or second is None or (not by and (first % 90 or not second % 90)):
        return at, None
    off = (second - first + 180) % 360 - 180
    if not 0 < abs(off) <= 90:
        return at, None
    return at + size + by + more, first + (_A_POINT * (1 if off > 0 else -1) if by else 0.5 * off)


def compass_point(texts: Sequence[str]) -> tuple[int, float | None]:
    """Return how many words name one of eight points, and its degrees clockwise from north; 1 and None for others."""
    joined = "".join(texts[:2])
    if len(texts) > 1 and texts[0] in _POINTS and joined in _POINTS:
        return 2, _POINTS[joined]
    return 1, _POINTS.get(texts[0]) if texts else None


def _in_degrees(tokens: list[Token]) -> list[Token]:
    """Return tokens with turns in degrees where they are no whole number, or circles of the robot itself."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        end, turns = _turns(tokens, at, found)
        if turns is None:
            found.append(tokens[at])
            at += 1
            continue
        while found and found[-1].text in ("around", "round", "by"):
            found.pop()
        if found and found[-1].text in _MAKES:
            found[-1] = _word(found[-1], "turn")
        elif not found or found[-1].text not in _TURNED | _SPINS:
            found.append(_word(tokens[at], "turn"))
        found += [_word(tokens[at], f"{360.0 * turns:g}", "number"), _word(tokens[at], "degrees")]
        at = end
    return found


def _turns(tokens: list[Token], at: int, before: list[Token]) -> tuple[int, float | None]:
    """Return where an amount of turns ends that begins at a token, and how many; None where none does."""
    words = [token.text for token in before if token.text not in ("around", "round", "by")]
    spins, makes = words[-1:] and words[-1] in _SPINS | _TURNED, words[-1:] and words[-1] in _MAKES
    begins = _begins([*before, tokens[at]], len(before)) or spins or makes
    if not begins:
        return at, None
    numbers = lexer.number_at(tokens, at) or [(at + 1, 1.0)] * (tokens[at].text in ("a", "an", "another"))
    for end, turns in sorted(numbers, reverse=True):
        while end < len(tokens) and tokens[end].text in _WHOLE:
            end += 1
        unit = tokens[end].text if end < len(tokens) else ""
        circles, times = unit in ("circle", "circles"), unit == "times"
        if circles and [token.text for token in tokens[end + 1 : end + 2]] in (["around"], ["round"]):
            continue  # a thing
        if (unit not in listed("rounds") and not times) or ((circles or times) and not (spins or (circles and makes))):
            continue
        end += 1
        if [token.text for token in tokens[end : end + 3]] == ["and", "a", "half"]:  # "a turn and a half"
            end, turns = end + 3, turns + 0.5
        decimal = tokens[at].kind == "number" and "." in tokens[at].text.replace(",", ".")
        whole = turns == int(turns) and not (circles and spins and turns > 1)
        if whole or (turns in _READ_AS_WORDS and not decimal):
            return at, None
        return end, turns
    return at, None


def _other(tokens: list[Token], notes: list[str]) -> list[Token]:
    """Return tokens with "to the lamp, then to the one beside it" as "to the lamp, then to the other one"."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        texts = [token.text for token in tokens[at : at + 6]]
        before = _named_before(found)
        again = texts[:1] == ["the"] and bool(before) and texts[1:2] in (["one"], before[:1])
        size = 3 if texts[2:3] and texts[2] in _BESIDE else 4 if texts[2:4] in _NEXT_TO else 0
        size += texts[size : size + 1] == ["to"] and size == 3
        if not (again and size and texts[size : size + 1] == ["it"]):
            found.append(tokens[at])
            at += 1
            continue
        notes.append(f"'{' '.join(texts[: size + 1])}' is read as: the other one, the nearest to it.")
        found += [tokens[at], _word(tokens[at], "other"), tokens[at + 1]]
        at += size + 1
    return found


def _named_before(tokens: Sequence[Token]) -> list[str]:
    """Return the names of things in the order before, the one that it goes to first."""
    end = len(tokens)
    while end and not is_entry(tokens[end - 1].text):
        end -= 1
    start = end
    while start and tokens[start - 1].kind != "punct" and tokens[start - 1].text not in ("then", "and"):
        start -= 1
    return [token.text for token in tokens[start:end] if is_entry(token.text)]


_NEXT_TO = (["next", "to"], ["close", "to"], ["right", "beside"], ["adjacent", "to"])


def _sounding(tokens: Sequence[Token]) -> list[Token]:
    """Return tokens with "the thing that rings" as "whatever is ringing": rings are things, too."""
    found: list[Token] = []
    for token in tokens:
        before = [one.text for one in found[-2:]]
        relates = before[-1:] and (
            before[-1] in _WHATEVER or (before[-1] in _RELATIVE and before[0] in listed("generic"))
        )
        relates = relates or (before[-1:] and before[-1] in _RELATIVE and before[0] in listed("nameless"))
        if relates and token.text in third_forms():
            found += [_word(token, "is"), _word(token, sounding_forms()[token.text])]
        else:
            found.append(token)
        found = _nameless(found)
    return found


def _nameless(tokens: list[Token]) -> list[Token]:
    """Return tokens at the end of which "the beeping device", "the thing that is beeping" are "whatever is beeping"."""
    last = [token.text for token in tokens[-4:]]
    if sounding_thing(*last[-2:]):
        begin, sound = len(tokens) - 2, tokens[-2]
    elif last[1:2] and last[1] in _RELATIVE and last[2:3] == ["is"] and sounding_thing(last[-1], last[0]):
        begin, sound = len(tokens) - 4, tokens[-1]
    else:
        return tokens
    before = tokens[begin - 1].text if begin else ""
    if describes(before):  # "the blue beeping thing"
        return tokens
    begin -= before in _ARTICLES | {"an", "some", "any"}
    return [*tokens[:begin], _word(sound, "whatever"), _word(sound, "is"), sound]


def _word(like: Token, text: str, kind: str = "word") -> Token:
    return replace(like, text=text, kind=kind)


def _begins(tokens: Sequence[Token], at: int) -> bool:
    """Return whether an order may begin at a token."""
    return at == 0 or tokens[at - 1].kind == "punct" or tokens[at - 1].text in _BEFORE


def _robot(tokens: Sequence[Token], at: int) -> int:
    """Return where "the robot" ends that begins at a token; the token itself where none does."""
    end = at + (at < len(tokens) and tokens[at].text in _ARTICLES)
    return end + 1 if end < len(tokens) and tokens[end].text in _ROBOTS else at


@cache
def order_words() -> frozenset[str]:
    """Return the words that begin an order to the robot."""
    classes = load_word_classes().words
    names = ("GO", "TURN", "FACE", "WAIT", "CIRCLE", "RETURN", "BACK_UP")
    begins = {phrase.split()[0] for name in names for phrase in classes[name]}
    return frozenset(begins - {"the", "a", "be", "is", "to", "you", "your", "in", "on", "and", "with"})


def said_to_it(tokens: list[Token]) -> list[Token]:
    """Return tokens with what is said of the robot said to it: "send the robot to the lab", "tell it to turn left"."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        asks = at > 0 and tokens[at - 1].text in listed("before_orders")
        end, kept = _third(tokens, at) if _begins(tokens, at) or asks else (at, [])
        if end > at:
            found += kept
            at = end
            continue
        found.append(tokens[at])
        at += 1
    return found


def _third(tokens: list[Token], at: int) -> tuple[int, list[Token]]:
    """Return where an order about the robot ends that begins at a token, and the words to say to it instead."""
    verb = tokens[at].text
    end = _robot(tokens, at + 1)
    robot = end > at + 1
    follows = tokens[end].text if end < len(tokens) else ""
    if verb in listed("sent") and robot and follows in listed("behind_sent"):
        return end, [_word(tokens[at], "go")]
    if verb in _WANT and robot and follows in _PLACED:
        return end, [_word(tokens[at], word) for word in ("want", "you", "to", "go")]
    if verb == "send" and tokens[at + 1 : at + 2] and tokens[at + 1].text in _PRONOUNS:
        after = tokens[at + 2].text if at + 2 < len(tokens) else ""
        return (at + 2, [_word(tokens[at], "go")]) if after in listed("behind_sent") else (at, [])
    if verb in listed("driven") and robot:
        return end, [tokens[at]]
    return _told(tokens, at, end, robot=robot) if verb in _TELL | _LET else (at, [])


def _told(tokens: list[Token], at: int, end: int, *, robot: bool) -> tuple[int, list[Token]]:
    """Return where "tell it to", "let the robot" ends that begins at a token; the token where no order follows."""
    if not robot:
        if at + 1 >= len(tokens) or tokens[at + 1].text not in _PRONOUNS:
            return at, []
        end = at + 2
    tells = tokens[at].text in _TELL
    if tells:
        if end >= len(tokens) or tokens[end].text != "to":
            return at, []
        end += 1
    follows = tokens[end].text if end < len(tokens) else ""
    return (end, []) if follows in order_words() or (robot and tells and follows) else (at, [])


@dataclass(frozen=True, slots=True)
class _Ahead:
    """What is to be done before an order and is said beside it: "in five minutes", "after 2 m", "ten seconds later".

    Attributes:
        words: the same as an order of its own.
        end: the token behind it.
        is_wait: whether it is a time, and no distance.
    """

    words: tuple[Token, ...]
    end: int
    is_wait: bool


def _waiting_first(tokens: list[Token], notes: list[str]) -> list[Token]:
    """Return tokens with "in five minutes", "after 2 m" as an order of its own before the one that they belong to."""
    start = 0
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        ahead = _ahead(tokens, at, found[start:])
        if ahead is None:
            ends = tokens[at].kind == "punct" or tokens[at].text in _CUTS
            if ends or (tokens[at].text == "and" and tokens[at + 1 : at + 2] and tokens[at + 1].text in order_words()):
                start = len(found) + 1
            found.append(tokens[at])
            at += 1
            continue
        said = " ".join(token.text for token in tokens[at : ahead.end])
        notes.append(f"'{said}' is read as: {'wait' if ahead.is_wait else 'drive so far'} first.")
        opens = all(token.text in _BEFORE for token in found[start:])
        found[start:start] = ahead.words
        at = ahead.end
        while opens and at < len(tokens) and tokens[at].text in (",", "then"):
            at += 1
    return found


def _ahead(tokens: list[Token], at: int, clause: Sequence[Token]) -> _Ahead | None:
    """Return what is to be done first and begins at a token, where it opens or closes its clause; else None."""
    found = _delay(tokens, at) or _way_first(tokens, at, clause)
    if found is None:
        return None
    opens = all(token.text in _BEFORE for token in clause)
    follows = tokens[found.end] if found.end < len(tokens) else None
    closes = follows is None or follows.kind == "punct" or follows.text in ("then", "and")
    if opens:
        return found if follows is not None else None
    return found if closes and _NO_CLAUSE_END.isdisjoint(token.text for token in clause) else None


def _delay(tokens: list[Token], at: int) -> _Ahead | None:
    """Return the delay that begins at a token: "in five minutes", "after ten seconds", "a minute later"."""
    first = at + (tokens[at].text in ("in", "after"))
    if tokens[first : first + 1] and tokens[first].text == "a" and tokens[first + 1 : first + 2]:
        first += tokens[first + 1].text in ("quarter", "half", "third")
    ends = [end for end, _ in lexer.duration_at(tokens, first)]
    if (
        not ends
        or tokens[max(ends) - 1].text in ("moment", "sec")
        or (tokens[first].text in ("a", "another") and tokens[max(ends) - 1].text == "second")
    ):
        return None
    stop = end = max(ends)
    after = [token.text for token in tokens[end : end + 2]]
    if tokens[at].text not in ("in", "after"):
        end += 2 if after == ["from", "now"] else after[:1] in (["later"], ["hence"])
        if end == stop:
            return None
    else:
        end += after[:1] == ["time"]
        if after[:1] and after[0] in ("of", "ago", "'s"):
            return None
    return _Ahead((_word(tokens[at], "wait"), *tokens[first:stop], _word(tokens[at], "then")), end, is_wait=True)


def _way_first(tokens: list[Token], at: int, clause: Sequence[Token]) -> _Ahead | None:
    """Return the distance to drive first that begins at a token: "turn left after 2 m", "in 3 m turn right"."""
    if tokens[at].text not in ("in", "after"):
        return None
    ends = [end for end, _ in lexer.length_at(tokens, at + 1)]
    rest = [*(token.text for token in clause), *(token.text for token in tokens[max(ends, default=at) : at + 9])]
    if (
        not ends
        or not {"turn", "rotate", "go", "drive", "stop"} & set(rest)
        or "of" in rest[len(clause) : len(clause) + 1]
    ):
        return None
    if tokens[at].text == "in" and "turn" not in rest:
        return None
    move = (_word(tokens[at], "move"), *tokens[at + 1 : max(ends)], _word(tokens[at], "forward"))
    return _Ahead((*move, _word(tokens[at], "then")), max(ends), is_wait=False)


def _unlabelled(tokens: list[Token]) -> list[Token]:
    """Return tokens with "the object of class lamp" as "the lamp", "the sound labelled glass breaking" as a sound."""
    found: list[Token] = []
    at = 0
    while at < len(tokens):
        end = _label_end(tokens, at) if tokens[at].text in listed("generic") else at
        if end == at or end >= len(tokens) or tokens[end].kind != "word":
            found.append(tokens[at])
            at += 1
            continue
        if tokens[at].text in _SOUNDS:
            found += [tokens[at], _word(tokens[at], "of")]
        elif (
            tokens[at].text in _ANY
            and not (found and found[-1].text in _ARTICLES)
            and tokens[end].text not in _ARTICLES
        ):
            found.append(_word(tokens[at], "a"))
        at = end
    return found


def _label_end(tokens: list[Token], at: int) -> int:
    """Return where the name begins that is said as a label of the noun at a token; the token itself where none is."""
    texts = [token.text for token in tokens[at : at + 6]]
    end = 1 + (texts[1:2] == ["source"])
    end += 2 if texts[end : end + 2] in (["that", "is"], ["which", "is"]) else 0
    if set(texts[end : end + 1]) & _LABELLED:
        return at + end + 1
    if texts[end : end + 2] in (["classified", "as"], ["known", "as"]):
        return at + end + 2
    if texts[end : end + 1] in (["of"], ["with"]) and _LABELS & set(texts[end + 1 : end + 3]):
        return at + end + (2 if texts[end + 1] in _LABELS else 3)
    return at


def _looped(tokens: list[Token]) -> list[Token]:
    """Return tokens with "for i in range(3): go" as "go. Do this 3 times"."""
    texts = [token.text for token in tokens]
    for at, text in enumerate(texts):
        head = _loop_head(tokens, at) if text == "for" else None
        if head is None:
            continue
        begin, times = head
        while begin < len(tokens) and texts[begin] in (")", ":", "{", "do", "."):
            begin += 1
        end = next((i for i in range(begin, len(tokens)) if texts[i] == "}"), len(tokens))
        body = tokens[begin:end]
        while body and body[-1].kind == "punct" and body[-1].text in (".", ";", ","):
            body = body[:-1]
        often = [_word(tokens[at], ".", "punct"), _word(tokens[at], "do"), _word(tokens[at], "this"),
                 _word(tokens[at], str(times), "number"), _word(tokens[at], "times")]  # fmt: skip
        return [*tokens[:at], *body, *often, *tokens[end + 1 :]]
    return tokens


def _loop_head(tokens: list[Token], at: int) -> tuple[int, int] | None:
    """Return where the head of a loop ends that begins at a token, and how often it goes round."""
    texts = [token.text for token in tokens]
    brackets = texts[at + 1 : at + 2] == ["("]
    numbers: list[int] = []
    end = at + 1
    limit = min(len(tokens), at + 24)
    if "range" in texts[at : at + 6]:
        end = texts.index("range", at) + 1
        while end < limit and texts[end] != ")":
            numbers += [int(texts[end])] if texts[end].isdigit() else []
            end += 1
        if 1 <= len(numbers) <= 2 and end < limit:
            return end + 1, numbers[-1] - (numbers[0] if len(numbers) == 2 else 0)
    elif brackets and "<" in texts[at:limit]:
        less = texts.index("<", at)
        equal = texts[less + 1 : less + 2] == ["="]
        count = texts[less + 1 + equal] if less + 1 + equal < len(texts) else ""
        start = next((text for text in texts[at:less] if text.isdigit()), "0")
        close = next((i for i in range(less, limit) if texts[i] == ")"), None)
        if count.isdigit() and close is not None:
            return close + 1, int(count) - int(start) + equal
    return None
