"""One cell: a case run by one contestant at one step. Runs inside a child process; what it returns is plain data."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.measures import Figure, measure, self_consistency
from impactbench.scenarios import catalogue, scene_file
from impactbench.scenarios.engine import Engine, Unavailable, Unsupported
from impactbench.scenarios.records import FULL, Law, Scene, shifted
from impactbench.scenarios.trajectory import Floats, State, Trajectory
from impactbench.scenarios.truth import Case

READS = 5
"""Reads that are timed after each timed run: enough for a clock of 50 ns, few enough to cost nothing beside it."""
MOST_GAPS = 50_000_000
"""Gaps of pairs over all steps of a run: some 60 bytes each, 3 GB. Scene files and hard cases can ask for more."""


@dataclass(frozen=True)
class Cell:
    """What identifies a cell. `step` is text such as 1/240, so that it names the same number everywhere; `phase` is
    in steps. `scene` is what a scene file said; a child knows the catalogue's cases by name. `until` [s] ends the run
    earlier than its scene does.
    """

    case: str
    law: Law
    contestant: str
    model: str
    step: str
    phase: float = 0.0
    scene: Scene | None = None
    until: float = math.inf

    @property
    def step_seconds(self) -> float:
        return step_seconds(self.step)

    @property
    def key(self) -> str:
        return f"{self.case} {self.law} {self.contestant} {self.model} {self.step} {self.phase:g}"

    @property
    def steps(self) -> int:
        """How many steps are run."""
        count = step_count(case_of(self).scene, self.step_seconds)
        return min(count, max(1, round(self.until / self.step_seconds))) if math.isfinite(self.until) else count


def step_seconds(text: str) -> float:
    """Seconds of `1/240` or `0.004`. Raises ValueError with what is possible instead."""
    try:
        seconds = float(Fraction(text))
    except (ValueError, ZeroDivisionError):
        seconds = math.nan
    if not (math.isfinite(seconds) and 0 < seconds <= 1):
        raise ValueError(f"step {text!r} is not a number of seconds above 0 and up to 1; write it as 1/240 or 0.004")
    return seconds


@cache
def case_named(name: str) -> Case:
    (case,) = catalogue.select([name])
    return case


def case_of(cell: Cell) -> Case:
    """The cell's case: that of its own scene, else the catalogue's."""
    return case_named(cell.case) if cell.scene is None else scene_file.case_of(cell.scene)


def step_count(scene: Scene, step: float) -> int:
    """Steps that reach the scene's end: as many as fit, to half a round-off of their number."""
    return max(1, round(scene.duration / step))


def build(cell: Cell, contestant: Contestant, halving: int = 1) -> Engine:
    """The contestant's world for this cell, its step divided by `halving`. Raises Unsupported or Unavailable with a
    reason.
    """
    scene = case_of(cell).scene
    if cell.phase:
        scene = shifted(scene, cell.phase * cell.step_seconds)
    model = scene.model if cell.model == "minimal" else FULL
    engine: Engine = contestant.load()(scene, cell.law, contestant.profile, model, cell.step_seconds / halving)
    return engine


def run_cell(argument: tuple[Cell, Contestant]) -> dict[str, Any]:
    """State, reason, settings and figures of one cell, recorded at every step."""
    cell, contestant = argument
    if reason := too_large(case_of(cell).scene, cell.step_seconds):
        return {"state": "unsupported", "reason": reason}
    try:
        engine = build(cell, contestant)
    except Unsupported as why:
        return {"state": "unsupported", "reason": str(why)}
    except Unavailable as why:
        return {"state": "unavailable", "reason": str(why)}
    try:
        case = case_of(cell)
        trajectory = record(engine, cell.step_seconds, cell.steps)
        settings = {name: plain(value) for name, value in engine.settings.items()}
    except Unsupported as why:  # an engine may find out only on the way, as when impacts accumulate
        return {"state": "unsupported", "reason": str(why)}
    finally:
        engine.close()
    if not trajectory.finite():
        return {"state": "diverged", "reason": first_divergence(trajectory), "settings": settings}
    # A state that is finite yet absurd overflows in the measures: that run has diverged too.
    with np.errstate(over="ignore", invalid="ignore"):
        figures = measure(case, cell.law, trajectory, cell.phase * cell.step_seconds)
        if case.from_file:
            figures += _against_half_step(cell, contestant, trajectory)
    if not all(math.isfinite(figure.value) for figure in figures):
        bad = next(figure.measure for figure in figures if not math.isfinite(figure.value))
        return {"state": "diverged", "reason": f"{bad} is not finite", "settings": settings}
    return {"state": "ok", "reason": "", "settings": settings, "figures": figures}


def too_large(scene: Scene, step: float) -> str:
    """Why a scene of this size is not measured; empty where it is. Every pair is measured at every step."""
    movable = len(scene.movable)
    pairs = movable * (movable - 1) // 2 + movable * len(scene.statics)
    count = step_count(scene, step)
    if pairs * count <= MOST_GAPS:
        return ""
    return f"{pairs} pairs at {count} steps are more than the {MOST_GAPS} gaps measured; fewer bodies or a larger step"


def _against_half_step(cell: Cell, contestant: Contestant, trajectory: Trajectory) -> list[Figure]:
    """The distance from the same cell at half the step, read at the same times; none where that one is unsupported."""
    try:
        engine = build(cell, contestant, 2)
    except Unsupported:
        return []
    try:
        finer = record(engine, cell.step_seconds, len(trajectory.times) - 1, 2)
        return self_consistency(case_of(cell).scene, trajectory, finer)
    except Unsupported:
        return []
    finally:
        engine.close()


def record(engine: Engine, step: float, count: int, every: int = 1) -> Trajectory:
    """The state at every step, so that no maximum is missed between samples; `every` of the engine's make one here."""
    states = [engine.read()]
    for _ in range(count):
        engine.advance(every)
        states.append(engine.read())
    return stack(np.arange(count + 1) * np.float64(step), states)


def stack(times: Floats, states: Sequence[State]) -> Trajectory:
    first = states[0]
    turning = first.spins is not None and first.orientations is not None
    return Trajectory(
        times,
        np.array([state.positions for state in states]),
        np.array([state.velocities for state in states]),
        np.array([state.orientations for state in states]) if turning else None,
        np.array([state.spins for state in states]) if turning else None,
    )


def first_divergence(trajectory: Trajectory) -> str:
    fine = np.isfinite(trajectory.positions).all(axis=2) & np.isfinite(trajectory.velocities).all(axis=2)
    if fine.all():
        return "orientation or spin is not finite"
    step, row = np.argwhere(~fine)[0]
    return f"body {row} is not finite at t = {trajectory.times[step]:.6g} s"


def plain(value: object) -> object:
    """A setting as JSON can hold it."""
    return value if isinstance(value, (str, int, float, bool)) or value is None else str(value)


Times = dict[str, list[float]]


class Empty:
    """An engine that does nothing: what the timing lane clocks of it is the harness' own share."""

    def advance(self, _: int) -> None:
        """Do nothing."""


def time_cells(argument: tuple[Sequence[tuple[Cell, Contestant]], int]) -> dict[str, Times]:
    """Times of each cell, one number a round: cells take turns, in alternating order, after a round of warm-up.

    `run` and `harness`: wall seconds per simulated second of the cell's engine and of one that does nothing, by the
    same path; `read`: seconds of one read of the state. Building is outside the clock; nothing is read inside it. A run
    whose final state is not finite has no speed and is left out.
    """
    cells, rounds = argument
    times: dict[str, Times] = {cell.key: {"run": [], "harness": [], "read": []} for cell, _ in cells}
    for turn in range(rounds + 1):
        for cell, contestant in cells if turn % 2 else reversed(cells):
            found = _time_once(cell, contestant)
            for name, seconds in found.items() if turn else ():
                times[cell.key][name].append(seconds)
    return {key: found for key, found in times.items() if len(found["run"]) == rounds}


def _time_once(cell: Cell, contestant: Contestant) -> dict[str, float]:
    engine = build(cell, contestant)
    step = cell.step_seconds
    count = step_count(case_of(cell).scene, step)
    gc.disable()
    try:
        elapsed, nothing = run_seconds(engine, count), run_seconds(Empty(), count)
        start = time.perf_counter()
        for _ in range(READS):
            final = engine.read()
        read = (time.perf_counter() - start) / READS
    finally:
        gc.enable()
        engine.close()
    if not (np.isfinite(final.positions).all() and np.isfinite(final.velocities).all()):
        return {}
    return {"run": elapsed / (count * step), "harness": nothing / (count * step), "read": read}


def run_seconds(engine: Engine | Empty, count: int) -> float:
    """Wall seconds of `count` steps: all that stands inside the clock of the timing lane."""
    start = time.perf_counter()
    engine.advance(count)
    return time.perf_counter() - start


def timing_figures(times: Times) -> list[Figure]:
    """Minimum, median and the interval that holds the true median with at least 95 % (order statistics, binomial);
    medians of what a read costs and of the harness' own share.
    """
    ordered = sorted(times["run"])
    low, high = median_ranks(len(ordered))
    return [
        Figure("wall_time", float(np.median(ordered))),
        Figure("wall_time_min", ordered[0]),
        Figure("wall_time_low", ordered[low]),
        Figure("wall_time_high", ordered[high]),
        Figure("wall_repeats", float(len(ordered))),
        Figure("wall_harness", float(np.median(times["harness"]))),
        Figure("wall_read", float(np.median(times["read"]))),
    ]


def median_ranks(count: int) -> tuple[int, int]:
    """Ranks (from 0) of the narrowest symmetric pair of order statistics that brackets the median with at least 95 %.

    P(the median is below the k-th smallest) = sum over i < k of C(n, i) / 2^n. With fewer than 6 values no pair
    does so: then the extremes.
    """
    outside, low = 0.0, 0
    while low < count // 2:
        outside += math.comb(count, low) / 2**count
        if 2 * outside > 0.05:
            break
        low += 1
    low = max(low - 1, 0)
    return low, count - 1 - low
