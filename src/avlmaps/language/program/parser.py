"""From text to a program: its statements, read and then checked."""

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import syntax
from avlmaps.language.program.budget import refused
from avlmaps.language.program.calls import check_assignable
from avlmaps.language.program.check import check
from avlmaps.language.program.expressions import Expressions
from avlmaps.language.program.lexer import Form, tokens_of

_UPDATES = frozenset({"+=", "-=", "*=", "/=", "//=", "%="})


def parse_program(text: str) -> syntax.Program:
    """Return the program that a text is, with every check that can be made before it runs.

    Args:
        text: lines in a small subset of Python; see docs/programs.md.

    Raises:
        ProgramError: something in it is no part of a program, or is used as it cannot be; it names the line.
    """
    tokens = tokens_of(text)
    statements = _Statements(tokens).run()
    if not statements:
        raise ProgramError("The program is empty; write at least one line, such as `robot.move_to('chair')`.")
    check(statements)
    return syntax.Program(statements, text)


class _Statements(Expressions):
    """Reads statements and the blocks that they hold."""

    loops = 0

    def run(self) -> tuple[syntax.Statement, ...]:
        statements: list[syntax.Statement] = []
        while self.here.form is not Form.END:
            statements += self._line()
        return tuple(statements)

    def _line(self) -> list[syntax.Statement]:
        """Read one statement with its blocks, or those that share a line with `;`."""
        if self.here.form is Form.INDENT:
            raise refused(
                self.here.line, "the line is indented, but nothing above opens a block; begin it further left"
            )
        if self.sees("if"):
            return [self._if()]
        if self.sees("for"):
            return [self._for()]
        if self.sees("else", "elif"):
            raise refused(self.here.line, f"`{self.here.text}` belongs to no `if`; put it right under its block")
        return self._simple_line()

    def _simple_line(self) -> list[syntax.Statement]:
        statements = [self._simple()]
        while self.took(";") and self.here.form is not Form.LINE_END:
            statements.append(self._simple())
        if self.here.form is not Form.LINE_END:
            raise refused(self.here.line, f"the line should end before {self.here.shown}; begin a new line there")
        self.take()
        return statements

    def _block(self, word: str, after: str) -> tuple[syntax.Statement, ...]:
        self.need(":", f"after {after}")
        if self.here.form is not Form.LINE_END:
            return tuple(self._simple_line())
        self.take()
        if self.here.form is not Form.INDENT:
            raise refused(self.here.line, f"the block of `{word}` is missing; indent the lines that belong to it")
        self.take()
        statements: list[syntax.Statement] = []
        while self.here.form is not Form.DEDENT:
            statements += self._line()
        self.take()
        return tuple(statements)

    def _if(self) -> syntax.If:
        line, branches, otherwise = self.here.line, [], ()
        while self.sees("if", "elif"):
            if branches and self.here.text == "if":
                break
            word = self.take()
            test = self.whole()
            branches.append(syntax.Branch(test, self._block(word.text, f"the condition of `{word.text}`"), word.line))
        if self.took("else"):
            otherwise = self._block("else", "`else`")
        return syntax.If(tuple(branches), otherwise, line)

    def _for(self) -> syntax.For:
        line = self.take().line
        target = self._for_target()
        self.need("in", "after the name that `for` gives")
        through = self.listed(":")
        self.loops += 1
        body = self._block("for", "what `for` goes through")
        self.loops -= 1
        return syntax.For(target, through, body, line)

    def _for_target(self) -> syntax.AssignmentTarget:
        bracketed = self.took("(")
        names, unpacks = [], False
        while self.here.form is Form.NAME:
            names.append(check_assignable(self.here.line, self.take().text))
            if not self.took(","):
                break
            unpacks = True
        if bracketed:
            self.need(")", "after the names that `for` gives")
        if not names:
            raise refused(self.here.line, f"there should be a name after `for`, not {self.here.shown}")
        return syntax.AssignmentTarget(tuple(names), unpacks)

    def _simple(self) -> syntax.Statement:
        token, after = self.here, self.tokens[min(self.at + 1, len(self.tokens) - 1)]
        if self.sees("pass", "break", "continue"):
            if token.text != "pass" and not self.loops:
                raise refused(token.line, f"`{token.text}` is in no loop; put it into the block of a `for`")
            return syntax.Word(self.take().text, token.line)
        if token.form is Form.NAME and after.form is Form.SIGN and (after.text == "=" or after.text in _UPDATES):
            check_assignable(token.line, token.text)
        found = self.listed("=", ":", ";", *_UPDATES)
        if self.took("="):
            return self._assigned(self._target(found, token.line), token.line)
        if self.sees(*_UPDATES):
            operator = self.take().text.removesuffix("=")
            if not isinstance(found, syntax.Name):
                raise refused(token.line, f"`{operator}=` updates one name; write it out with `=`")
            return syntax.Update(found.name, operator, self.listed(";"), token.line)
        if self.sees(":"):
            raise refused(token.line, "a `:` has no meaning here; a name is given a value with `=` alone")
        if not isinstance(found, syntax.SkillCall):
            raise refused(token.line, "the line works out a value and does nothing with it; name it or call a skill")
        return syntax.Perform(found, token.line)

    def _assigned(self, target: syntax.AssignmentTarget, line: int) -> syntax.Assign:
        value = self.listed("=", ";")
        if self.sees("="):
            raise refused(line, "a line has one `=`; give each name its value on a line of its own")
        return syntax.Assign(target, value, line)

    def _target(self, written: syntax.Expression, line: int) -> syntax.AssignmentTarget:
        if isinstance(written, syntax.Name):
            return syntax.AssignmentTarget((check_assignable(line, written.name),), unpacks=False)
        if isinstance(written, syntax.Collection) and not written.is_list and written.elements:
            names = [part.name for part in written.elements if isinstance(part, syntax.Name)]
            if len(names) == len(written.elements):
                return syntax.AssignmentTarget(tuple(check_assignable(line, name) for name in names), unpacks=True)
        if isinstance(written, syntax.Element):
            raise refused(line, "a list is not changed but made again, as in `a = a + [b]`")
        raise refused(line, "only a name is given a value, or several as in `a, b = 1, 2`; put it left of the `=`")
