"""Programs for robots: a small subset of Python, parsed and run over the table of skills, never by Python.

``parse_program`` refuses everything that is no part of a program; ``run_program`` runs the rest within a budget.
"""

from avlmaps.language.program.interpreter import Step, Trace, run_program
from avlmaps.language.program.parser import Program, parse_program
from avlmaps.language.program.values import Budget
from avlmaps.language.program.vocabulary import ROBOT, Skill, skills

__all__ = [
    "ROBOT", "Budget", "Program", "Skill", "Step", "Trace", "parse_program", "run_program", "skills",
]  # fmt: skip
