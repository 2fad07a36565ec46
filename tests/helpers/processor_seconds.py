"""A plugin of pytest: the processor seconds of a run, by file, with those of the processes that its tests start."""

import json
import os
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

RESULT = Path(__file__).resolve().parents[2] / "build" / "test_seconds.json"
_spent: Counter[str] = Counter()
_all_s = 0.0


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Count what a test costs, with the fixtures that it is the first to need."""
    begin_s = _processor_s()
    try:
        return (yield)
    finally:
        _spent[item.location[0]] += _processor_s() - begin_s


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Hand a worker's seconds to the process that started it."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["processor_s"] = (_processor_s(), dict(_spent))


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Add up the seconds of the workers."""
    global _all_s
    all_s, spent = getattr(node, "workeroutput", {}).get("processor_s", (0.0, {}))
    _all_s += all_s
    _spent.update(spent)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Write the sum with the dearest files, and all of them to build/test_seconds.json."""
    global _all_s
    _all_s = max(_all_s + sum(os.times()[:2]), _processor_s())  # workers are children too, where they were waited for
    files = {name: round(spent_s, 2) for name, spent_s in _spent.most_common()}
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps({"processor_s": round(_all_s, 1), "files": files}, indent=1) + "\n", encoding="utf-8")
    terminalreporter.section("processor seconds")
    for name, spent_s in list(files.items())[:15]:
        terminalreporter.line(f"{spent_s:8.1f} {name}")
    terminalreporter.line(f"{_all_s:8.1f} in all")


def _processor_s() -> float:
    """Seconds of this process and of the children that it waited for."""
    return sum(os.times()[:4])
