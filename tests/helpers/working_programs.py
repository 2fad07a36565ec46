"""Programs by rule that mostly run to their end, to hold the interpreter to what Python itself does with them."""
# ruff: noqa: E501 -- tables of forms

from random import Random


class _Working:
    """Writes lines and expressions, each name holding one kind of value."""

    def __init__(self, random: Random) -> None:
        self.random = random

    def number(self, deep: int = 2) -> str:
        if deep == 0:
            return self.random.choice(("0", "1", "7", "2.5", "1_000", "n", "m", "i", "90", ".5"))
        one, two = self.number(deep - 1), self.number(deep - 1)
        return self.random.choice((
            f"{one} {self.random.choice('+-*')} {two}", f"({one} - {two})", f"-{one}", f"abs({one})", f"max({one}, {two})",
            f"{one} // 3", f"{one} % 7", f"{one} / 2", f"round({one}, 1)", f"len(k) + {one}", f"k[{self.random.randint(-2, 1)}]",
            f"({one} if {self.truth(deep - 1)} else {two})", f"min([{one}, {two}, 3])", f"round({one})", f"{one} / {two}",
        ))  # fmt: skip

    def truth(self, deep: int = 2) -> str:
        if deep == 0:
            return self.random.choice(("True", "False", "n", "k", "s", "None"))
        one, two = self.number(deep - 1), self.number(deep - 1)
        return self.random.choice((
            f"{one} < {two}", f"{one} <= {two} != 5", f"not {self.truth(deep - 1)}", f"{one} in k", f"{one} in range(5)",
            f"{self.truth(deep - 1)} and {self.truth(deep - 1)}", f"({self.truth(deep - 1)} or {self.truth(deep - 1)})",
            f"{self.phrase()} == s", f"p == {self.place(0)}", f"{self.phrase()} < s", "s is not None", f"({one}, 1) == ({two}, 1)",
        ))  # fmt: skip

    def phrase(self) -> str:
        return self.random.choice(
            ("'chair'", '"the red sofa"', "s", "s + 'x'", "'é'", "'a\\n\\x41'", "r'b\\c'", "'unicorn'", "'lamp'")
        )

    def place(self, deep: int = 2) -> str:
        if deep == 0:
            return self.random.choice(("p", "get_pos('rug')", "robot.current_pos()", "get_contour('rug')[0]"))
        one, two = self.place(deep - 1), self.place(deep - 1)
        return self.random.choice((
            f"({one} + {two}) / 2", f"{one} - {two}", f"{one} * {self.number(1)}", f"0.5 * {one}", f"get_max_pos_3d({self.heat()})",
            f"get_pos({self.phrase()})",
        ))  # fmt: skip

    def heat(self) -> str:
        one = f"get_map({self.random.choice(('obj', 'sound', 'area'))}={self.phrase()})"
        return self.random.choice(
            (one, f"h * {one}", "h", f"robot.get_major_map({self.phrase()})", "get_map(img=load_image('a.png'))")
        )

    def line(self) -> str:
        return self.random.choice((
            lambda: f"n = {self.number()}", lambda: f"m = {self.number()}", lambda: f"n, m = m, {self.number(1)}", lambda: f"s = {self.phrase()}",
            lambda: f"n {self.random.choice('+-*')}= {self.number(1)}", lambda: f"p = {self.place()}", lambda: f"h = {self.heat()}",
            lambda: f"k = k + [{self.number(1)}]", lambda: f"k = [{self.number(1)}, {self.number(1)}]", lambda: f"robot.turn({self.number()})",
            lambda: f"move_to({self.place()})", lambda: f"robot.move_to({self.heat()})", lambda: f"face(target={self.phrase()})",
            lambda: f"move_in_between({self.place(1)}, b={self.phrase()})", lambda: f"move_north(s, distance_m={self.number(1)})",
            lambda: "s += 'y'", lambda: f"turn({self.number(1)}); n = {self.number(1)}",
        ))()  # fmt: skip

    def block(self, deep: int, indent: str = "", in_loop: bool = False) -> str:
        text = ""
        for _ in range(self.random.randint(1, 5 if deep == 2 else 3)):
            kind = self.random.randint(0, 9 if deep else 5)
            inner = indent + self.random.choice(("    ", "  ", "\t")) if kind > 5 else indent
            if kind == 6:
                text += f"{indent}if {self.truth()}:\n{self.block(deep - 1, inner, in_loop)}"
                text += f"{indent}else:\n{self.block(deep - 1, inner, in_loop)}" if self.random.random() < 0.5 else ""
            elif kind > 6:
                through = self.random.choice(
                    ("range(3)", "k", "(1, 2, 5)", "range(5, 0, -2)", "[3]", "1, 2", f"range({self.number(1)})")
                )
                text += f"{indent}for i in {through}:  # again\n{self.block(deep - 1, inner, True)}"
            elif kind == 5 and in_loop:
                text += f"{indent}if {self.truth(1)}: {self.random.choice(('break', 'continue', 'pass'))}\n"
            else:
                text += f"{indent}{self.line()}\n"
        return text


def working_program(random: Random, deep: int = 2) -> str:
    """Return a program that is one, and mostly runs to its end; its blocks nest so deep."""
    start = "n = 3\nm = 2.5\ni = 1\ns = 'tv'\nk = [1, 4]\np = get_pos('door')\nh = get_map('desk')\n"
    return start + _Working(random).block(deep)
