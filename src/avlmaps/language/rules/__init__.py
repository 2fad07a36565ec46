"""From a command to a program by rules: a grammar, no model, no network.

A command is cut into clauses (`clauses`), each is read by the grammar `command.lark` (`reading`, `names`), and what all
of them ask for is written as one program (`writing`). Every step is a plain value, and what is not understood is
refused with the words that were not.
"""

from avlmaps.language.rules.translate import RulesTranslator, command_to_program

__all__ = ["RulesTranslator", "command_to_program"]
