"""What a machine says of itself before times are taken, and what a comparison says it will take."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reports import compare as comparison
from impactbench.reports.estimate import estimate
from impactbench.reports.machine import condition, notes
from impactbench.scenarios.catalogue import select

QUIET = {"host": "a", "processor": "b", "others": 0.0, "fastest": 1.00e-3, "median": 1.01e-3, "taken": 0.0}


def test_other_programs_are_seen() -> None:
    """Twice as many endless loops as cores: on average at least one is seen beside this process, at any time."""
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2 * (os.cpu_count() or 1))]
    try:
        found = condition()
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
    assert found["others"] >= 1
    assert 0 < found["fastest"] <= found["median"]
    assert "other programs ran" in notes({"before": found}, False)[0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"others": 1.2}, "busy just before times were taken: 1.2 other programs ran"),
        ({"taken": 0.2}, "20% of the processor's time was not ours"),
        ({"median": 1.2e-3}, "the same loop took 20% longer than at best"),
        ({"fastest": 0.8e-3, "median": 0.8e-3}, "the processor's pace changed while times were taken"),
    ],
)
def test_each_disturbance_is_named(changes: dict[str, Any], said: str) -> None:
    assert notes({"before": QUIET, "after": QUIET}, False) == []
    (note,) = notes({"before": QUIET | changes, "after": QUIET}, False)
    assert said in note


def test_a_worker_that_took_the_times_is_named() -> None:
    assert notes({"before": QUIET, "after": QUIET}, True) == ["times were taken by worker a (b)"]


SLOW = """
import time
import numpy as np
from impactbench.scenarios.trajectory import State

class Slow:
    settings = {}
    def __init__(self, scene, law, profile, model, step):
        time.sleep(0.02)
    def advance(self, steps):
        time.sleep(0.002 * steps)
    def read(self):
        return State(np.zeros((1, 3)), np.zeros((1, 3)))
    def close(self): ...
"""


def test_the_time_a_comparison_takes_is_told_beforehand(tmp_path: Path) -> None:
    """20 ms a world and 2 ms a step. Sleeping is never shorter; what a busy machine and our measuring add is less than
    as much again.
    """
    (tmp_path / "slow.py").write_text(SLOW)
    contestants = select_contestants([f"{tmp_path / 'slow.py'}:Slow"])
    plan = comparison.Plan(select(["free_flight[dimension=1]"]), contestants, ("1/30", "1/60"), timing="all")
    (case,) = plan.cases
    counts = [round(case.scene.duration * rate) for rate in (30, 60)]
    once = sum(0.02 + 0.002 * count for count in counts)
    found = estimate(plan.cells(), plan.timed(), 0.0, comparison.ROUNDS, 1)
    assert once <= found.accuracy <= 2 * once
    assert (comparison.ROUNDS + 1) * once <= found.timing <= 2 * (comparison.ROUNDS + 1) * once
    assert found.seconds == found.accuracy + found.timing
