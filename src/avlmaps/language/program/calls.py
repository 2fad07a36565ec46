"""Calls, bound to what is called before anything runs: the right name, as many arguments, none given twice."""

from collections.abc import Mapping, Sequence

from avlmaps.core.errors import ProgramError
from avlmaps.core.suggestions import nearest
from avlmaps.language.program.budget import refused
from avlmaps.language.program.syntax import Argument, BuiltinCall, Expression, SkillCall
from avlmaps.language.program.table import ROBOT, SKILLS, Parameter, Skill

# How few and how many arguments each function takes; None is no limit.
BUILTINS: Mapping[str, tuple[int, int | None]] = {
    "len": (1, 1),
    "min": (1, None),
    "max": (1, None),
    "abs": (1, 1),
    "range": (1, 3),
    "round": (1, 2),
}
RESERVED = frozenset({ROBOT, *SKILLS, *BUILTINS})


def skill_named(line: int, name: str) -> Skill:
    """Return a skill, or refuse the name with the one that was probably meant."""
    if name in SKILLS:
        return SKILLS[name]
    close = nearest(name, SKILLS)
    advice = f"did you mean `{close}`?" if close else f"the skills are {', '.join(SKILLS)}"
    raise ProgramError(f"Line {line}: the robot has no skill `{name}`; {advice}" + ("" if close else "."))


def unknown_function(line: int, name: str) -> ProgramError:
    """Return the refusal of a call of what is neither a skill nor a function."""
    close = nearest(name, [*SKILLS, *BUILTINS])
    advice = f"did you mean `{close}`?" if close else f"call a skill of `{ROBOT}`, or one of {', '.join(BUILTINS)}."
    return ProgramError(f"Line {line}: there is no function `{name}`; {advice}")


def bind_skill(
    line: int, skill: Skill, positional: Sequence[Expression], named: Sequence[tuple[str, Expression]]
) -> SkillCall:
    """Return the call of a skill with each argument at its parameter.

    Raises:
        ProgramError: too many, too few, twice the same, or a name that the skill does not know.
    """
    if len(positional) > len(skill.parameters):
        raise refused(
            line,
            f"`{skill.name}` takes {_count(len(skill.parameters))}, not {len(positional)}; it is {skill.signature}",
        )
    bound = [
        Argument(parameter.name, value, named=False)
        for parameter, value in zip(skill.parameters, positional, strict=False)
    ]
    for name, value in named:
        if skill.parameter(name) is None:
            close = nearest(name, (each.name for each in skill.parameters))
            meant = f", did you mean `{close}`" if close else ""
            raise refused(line, f"`{skill.name}` takes no `{name}`{meant}; it is {skill.signature}")
        if any(given.parameter == name for given in bound):
            raise refused(line, f"`{skill.name}` is given its `{name}` twice; it is {skill.signature}")
        bound.append(Argument(name, value, named=True))
    given = {argument.parameter for argument in bound}
    missing = [each.name for each in skill.parameters if each.default is None and each.name not in given]
    if missing:
        raise refused(line, f"`{skill.name}` needs its {_listed(missing)}; it is {skill.signature}")
    return SkillCall(skill.name, tuple(bound), line)


def check_exactly_one(line: int, skill: Skill, given: int) -> None:
    """Refuse none, or several, of what are alternatives."""
    if skill.takes_exactly_one and given != 1:
        many = "none" if given == 0 else given
        raise refused(line, f"`{skill.name}` takes exactly one of {_listed(skill.alternatives, 'or')}, not {many}")


def bind_builtin(
    line: int, name: str, positional: Sequence[Expression], named: Sequence[tuple[str, Expression]]
) -> BuiltinCall:
    """Return the call of a function.

    Raises:
        ProgramError: it does not take as many arguments, or any by name.
    """
    if named:
        raise refused(line, f"`{name}` takes nothing by name, so no `{named[0][0]}=`; give it values alone")
    fewest, most = BUILTINS[name]
    if len(positional) < fewest or (most is not None and len(positional) > most):
        takes = f"{_count(fewest)} or more" if most is None else _count(fewest) if fewest == most else f"1 to {most}"
        raise refused(line, f"`{name}` takes {takes}, not {len(positional)}")
    return BuiltinCall(name, tuple(positional), line)


def check_assignable(line: int, name: str) -> str:
    """Return a name that may be given a value; refuse those of the robot, its skills and the functions."""
    if name == ROBOT:
        raise refused(line, "`robot` is the robot and cannot be given a value; choose another name")
    if name in RESERVED:
        what = "skill" if name in SKILLS else "function"
        raise refused(line, f"`{name}` is the name of a {what} and cannot be given a value; choose another name")
    return name


def parameter_of(skill: Skill, name: str) -> Parameter:
    """Return a parameter that a bound call names."""
    found = skill.parameter(name)
    assert found is not None, "calls are bound to parameters that their skill has"
    return found


def _count(arguments: int) -> str:
    return "1 argument" if arguments == 1 else f"{arguments} arguments"


def _listed(names: Sequence[str], last: str = "and") -> str:
    quoted = [f"`{name}`" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} {last} {quoted[-1]}"
