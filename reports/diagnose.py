"""A look into one failure, inside a child process: when the budget is first exceeded, and by which bodies."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.budgets import check_named
from impactbench.reports.cell import Cell, build, case_of, record
from impactbench.reports.impacts import pair_histories
from impactbench.reports.measures import measure
from impactbench.reports.verdicts import APART
from impactbench.scenarios.records import Scene
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

AT_THE_END = ("position_error", "velocity_error", "spin_error", "energy_drift")
"""Figures of a run's last state: they may come and go. All others only grow with the run."""
LOOKS = 48


def diagnose(argument: tuple[Cell, Contestant, str, float]) -> dict[str, Any]:
    """First time [s] at which the check's figure exceeds the budget, how long [s] a run must be to show it, and the
    names of the bodies concerned.

    Empty where the run does not fail any more: it then was not deterministic.
    """
    cell, contestant, name, budget = argument
    case, check = case_of(cell), check_named(name)
    engine = build(cell, contestant)
    try:
        run = record(engine, cell.step_seconds, cell.steps)
    finally:
        engine.close()

    def fails(count: int) -> bool:
        """Whether a run of `count` steps exceeds the budget."""
        with np.errstate(over="ignore", invalid="ignore"):
            figures = measure(case, cell.law, _first(run, count), cell.phase * cell.step_seconds)
        value = next((figure.value for figure in figures if figure.measure == check.measure), 0.0)
        return not (math.isfinite(value) and check.excess(value) <= budget)

    last = len(run.times) - 1
    first = _first_failure(fails, last, check.measure in AT_THE_END)
    if first is None:
        return _of_missing_impact(case, cell, last * cell.step_seconds)
    if case.truths[cell.law].kind == "end state":  # on the way to rest nothing is where it ends
        first = last
    bodies = (
        _farthest(case, cell, run, first) if check.measure == "position_error" else _nearest(case.scene, run, first)
    )
    return {"time": float(run.times[first]), "until": float(run.times[first]), "bodies": bodies}


def _first_failure(fails: Callable[[int], bool], last: int, comes_and_goes: bool) -> int | None:
    """Fewest steps of a failing run, to within what `LOOKS` evenly spread looks can miss."""
    if not fails(last):
        return None
    counts = [int(k) for k in np.unique(np.linspace(1, last, LOOKS if comes_and_goes else 1).round())]
    high = next((count for count in counts if fails(count)), last) if comes_and_goes else last
    low = max((count for count in counts if count < high), default=0) if comes_and_goes else 0
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if fails(middle) else (middle, high)
    return high


def _first(run: Trajectory, count: int) -> Trajectory:
    def cut(array: Floats | None) -> Floats | None:
        return None if array is None else array[: count + 1]

    return replace(
        run,
        times=run.times[: count + 1],
        positions=run.positions[: count + 1],
        velocities=run.velocities[: count + 1],
        orientations=cut(run.orientations),
        spins=cut(run.spins),
    )


def _nearest(scene: Scene, run: Trajectory, step: int) -> list[str]:
    """The pair with the smallest gap, next to its closeness over the run; the fastest body where nothing can meet."""
    pairs = pair_histories(scene, run)
    if pairs:
        window = slice(max(step - 1, 0), step + 1)
        pair = min(pairs, key=lambda p: float(p.gap[window].min()))
        return [scene.bodies[pair.a].name, scene.bodies[pair.b].name]
    row = int(np.argmax(np.linalg.norm(run.velocities[step], axis=1)))
    return [scene.bodies[scene.movable[row]].name]


def _farthest(case: Case, cell: Cell, run: Trajectory, step: int) -> list[str]:
    state = case.truths[cell.law].state(float(run.times[step]) - cell.phase * cell.step_seconds)
    if state is None:
        return []
    row = int(np.argmax(np.linalg.norm(run.positions[step] - state.positions, axis=1)))
    return [case.scene.bodies[case.scene.movable[row]].name]


def _of_missing_impact(case: Case, cell: Cell, end: float) -> dict[str, Any]:
    """The instant of the truth's first impact, which the run does not have."""
    times = [time for time in case.truths[cell.law].impact_times if time <= end]
    soon = times[0] + (APART + 1) * cell.step_seconds if times else 0.0
    return {"time": times[0], "until": min(soon, end), "bodies": []} if times else {}
