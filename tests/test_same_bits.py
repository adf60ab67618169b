"""Identical bits: from run to run, for one or two threads, in however many calls."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import pytest
from impactbench.reference.contestant import Stepped
from impactbench.reference.exact_contestant import Exact
from impactbench.scenarios.crowds import gas, heap

STEP = 1 / 240
RUNS = {
    "gas": lambda: Stepped(world := gas(300, 3, 0.2), "doc", "stepped", world.model, STEP),
    "heap": lambda: Stepped(world := heap(200), "nc", "stepped", world.model, STEP),
    "exact": lambda: Exact(world := gas(100, 3, 0.1), "doc", "exact", world.model, STEP),
}


def digest(name: str, calls: int) -> str:
    """Of the state after 240 steps."""
    run = RUNS[name]()
    for _ in range(calls):
        run.advance(240 // calls)
    state = run.read()
    return hashlib.sha256(state.positions.tobytes() + state.velocities.tobytes()).hexdigest()


@pytest.mark.parametrize("name", RUNS)
def test_identical_bits_from_run_to_run_and_for_one_or_two_threads(name):
    found = {
        subprocess.run(
            [sys.executable, __file__, name],
            env={**os.environ, "NUMBA_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for threads in ("1", "2")
    }
    assert {*found, digest(name, 240), digest(name, 2)} == {digest(name, 1)}


if __name__ == "__main__":
    print(digest(sys.argv[1], 1))
