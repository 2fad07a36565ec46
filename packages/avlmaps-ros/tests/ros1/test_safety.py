"""Each scenario of safety against a real roscore, actionlib, tf2 and an unmodified rosbridge (`make test-ros1`)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ros1_field import why_not
from ros1_scenarios import SCENARIOS

pytestmark = [pytest.mark.timeout(600), pytest.mark.slow, pytest.mark.skipif(bool(why_not()), reason=why_not() or "-")]

LAWS: dict[str, Callable[[dict[str, Any]], bool]] = {
    "stands_while_it_drives": lambda saw: saw["moves"] and saw["said to stand"] == [False, False],
    "bridge_restarts": lambda saw: saw["stands"] and saw["moved on s after it was back"] < 8.0 and saw["status"] == 0,
    "bridge_is_gone": lambda saw: saw["stands"] and saw["moved on s after it was back"] < 8.0 and saw["status"] == 3,
    "stop_after_a_restart": lambda saw: saw["said"] and saw["stands"] and saw["moved on s"] < 8.0,
    "slow_bridge": lambda saw: (
        saw["ended"] and saw["stands"] and saw["worst m between the believed and the true place"] < 2.0
    ),
    "server_dies": lambda saw: saw["noticed after s"] is not None and saw["noticed after s"] < 15.0,
    "server_restarts": lambda saw: saw["noticed after s"] is not None and saw["noticed after s"] < 15.0,
    "operator_takes_over": lambda saw: saw["operator's goal"] == "goes on",
    "operator_takes_over_and_ours_dies": lambda saw: saw["operator's goal"] == "goes on",
    "operator_takes_over_a_command": lambda saw: (
        saw["operator's goal"] == "goes on"
        and saw["status"] == 1
        and "A goal of another client continues" in saw["answer"]
    ),
    "operator_takes_over_a_command_and_a_signal_comes": lambda saw: (
        saw["operator's goal"] == "goes on"
        and saw["status"] in (1, 3)
        and "robot stands" not in saw["errors"]
        and "no goal was sent" not in saw["errors"]
    ),
    "program_killed": lambda saw: saw["stands"] and saw["moved on s"] < 5.0,
}


@pytest.mark.few(4)
@pytest.mark.parametrize("name", list(SCENARIOS))
def test_the_law_of(name: str, tmp_path: Path) -> None:
    saw = SCENARIOS[name](tmp_path)
    assert LAWS[name](saw), saw
