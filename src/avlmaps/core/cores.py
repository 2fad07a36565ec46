"""How many cores a process may use; more threads than that wait for one another."""

import os


def usable_cores() -> int:
    """Return how many cores this process may use: those that it is bound to, or all where the system binds none."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
