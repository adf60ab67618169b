"""How engines combine two surfaces' coefficients: measured in child processes, then named by the nearest law."""

from __future__ import annotations

import math
from collections.abc import Callable

from impactbench.adapters.contestants import CONTESTANTS
from impactbench.adapters.isolation import Job, Outcome, run_jobs
from impactbench.adapters.pair_probe import BOUNCE, PROBES, ROUGH, Measured

LAWS: dict[str, Callable[[float, float], float]] = {
    "product": lambda a, b: a * b,
    "minimum": min,
    "harmonic mean": lambda a, b: 2 * a * b / (a + b),
    "geometric mean": lambda a, b: math.sqrt(a * b),
    "mean": lambda a, b: (a + b) / 2,
    "maximum": max,
    "sum": lambda a, b: a + b,
}
CLOSE = 0.01
"""Of the coefficients themselves; two laws differ by at least 0.018 here (harmonic and geometric mean of 0.5, 0.8)."""
LIMIT = 60.0


def measured_laws() -> list[tuple[str, ...]]:
    """A row for each engine: its name, then restitution of two balls, of a ball and a wall, and friction."""
    engines = {c.engine: c.availability() for c in CONTESTANTS}
    jobs = [
        Job(engine, engine, "impactbench.adapters.pair_probe:measure", engine, LIMIT)
        for engine, missing in engines.items()
        if engine in PROBES and not missing
    ]
    rows = {outcome.key: _row(outcome) for outcome in run_jobs(jobs, 2)} if jobs else {}
    listed = dict.fromkeys([*PROBES, *engines])
    return [rows.get(engine) or (engine, *[_unmeasured(engine, engines)] * 3) for engine in listed]


def _unmeasured(engine: str, missing: dict[str, str]) -> str:
    return missing.get(engine) or "none: coefficients belong to pairs"


def _row(outcome: Outcome) -> tuple[str, ...]:
    found = outcome.value
    if not isinstance(found, dict):
        return (outcome.key, *[f"{outcome.state}: {outcome.reason}"] * 3)
    balls, wall = law_of_pair(found["balls"], BOUNCE), law_of_pair(found["wall"], BOUNCE)
    return (outcome.key, balls, wall, law_of_pair(found["friction"], ROUGH))


def law_of_pair(measured: Measured, coefficients: tuple[float, float]) -> str:
    """The law nearest to what was measured in both orders, with the number; `none` where there is no coefficient."""
    if measured is None:
        return "none"
    there, back = measured
    if abs(there - back) > CLOSE:
        return f"depends on the order ({there:.4f}, {back:.4f})"
    name = min(LAWS, key=lambda law: abs(LAWS[law](*coefficients) - there))
    return f"{name if abs(LAWS[name](*coefficients) - there) <= CLOSE else 'no law known'} ({there:.4f})"
