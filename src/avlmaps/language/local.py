"""The paper's way on this machine: a language model completes examples of commands and their programs.

The model writes under a grammar (GBNF) that is made from the table of skills for each sentence: every skill exists,
each name is of words that were said, each amount was said or needs no number. What it writes is read as intents and
checked as a reading of the learned reader is. The gate, the dangers and the refusals stand before it. Where both read
the same, the robot drives; where they differ, a person is asked.
"""

import ast
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from hashlib import sha256
from importlib import import_module
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from string import Template
from typing import Any
from urllib.request import Request, urlopen

from avlmaps.core.errors import BackendError, LanguageError
from avlmaps.core.extras import install_command
from avlmaps.language import intents as act
from avlmaps.language.commands import read_command
from avlmaps.language.gate import no_order
from avlmaps.language.intents import Intent, Pick, Refuse, Side, Target, TargetKind, on_targets, targets_of
from avlmaps.language.learned.decision import Command, NameResolver, Weighed, is_same, weighed, which
from avlmaps.language.learned.linear import amount, amount_end
from avlmaps.language.learned.reader import Read
from avlmaps.language.lexer import READS, Token, tokenise
from avlmaps.language.names import is_known
from avlmaps.language.program.vocabulary import Skill, ValueType, skills
from avlmaps.language.sentence import Attachments, Sentence, stand_ins
from avlmaps.language.translator import LearnedTranslator
from avlmaps.perception.models import cache_folder

_ALWAYS, _NEAREST = 6, 4  # examples: the first ones, whose state is kept, and the nearest ones
_SURE = 0.9  # the probability from which on the reader needs no second opinion
_MOST_TOKENS, _TIMEOUT_S, _CONTEXT = 160, 300.0, 2048
_TAKES = (
    "--llm takes a GGUF file (docs/guides/local-model.md), or the address of a llama.cpp server "
    "(llama-server -m FILE.gguf), such as http://localhost:8080."
)
_HEAD = "# Programs for a robot. It is told to do this, and does it:\n\n"
_TARGETS = frozenset({ValueType.STRING, ValueType.PLACE, ValueType.HEAT})
_ARTICLES = frozenset({"a", "an", "the"})
_SIGNED = ("turn", "move_forward")
# What may be said without a number, by the unit at the end of a parameter's name: half a metre, parts of a turn.
_UNSAID = {"m": (0.5,), "s": (3.0,), "deg": (30, 45, 90, 135, 180, 225, 270, 315, 360), "n": (2, 3)}


def grammar(tokens: Sequence[Token]) -> str:
    """Return the grammar of the programs that a model may write for a sentence; an empty line ends them."""
    calls = [_call(skill) for skill in skills().values() if skill.moves]
    said = (token.text for token in tokens if token.kind in ("word", "number") and '"' not in token.text)
    words = [_literal(word) for word in dict.fromkeys(said) if word not in _ARTICLES]
    sought = [_literal(f"{name}=") for name in skills()["get_major_map"].alternatives if name != "img"]
    rules = {"calls": calls, "words": words or ['"it"'], "sought": sought}
    for unit, unsaid in _UNSAID.items():
        amounts = (amount(tokens, at, unit) for at in range(len(tokens)))
        values = (*(value for value in amounts if value is not None and value >= 0.0), *unsaid)
        rules[unit] = [_literal(f"{value:g}") for value in dict.fromkeys(values)]
    text = files("avlmaps.language").joinpath("local_grammar.gbnf").read_text(encoding="utf-8")
    return Template(text.strip()).substitute({name: " | ".join(rule) for name, rule in rules.items()})


def _call(skill: Skill) -> str:
    parts = [_literal(f"robot.{skill.name}(")]
    for at, (name, parameter) in enumerate(skill.takes.parameters.items()):
        unit = name.rsplit("_", 1)[-1]
        value = "target" if skill.kinds[name] & _TARGETS else f'"-"? {unit}' if skill.name in _SIGNED else unit
        value = value if at == 0 else f'", " {value}'
        parts.append(value if parameter.default is parameter.empty else f"({value})?")
    return " ".join([*parts, '")"'])


_literal = partial(json.dumps, ensure_ascii=False)


_SIDES = {str(side): side for side in Side if side not in (Side.FRONT, Side.AHEAD)}
_STEPS: Mapping[str, Callable[..., Intent]] = {
    "move_to": act.Go, "move_to_object": lambda to, metres=None: act.StopAt(to, metres) if metres else act.Go(to),
    "face": act.Face, "move_forward": act.Move, "turn": act.Turn, "wait": act.Wait,
    "turn_absolute": lambda heading: act.Turn(None, heading), "move_in_between": lambda a, b: act.Between((a, b)),
    **{f"with_object_on_{side}": lambda to, side=side: act.Face(to, _SIDES[side]) for side in ("left", "right")},
    **{f"move_{side}" if side not in ("left", "right") else f"move_to_{side}":
       lambda of, metres=None, at=at: act.Beside(of, at, metres) for side, at in _SIDES.items()},
}  # fmt: skip
_KINDS = {"obj": TargetKind.OBJECT, "sound": TargetKind.SOUND, "area": TargetKind.AREA}


def meaning(program: str) -> tuple[Intent, ...] | None:
    """Return the intents of a program that the grammar allows; None for any other."""
    try:
        found = _block(ast.parse(program).body)
    except (SyntaxError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return tuple(_joined(found)) or None


def _block(body: Sequence[ast.stmt]) -> list[Intent]:
    found: list[Intent] = []
    for line in body:
        match line:
            case ast.Assign(value=ast.Call(args=[])):  # where it starts
                continue
            case ast.Assign(value=ast.Call(args=[name])):
                found.append(act.Circle(_value(name)))
            case ast.For(iter=ast.Call(func=ast.Name(), args=[ast.Constant(value=int(times))]), body=inside):
                if not isinstance(inside[0], ast.Expr) or "outline" not in ast.dump(inside[0]):
                    found.append(act.Repeat(times, tuple(_block(inside))))
            case ast.For(iter=ast.Call(args=[target])):
                found.append(act.VisitEach(_value(target)))
            case ast.Expr(value=ast.Call(args=[ast.Name()])):
                found.append(act.Return())
            case ast.Expr(value=ast.Call(func=ast.Attribute(attr=skill), args=given)):
                found.append(_STEPS[skill](*map(_value, given)))
            case _:
                raise ValueError(ast.dump(line))
    return found


def _value(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=str(name)):
            return Target(TargetKind.OBJECT, name)
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.UnaryOp(operand=inner):
            return -_value(inner)
        case ast.BinOp(left=left, right=right):
            return _value(left).with_near(_value(right))
        case ast.Subscript(value=ast.Call(args=[name])):
            return replace(_value(name), pick=Pick.FARTHEST)
        case ast.Call(args=[inner]):
            return _value(inner)
        case ast.Call(keywords=[ast.keyword(arg=str(kind), value=ast.Constant(value=str(name)))]):
            return Target(_KINDS[kind], name)
        case _:
            raise ValueError(ast.dump(node))


def _joined(steps: Sequence[Intent]) -> list[Intent]:
    """Return steps in which "go to it, face it" stops before it."""
    found: list[Intent] = []
    for step in steps:
        match found[-1:], step:
            case [act.Go(to=before)], act.Face(to=to, side=Side.AHEAD) if before == to:
                found[-1] = act.Beside(to, Side.FRONT)
            case _:
                found.append(step)
    return found


@cache
def examples() -> tuple[tuple[str, str], ...]:
    """Return commands with their programs, chosen from the lists that the reader learnt from; plain ones come first."""
    text = files("avlmaps.language").joinpath("local_examples.tsv").read_text(encoding="utf-8")
    told = (line.replace(" | ", "\n").split("\t") for line in text.splitlines())
    return tuple((command, program) for command, program in told)


def prompt(command: str) -> str:
    """Return the examples that are nearest to a command, the nearest last, and the command as a comment."""
    own, (forms, weights) = _form(command), _forms()

    def likeness(at: int) -> float:
        size = sum(weights[part] for part in forms[at])
        return sum(weights[part] for part in own & forms[at]) / math.sqrt(size or 1.0)

    nearest = sorted(range(_ALWAYS, len(forms)), key=likeness)[-_NEAREST:]
    return f"{_head()}{_shown(nearest)}# {' '.join(command.split())}\n"


def _head() -> str:
    return _HEAD + _shown(range(_ALWAYS))


def _shown(numbers: Iterable[int]) -> str:
    return "".join("# {}\n{}\n\n".format(*examples()[at]) for at in numbers)


def _form(text: str) -> frozenset[str]:
    said = ((token.text, "<number>" if token.kind == "number" else token.text) for token in tokenise(text))
    words = ["<name>" if is_known(word) else form for word, form in said]
    return frozenset([*words, *map(" ".join, pairwise(words))])


@cache
def _forms() -> tuple[Sequence[frozenset[str]], Mapping[str, float]]:
    forms = [_form(command) for command, _ in examples()]
    counts = Counter(part for form in forms for part in form)
    return forms, {part: math.log(len(forms) / count) for part, count in counts.items()}


@dataclass(frozen=True, slots=True)
class Written:
    """What a model wrote, and how many tokens it read and wrote."""

    program: str
    tokens: tuple[int, int] = (0, 0)


class LocalModel:
    """A model of llama.cpp: a GGUF file, served in this process, or the address of a server that runs."""

    def __init__(self, model: str) -> None:
        """Load the model, or take its address; raises BackendError for no GGUF file and without xllamacpp."""
        self.shown = model
        self._server: Any = None
        self.url = model.rstrip("/")
        if not model.startswith(("http://", "https://")):
            file = Path(model).expanduser()
            self._server = _served(file)
            self.url = self._server.listening_address
            # The state behind what every prompt begins with is kept.
            state = f"{file.name}-{file.stat().st_size}-{sha256(_head().encode()).hexdigest()[:16]}.state"
            if self._post("/slots/0?action=restore", {"filename": state}) is None:
                self._post("/completion", {"prompt": _head(), "n_predict": 0, "cache_prompt": True})
                self._post("/slots/0?action=save", {"filename": state})

    def write(self, command: str, tokens: Sequence[Token]) -> Written:
        """Return the program that the model writes for a command; raises LanguageError where it does not answer."""
        said = self._post("/completion", {
            "prompt": prompt(command), "grammar": grammar(tokens), "temperature": 0.0, "n_predict": _MOST_TOKENS,
            "cache_prompt": True,
        })  # fmt: skip
        if said is None:
            raise LanguageError(f"The language model {self.shown} does not answer; {_TAKES}")
        return Written(str(said["content"]), (int(said["tokens_evaluated"]), int(said["tokens_predicted"])))

    def _post(self, path: str, body: Mapping[str, Any]) -> dict[str, Any] | None:
        request = Request(self.url + path, json.dumps(body).encode(), {"Content-Type": "application/json"})
        try:
            with urlopen(request, timeout=_TIMEOUT_S) as answer:
                return json.load(answer)
        except (OSError, ValueError):
            return None


def _served(file: Path) -> Any:
    try:
        with file.open("rb") as opened:
            is_gguf = opened.read(4) == b"GGUF"
    except OSError as fault:
        raise BackendError(f"The language model {file} cannot be read ({fault.strerror}); {_TAKES}") from fault
    if not is_gguf:
        raise BackendError(f"{file} is no GGUF file; {_TAKES}")
    try:
        library: Any = import_module("xllamacpp")
    except ImportError as fault:
        raise BackendError(f"A GGUF file needs llama.cpp: {install_command('llm')}; or {_TAKES}") from fault
    states = cache_folder() / "llm"
    states.mkdir(parents=True, exist_ok=True)
    parameters = library.CommonParams()
    parameters.model.path, parameters.n_ctx, parameters.n_parallel = str(file), _CONTEXT, 1
    parameters.verbosity, parameters.warmup, parameters.port = -1, False, 0
    parameters.slot_save_path, parameters.endpoint_slots = f"{states}/", True
    try:
        return library.Server(parameters)
    except RuntimeError as fault:
        raise BackendError(f"{file} cannot be loaded ({fault}); {_TAKES}") from fault


class LocalTranslator(LearnedTranslator):
    """Translates with the reader and a language model together."""

    name = "local"

    def __init__(self, model: LocalModel, given: Attachments | None = None, choose: int | None = None) -> None:
        super().__init__(given or Attachments(), choose)
        self._model = model

    def read(self, command: str) -> Command:
        """Return the meaning of a command; the model is asked where the reader is not sure of an order."""
        read = read_command(command, self.given)
        sure = sum(one.probability for one in read.readings if is_same(one.intents, read.intents)) >= _SURE
        if sure or read.why in ("danger", "gate", "words", "asked") or isinstance(read.stops, Refuse):
            return read
        # The reader asks the gate of all that it drives.
        return read if read.stops is not None and no_order(command) else both(read, self.proposed(command))

    def proposed(self, command: str) -> Weighed | None:
        """Return what the model makes of a command, checked; None where it means nothing."""
        stand = stand_ins(command, self.given.own)
        sentence = Sentence(stand.text, replace(self.given, own=()))
        intents = meaning(self._model.write(stand.text, sentence.tokens).program)
        if intents is None:
            return None
        checked = weighed(Read(intents, 1.0, _used(intents, sentence.tokens)), NameResolver(sentence))
        return replace(checked, intents=tuple(on_targets(one, stand.target) for one in checked.intents))


def both(read: Command, proposed: Weighed | None) -> Command:
    """Return what a reader that is not sure and a model make of a command: what both read, or a question."""
    if proposed is None or proposed.stops is not None:
        return read
    likely = [one for one in read.readings if one.stops is None and is_same(one.intents, proposed.intents)]
    if likely and (read.stops is not None or is_same(read.intents, proposed.intents)):
        notes = (*read.notes, *likely[0].notes, "The language model reads it likewise.")
        return replace(read, intents=likely[0].intents, notes=tuple(dict.fromkeys(notes)), why="read")
    own = (read.intents,) if read.stops is None else getattr(read.stops, "meanings", ())[:2]
    meanings = (*own, proposed.intents)
    return replace(read, intents=(which(meanings),), why="unsure")


def _used(intents: Sequence[Intent], tokens: Sequence[Token]) -> frozenset[int]:
    named = {word for one in intents for to in targets_of(one) for part in (to, *to.near) for word in part.name.split()}
    values = (value for one in act.every(intents) for value in act.values_of(one).values())
    numbers = {abs(value) for value in values if isinstance(value, float | int)}

    def counts(at: int) -> bool:
        return amount_end(tokens, at) > at and not numbers.isdisjoint(amount(tokens, at, of) for of in READS)

    return frozenset(at for at, token in enumerate(tokens) if token.text in named or counts(at))
