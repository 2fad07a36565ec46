"""From a sentence to a question (and, later, to a program)."""
