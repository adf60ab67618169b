"""One hard case run by one contestant at one step, judged by its family's criteria. Runs inside a child process."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import Cell, build, case_of, first_divergence, plain, record, step_count
from impactbench.scenarios.engine import Unavailable, Unsupported
from impactbench.scenarios.hard import HARD
from impactbench.scenarios.records import Scene
from impactbench.scenarios.survival import judge
from impactbench.scenarios.trajectory import Trajectory

MOST_NUMBERS = 100_000_000
"""Numbers a recorded run may hold, 800 MB: beyond, every k-th step is read."""


def run_hard(argument: tuple[Cell, Contestant]) -> dict[str, Any]:
    """State, reason, settings, verdicts and outcome of one cell.

    States: `survived` or `failed` by the criteria; `diverged` where a number is not finite or the engine put the whole
    world back to its start; `unsupported` and `unavailable` as the engine says.
    """
    cell, contestant = argument
    try:
        engine = build(cell, contestant)
    except Unsupported as why:
        return {"state": "unsupported", "reason": str(why)}
    except Unavailable as why:
        return {"state": "unavailable", "reason": str(why)}
    try:
        scene = case_of(cell).scene
        count = step_count(scene, cell.step_seconds)
        every = stride(scene, count)
        trajectory = record(engine, every * cell.step_seconds, max(count // every, 1), every)
        settings = {name: plain(value) for name, value in engine.settings.items()}
    except Unsupported as why:  # an engine may find out only on the way, as when impacts accumulate
        return {"state": "unsupported", "reason": str(why)}
    finally:
        engine.close()
    return {**assess(scene, trajectory), "settings": settings, "every": every}


def assess(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """What became of a run, from its trajectory alone."""
    if not trajectory.finite():
        return {"state": "diverged", "reason": first_divergence(trajectory)}
    if (time := put_back(trajectory, scene.length)) is not None:
        return {"state": "diverged", "reason": f"the whole world jumped back to its start at t = {time:.6g} s"}
    family = HARD[scene.family]
    try:
        verdicts = judge(scene, family.criteria(scene), trajectory)
    except OverflowError as why:
        return {"state": "diverged", "reason": str(why)}
    broken = sorted((v for v in verdicts if v.time is not None), key=lambda v: v.time or 0.0)
    first = broken[0] if broken else None
    return {
        "state": "failed" if broken else "survived",
        "reason": f"{first.criterion} {first.worst:.3g} > {first.limit:g} from t = {first.time:.4g} s" if first else "",
        "verdicts": [asdict(verdict) for verdict in verdicts],
        "outcome": family.outcome(scene, trajectory) if family.outcome else "",
    }


def stride(scene: Scene, count: int) -> int:
    """Steps from one reading to the next: 1 unless the recorded run would not fit."""
    return max(1, math.ceil(13 * len(scene.movable) * count / MOST_NUMBERS))


def put_back(trajectory: Trajectory, length: float) -> float | None:
    """Time [s] at which all bodies are, to the last bit, where they were at the first or second reading, by a jump.

    An engine that resets its world on a bad number leaves no other trace. A periodic motion that returns exactly does
    so by moving: its last displacement is that of its velocity, which a jump's is not. A jump is longer than a
    thousandth of the scene's `length` [m]: a body that is pushed to and fro by round-off has not been put back.
    """
    x, v, h = trajectory.positions, trajectory.velocities, np.diff(trajectory.times)[0]
    for early in (0, 1):
        same = (x[2:] == x[early]).all(axis=(1, 2)) & (v[2:] == v[early]).all(axis=(1, 2))
        for k in np.flatnonzero(same) + 2:
            moved = x[k] - x[k - 1]
            drift = min(np.abs(moved - h * v[k]).max(), np.abs(moved - h * v[k - 1]).max())
            if min(drift, np.abs(moved).max()) > 1e-3 * length:
                return float(trajectory.times[k])
    return None
