"""What a person is told: intents in plain words before the robot moves, and questions back."""

from collections.abc import Sequence
from itertools import pairwise

from avlmaps.language import intents as act
from avlmaps.language.claims import claimed_words, lacking
from avlmaps.language.intents import Clarify, Intent, Pick, Refuse, Side, Target, TargetKind
from avlmaps.language.lexer import Token
from avlmaps.language.names import class_words, is_known, may_name, near_names
from avlmaps.language.word_classes import listed
from avlmaps.perception.embedded.words import is_word

_FILES = {
    TargetKind.IMAGE: "Which picture? Attach it, or name its file in the sentence.",
    TargetKind.CLIP: "Which recording? Attach it, or name its file in the sentence.",
}
_SHORT = 3  # letters; shorter words are spelt like too many others
_COMPASS = {0: "north", 45: "north-east", 90: "east", 135: "south-east", 180: "south", 225: "south-west", 270: "west",
            315: "north-west"}  # fmt: skip
_ORDINALS = {2: "second", 3: "third", 4: "fourth", 5: "fifth"}
_TIMES = {1: "once", 2: "twice"}
_SIDES = {
    Side.LEFT: "to the left of", Side.RIGHT: "to the right of", Side.FRONT: "in front of", Side.BEHIND: "behind",
    Side.NORTH: "to the north of", Side.SOUTH: "to the south of", Side.EAST: "to the east of",
    Side.WEST: "to the west of",
}  # fmt: skip


def verbalise(intents: Sequence[Intent]) -> str:
    """Return one sentence that says what the robot will do, or why it does nothing."""
    if intents and isinstance(intents[0], Refuse):
        return intents[0].said
    if intents and isinstance(intents[0], Clarify):
        return intents[0].question
    if tuple(intents) == (act.Wait(),):
        return "I will stop and stay here."
    return f"I will {_steps(intents)}.".replace(" ,", ",")


def _steps(intents: Sequence[Intent]) -> str:
    return ", then ".join(map(_step, intents)).replace(" ,", ",")


def _step(intent: Intent) -> str:
    match intent:
        case act.Go(to=target):
            return f"go to {phrase(target)}"
        case act.Face(to=target, side=Side.AHEAD):
            return f"face {phrase(target)}"
        case act.Face(to=target, side=side):
            where = "behind me" if side is Side.BEHIND else f"on my {side}"
            return f"turn until {phrase(target)} is {where}"
        case act.Turn(degrees=None, heading=heading):
            return f"turn to {_COMPASS.get(round(heading or 0), f'{heading:g} degrees on the compass')}"
        case act.Turn(degrees=degrees):
            return _turn(degrees or 0.0)
        case act.Move(metres=metres):
            return f"move {'forward' if metres > 0 else 'back'} {abs(metres):g} m"
        case act.Between(of=(a, b)):
            return f"stop between {phrase(a)} and {phrase(b)}"
        case act.Beside(of=target, side=side, metres=metres):
            return f"stop {'' if metres is None else f'{metres:g} m '}{_SIDES[side]} {phrase(target)}"
        case act.StopAt(of=target, metres=metres):
            return f"stop {metres:g} m from {phrase(target)}"
        case _:
            return _other(intent)


def _other(intent: Intent) -> str:
    match intent:
        case act.Circle(of=target, views=None, way=way):
            return f"drive around {phrase(target)} {way}".rstrip()
        case act.Circle(of=target, views=views, way=way):
            return f"look at {phrase(target)} from {views} points around it {way}".rstrip()
        case act.VisitEach(of=target):
            return f"go to each of these, the nearest first: {phrase(target)}"
        case act.Wait(seconds=seconds):
            return "stay there" if seconds is None else f"wait {seconds:g} seconds"
        case act.Return():
            return "come back here"
        case act.Repeat(times=times, body=body):
            return f"{_TIMES.get(times, f'{times} times')}: {_steps(body)}"
        case act.If(of=target, body=body, otherwise=otherwise):
            there = phrase(target).removeprefix("the ")
            if not body:
                return f", if there is no {there}, {_steps(otherwise)}"
            also = f"; otherwise {_steps(otherwise)}" if otherwise else ""
            return f", if there is a {there}, {_steps(body)}{also}"
        case _:
            return str(intent)


def _turn(degrees: float) -> str:
    if abs(degrees) == 180.0:
        return "turn around"
    return f"turn {'right' if degrees > 0 else 'left'} {abs(degrees):g} degrees"


def phrase(target: Target) -> str:
    """Return a target in words: "the chair nearest to where breathing was heard"."""
    match target.kind:
        case TargetKind.OBJECT | TargetKind.AREA:
            own = f"the {_picked(target)}"
        case TargetKind.SOUND:
            at_source = target.at == "source"
            own = f"where the sound of {target.name} comes from" if at_source else f"where {target.name} was heard"
        case TargetKind.IMAGE:
            own = f"where the picture {target.name} was taken"
        case TargetKind.CLIP:
            own = f"where a sound like {target.name} {'comes from' if target.at == 'source' else 'was heard'}"
        case TargetKind.HERE:
            return "here"
    areas = [one for one in target.near if one.kind is TargetKind.AREA]
    others = [one for one in target.near if one.kind is not TargetKind.AREA]
    beside = "near" if target.pick is Pick.NEAREST else "nearest to"
    near = f" {beside} {' and '.join(phrase(one) for one in others)}" if others else ""
    return own + near + "".join(f" in {phrase(one)}" for one in areas)


def _picked(target: Target) -> str:
    """Return the name of a thing, and which one of that name: "second nearest chair", "chair furthest to the left"."""
    nth = f"{_ORDINALS[target.number]} " if target.number > 1 else ""
    match target.pick:
        case Pick.ANY:
            return target.name
        case Pick.NEAREST | Pick.FARTHEST | Pick.OTHER:
            return f"{nth}{target.pick} {target.name}"
        case _:
            return f"{nth}{target.name} from the {target.pick}" if nth else f"{target.name} furthest {target.pick}"


def is_strange(word: str) -> bool:
    """Return whether a word is none that is known."""
    known = is_word(word) or is_known(word) or may_name(word) or word in class_words() | listed("choices")
    return len(word) > _SHORT and word.isalpha() and not known


def missing_file(kind: TargetKind) -> Clarify:
    """Return the question for "this photo" or "this recording" where no file came along."""
    return Clarify(_FILES[kind])


def unknown(name: str) -> Clarify:
    """Return the question for a name whose head is not known."""
    near = tuple(word for word, _ in near_names(name.split()[-1]))[:3]
    hint = f" Did you mean {' or '.join(near)}?" if near else " Say it in another word."
    return Clarify(f"I do not know '{name}'.{hint}", near)


def lacks_file(tokens: Sequence[Token]) -> Clarify | None:
    """Return the question for the file that a sentence speaks of and that did not come along; None where none lacks."""
    words = [token.text for token in tokens]
    for before, word in pairwise(words):
        if before in claimed_words("these") and word in claimed_words("pictures") | claimed_words("recordings"):
            kind = TargetKind.IMAGE if word in claimed_words("pictures") else TargetKind.CLIP
            return None if any(token.kind == str(kind) for token in tokens) else missing_file(kind)
    return None


def strange_word(tokens: Sequence[Token]) -> str | None:
    """Return the first word of a sentence that is none; None where all are words."""
    return next((token.text for token in tokens if token.kind == "word" and is_strange(token.text)), None)


def unclear(tokens: Sequence[Token]) -> Clarify:
    """Return the question for a command that lacks something: what it lacks, where its words show that."""
    file, strange = lacks_file(tokens), strange_word(tokens)
    if file is None and strange is not None:
        return unknown(strange)
    return file or lacking(tokens, frozenset(at for at, token in enumerate(tokens) if is_known(token.text)))
