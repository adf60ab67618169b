"""The timing lane against a bare loop around the same engine calls: what our path adds to an engine's own time."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from impactbench.adapters import contestants
from impactbench.reports.cell import Cell, build, case_of, median_ranks, run_seconds, step_count
from impactbench.scenarios.engine import Unavailable

CASE = "bouncing_ball[bounciness=0.8]"
"""One ball: nothing to compute, so that whatever a harness adds weighs most."""
STEP = "1/960"
WITHIN = 0.01


def lane(quick: bool) -> dict[str, Any]:
    """Timing lane against a hand-written loop around the same engine calls, in pairs, in alternating order."""
    rows: list[dict[str, Any]] = []
    for name in ("mujoco/tuned", "pybullet/tuned", "pymunk/tuned"):
        try:
            rows.append({"contestant": name, **compare(name, 60 if quick else 400)})
        except Unavailable as why:
            rows.append({"contestant": name, "missing": str(why)})
    return {"case": CASE, "step": STEP, "rows": rows}


def compare(name: str, rounds: int) -> dict[str, Any]:
    """Median of the ratio of lane to bare loop over `rounds` pairs, with its 95 % interval, and that of the minima.

    Both start from the same state and do the same steps; order within a pair alternates; the first pair warms up.
    """
    (contestant,) = contestants.select([name])
    cell = Cell(CASE, "nc", name, "minimal", STEP)
    steps = step_count(case_of(cell).scene, cell.step_seconds)
    seconds: dict[bool, list[float]] = {False: [], True: []}
    for turn in range(rounds + 1):
        for bare in (False, True) if turn % 2 else (True, False):
            engine = build(cell, contestant)
            gc.disable()
            try:
                took = BARE[contestant.engine](engine, steps) if bare else run_seconds(engine, steps)
            finally:
                gc.enable()
                engine.close()
            if turn:
                seconds[bare].append(took)
    ratios = sorted(a / b for a, b in zip(seconds[False], seconds[True], strict=True))
    low, high = median_ranks(len(ratios))
    middle, least = float(np.median(ratios)), min(seconds[False]) / min(seconds[True])
    return {
        "us per step, bare": 1e6 * float(np.median(seconds[True])) / steps,
        "lane / bare": middle,
        "low": ratios[low],
        "high": ratios[high],
        "of the minima": least,
        "within 1 %": "yes" if abs(middle - 1) <= WITHIN else "no",
    }


def _mujoco(engine: Any, steps: int) -> float:
    import mujoco as mj

    model, data = engine._m, engine._d
    start = time.perf_counter()
    mj.mj_step(model, data, steps)
    return time.perf_counter() - start


def _bullet(engine: Any, steps: int) -> float:
    import pybullet as pb

    step, client = pb.stepSimulation, engine._c
    start = time.perf_counter()
    for _ in range(steps):
        step(client)
    return time.perf_counter() - start


def _munk(engine: Any, steps: int) -> float:
    step, h = engine._space.step, engine._step
    start = time.perf_counter()
    for _ in range(steps):
        step(h)
    return time.perf_counter() - start


BARE: dict[str, Callable[[Any, int], float]] = {"mujoco": _mujoco, "pybullet": _bullet, "pymunk": _munk}
"""Loops as one writes them by hand around an engine's own calls."""
