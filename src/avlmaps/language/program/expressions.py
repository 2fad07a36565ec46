"""From tokens to expressions, with the precedence that Python gives them."""

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import syntax
from avlmaps.language.program.budget import refused
from avlmaps.language.program.calls import BUILTINS, RESERVED, bind_builtin, bind_skill, skill_named, unknown_function
from avlmaps.language.program.lexer import Form, ProgramToken
from avlmaps.language.program.table import ROBOT, SKILLS

DEEPEST = 50
"""How deep an expression may nest: far beyond what anyone writes, far within what recursion can take."""

_TERNARY, _OR, _AND, _NOT, _COMPARE, _SUM, _TERM, _SIGN = range(8)
_LEVELS = {"+": _SUM, "-": _SUM, "*": _TERM, "/": _TERM, "//": _TERM, "%": _TERM}
_COMPARISONS = frozenset({"==", "!=", "<", "<=", ">", ">=", "in", "is"})
_INFIXES = frozenset({*_LEVELS, *_COMPARISONS, "not", "and", "or", "if"})
_CONSTANTS = {"None": None, "True": True, "False": False}


class Expressions:
    """Reads expressions from tokens, one after the other."""

    def __init__(self, tokens: list[ProgramToken]) -> None:
        self.tokens = tokens
        self.at = 0
        self.deep = 0

    @property
    def here(self) -> ProgramToken:
        """The token that comes next."""
        return self.tokens[self.at]

    def take(self) -> ProgramToken:
        """Return the token that comes next, and advance."""
        token = self.tokens[self.at]
        self.at += 1
        return token

    def sees(self, *texts: str) -> bool:
        """Return whether the next token is one of these words or signs."""
        # Names are never keywords, strings keep their quotes: no other token has the text of a word or sign.
        return self.tokens[self.at].text in texts

    def took(self, text: str) -> bool:
        """Go past a word or sign if it comes next, and return whether it did."""
        if self.tokens[self.at].text != text:
            return False
        self.at += 1
        return True

    def need(self, text: str, where: str) -> None:
        """Go past a word or sign that must come next."""
        if not self.took(text):
            raise refused(self.here.line, f"there should be `{text}` {where}, not {self.here.shown}")

    def whole(self) -> syntax.Expression:
        """Read one expression and see that it does not nest too deep."""
        line = self.here.line
        found = self.expression()
        if syntax.depth_of(found) > DEEPEST:
            raise _too_deep(line)
        return found

    def listed(self, *ends: str) -> syntax.Expression:
        """Read an expression, or several with commas between, which are a tuple, up to one of some signs."""
        line, first = self.here.line, self.whole()
        if not self.sees(","):
            return first
        elements = [first]
        while self.took(",") and not self.sees(*ends) and self.here.form is not Form.LINE_END:
            elements.append(self.whole())
        return syntax.Collection(tuple(elements), is_list=False, line=line)

    def expression(self, level: int = _TERNARY) -> syntax.Expression:
        """Read an expression of which each operator binds at least as tightly as a level."""
        self.deep += 1
        if self.deep > DEEPEST:
            raise _too_deep(self.here.line)
        found = self._infixes(self._prefix(level), level)
        self.deep -= 1
        return found

    def _infixes(self, left: syntax.Expression, level: int) -> syntax.Expression:
        while True:
            line, word = self.here.line, self.here.text
            if word not in _INFIXES:
                return left
            if _LEVELS.get(word, -1) >= level:
                self.take()
                left = syntax.Binary(word, left, self.expression(_LEVELS[word] + 1), line)
            elif level <= _COMPARE and self._comparison_here():
                left = self._comparison(left)
            elif (level <= _AND and self.sees("and")) or (level <= _OR and self.sees("or")):
                operands = [left]
                while self.took(word):
                    operands.append(self.expression(_NOT if word == "and" else _AND))
                left = syntax.Logical(word, tuple(operands), line)
            elif level <= _TERNARY and self.took("if"):
                test = self.expression(_OR)
                self.need("else", "after the condition of a value")
                left = syntax.Conditional(test, left, self.expression(_TERNARY), line)
            else:
                return left

    def _comparison_here(self) -> bool:
        after = self.tokens[min(self.at + 1, len(self.tokens) - 1)]
        return self.here.text in _COMPARISONS or (self.sees("not") and after.text == "in")

    def _comparison(self, first: syntax.Expression) -> syntax.Comparison:
        line, operators, rest = self.here.line, [], []
        while self._comparison_here():
            operator = self.take()
            text = operator.text
            if (text == "not" and self.took("in")) or (text == "is" and self.took("not")):
                text = "not in" if text == "not" else "is not"
            before = rest[-1] if rest else first
            rest.append(self.expression(_SUM))
            nothing = syntax.Constant(None, line)
            if text.startswith("is") and nothing not in (before, rest[-1]):
                raise refused(operator.line, f"`{text}` compares with None alone; use `==` or `!=`")
            operators.append(text)
        return syntax.Comparison(first, tuple(operators), tuple(rest), line)

    def _prefix(self, level: int) -> syntax.Expression:
        token = self.here
        if self.sees("+", "-"):
            self.take()
            return syntax.Unary(token.text, self.expression(_SIGN), token.line)
        if self.sees("not"):
            if level > _NOT:
                raise refused(token.line, "`not` cannot stand here by itself; put it and what follows in brackets")
            self.take()
            return syntax.Unary("not", self.expression(_NOT), token.line)
        return self._after(self._atom())

    def _after(self, found: syntax.Expression) -> syntax.Expression:
        """Read what is written right after a value: elements picked, and what no program may ask."""
        while True:
            line = self.here.line
            if self.took("["):
                if self.sees(":"):
                    raise _slice(line)
                index = self.expression()
                if self.sees(":"):
                    raise _slice(line)
                self.need("]", "after the number of the element")
                found = syntax.Element(found, index, line)
            elif self.took("."):
                raise _attribute(line, self.here)
            elif self.sees("("):
                raise refused(line, f"only skills and functions are called; write `{ROBOT}.SKILL(...)`")
            else:
                return found

    def _atom(self) -> syntax.Expression:
        token = self.take()
        if token.form in (Form.NUMBER, Form.STRING):
            if token.form is Form.STRING and self.here.form is Form.STRING:
                raise refused(self.here.line, "two strings stand side by side; write them as one, or join with +")
            return syntax.Constant(token.value, token.line)
        if token.form is Form.NAME:
            return self._named(token)
        if token.form is Form.WORD and token.text in _CONSTANTS:
            return syntax.Constant(_CONSTANTS[token.text], token.line)
        if token.form is Form.SIGN and token.text in ("(", "["):
            return self._bracketed(token)
        if token.form is Form.SIGN and token.text == "*":
            raise refused(token.line, "`*` before a value spreads it, which programs cannot; write each value")
        raise refused(token.line, f"there should be a value, not {token.shown}")

    def _bracketed(self, opening: ProgramToken) -> syntax.Expression:
        closing, elements, comma = {"(": ")", "[": "]"}[opening.text], [], False
        while not self.sees(closing):
            elements.append(self.expression())
            if self.sees("for"):
                raise _comprehension(self.here.line)
            comma = self.took(",")
            if not comma and not self.sees(closing):
                raise refused(self.here.line, f"there should be `,` or `{closing}`, not {self.here.shown}")
        self.take()
        if opening.text == "(" and len(elements) == 1 and not comma:
            return elements[0]
        return syntax.Collection(tuple(elements), opening.text == "[", opening.line)

    def _named(self, token: ProgramToken) -> syntax.Expression:
        name = token.text
        if name == ROBOT:
            if not self.took("."):
                raise refused(token.line, f"`{ROBOT}` is no value; write `{ROBOT}.SKILL(...)`")
            asked = self.take()
            if asked.form is not Form.NAME:
                raise refused(asked.line, f"there should be a skill after `{ROBOT}.`, not {asked.shown}")
            skill_named(asked.line, asked.text)
            return self._call(asked, f"{ROBOT}.{asked.text}")
        if name in RESERVED:
            return self._call(token, name)
        if self.sees("("):
            raise unknown_function(token.line, name)
        return syntax.Name(name, token.line)

    def _call(self, token: ProgramToken, written: str) -> syntax.SkillCall | syntax.BuiltinCall:
        if not self.took("("):
            raise refused(token.line, f"`{written}` is called, not handed on; write `{written}(...)`")
        positional: list[syntax.Expression] = []
        named: list[tuple[str, syntax.Expression]] = []
        while not self.sees(")"):
            after = self.tokens[self.at + 1]
            if self.here.form is Form.NAME and after.form is Form.SIGN and after.text == "=":
                keyword = self.take().text
                self.take()
                named.append((keyword, self.expression()))
            elif named:
                raise refused(self.here.line, "a value without a name follows one with a name; put it first")
            else:
                positional.append(self.expression())
            if self.sees("for"):
                raise _comprehension(self.here.line)
            if not self.took(",") and not self.sees(")"):
                raise refused(self.here.line, f"there should be `,` or `)`, not {self.here.shown}")
        self.take()
        if token.text in SKILLS:
            return bind_skill(token.line, SKILLS[token.text], positional, named)
        assert token.text in BUILTINS
        return bind_builtin(token.line, token.text, positional, named)


def _too_deep(line: int) -> ProgramError:
    return refused(line, f"an expression nests more than {DEEPEST} deep; give its parts names on lines before")


def _slice(line: int) -> ProgramError:
    return refused(line, "a slice [a:b] is not part of a program; pick one element, or go through all with `for`")


def _comprehension(line: int) -> ProgramError:
    return refused(line, "a `for` inside brackets is not part of a program; write the loop on lines of its own")


def _attribute(line: int, asked: ProgramToken) -> ProgramError:
    if asked.text in ("append", "extend", "insert"):
        return refused(line, f"`.{asked.text}` does not work on a value; write `name = name + [element]`")
    written = asked.text if asked.form is Form.NAME else "..."
    return refused(
        line,
        f"`.{written}` does not work on a value; the only dot is that of `{ROBOT}.SKILL(...)`, and a Place is added, "
        "subtracted and scaled whole",
    )
