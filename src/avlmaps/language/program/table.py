"""The table of skills, derived from the one `RobotSkills`: its signatures, its docstrings, nothing by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from inspect import Parameter as Declared
from inspect import getdoc, signature
from types import MappingProxyType, NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from avlmaps.language.program.value_types import ValueType
from avlmaps.language.program.vocabulary import Clip, Heat, Picture, Place, RobotSkills

ROBOT = "robot"

_KINDS: dict[Any, tuple[ValueType, str]] = {
    NoneType: (ValueType.NOTHING, "None"),
    bool: (ValueType.TRUTH, "bool"),
    float: (ValueType.NUMBER, "float"),
    str: (ValueType.STRING, "str"),
    Place: (ValueType.PLACE, "Place"),
    Heat: (ValueType.HEAT, "Heat"),
    Picture: (ValueType.PICTURE, "Picture"),
    Clip: (ValueType.CLIP, "Clip"),
    list[Place]: (ValueType.LIST, "list[Place]"),
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a skill.

    Attributes:
        name: its keyword.
        kinds: which kinds of value it takes.
        annotation: its type, as in the signature.
        default: the value that it has when it is not given, as text; None where it must be given.
    """

    name: str
    kinds: frozenset[ValueType]
    annotation: str
    default: str | None

    @property
    def text(self) -> str:
        """The parameter as a signature shows it."""
        return f"{self.name}: {self.annotation}" + ("" if self.default is None else f" = {self.default}")


@dataclass(frozen=True, slots=True)
class Skill:
    """One skill of the robot.

    Attributes:
        name: what programs call.
        parameters: in their order.
        returns: the kind of its result.
        returns_text: the type of its result, as in the signature.
        doc: what it does.
    """

    name: str
    parameters: tuple[Parameter, ...]
    returns: ValueType
    returns_text: str
    doc: str

    @property
    def signature(self) -> str:
        """The signature as a program's writer reads it."""
        return f"{self.name}({', '.join(each.text for each in self.parameters)}) -> {self.returns_text}"

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The parameters of which exactly one is given: several that are None unless they are; none of most skills."""
        names = tuple(each.name for each in self.parameters if each.default == "None")
        return names if len(names) > 1 else ()

    @property
    def takes_exactly_one(self) -> bool:
        """Whether it has alternatives."""
        return bool(self.alternatives)

    @property
    def moves(self) -> bool:
        """Whether the robot moves by it; skills that do return nothing, all others something."""
        return self.returns is ValueType.NOTHING

    def parameter(self, name: str) -> Parameter | None:
        """Return the parameter of that name, if there is one."""
        return next((each for each in self.parameters if each.name == name), None)


def skills_of(vocabulary: type) -> Mapping[str, Skill]:
    """Return the skills that a vocabulary's class declares, in its order.

    Raises:
        TypeError: a signature has something that a program has no value for.
    """
    names = [name for name, member in vars(vocabulary).items() if not name.startswith("_") and callable(member)]
    return MappingProxyType({name: _skill(name, getattr(vocabulary, name)) for name in names})


def _skill(name: str, method: Any) -> Skill:
    hints = get_type_hints(method)
    parameters: list[Parameter] = []
    for declared in list(signature(method).parameters.values())[1:]:
        if declared.kind is not Declared.POSITIONAL_OR_KEYWORD:
            raise TypeError(f"the parameter {declared} of the skill {name} is neither plain nor named")
        kinds, text = _kinds_of(name, hints[declared.name])
        default = None if declared.default is Declared.empty else repr(declared.default)
        parameters.append(Parameter(declared.name, kinds, text, default))
    (returns,), returns_text = _kinds_of(name, hints["return"])
    doc = " ".join((getdoc(method) or "").split())
    return Skill(name, tuple(parameters), returns, returns_text, doc)


def _kinds_of(skill: str, hint: Any) -> tuple[frozenset[ValueType], str]:
    choices = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    try:
        known = [_KINDS[choice] for choice in choices]
    except (KeyError, TypeError):
        raise TypeError(f"a program has no value of the type {hint} in the skill {skill}") from None
    return frozenset(kind for kind, _ in known), " | ".join(text for _, text in known)


SKILLS: Mapping[str, Skill] = skills_of(RobotSkills)


def skill_lines(prefix: str = f"{ROBOT}.", skills: Sequence[Skill] | None = None) -> tuple[str, ...]:
    """Return the table as lines for people and language models: a signature, then what it does."""
    return tuple(f"{prefix}{skill.signature}: {skill.doc}" for skill in skills or tuple(SKILLS.values()))
