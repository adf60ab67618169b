"""A crowd that falls under gravity, bounces and rubs: what a body costs among few and among many."""

from __future__ import annotations

import time
from typing import Any

from impactbench.reference.contestant import Stepped
from impactbench.scenarios.crowds import heap as falling

STEP = 1 / 240
PARTS = {"falling": 4, "landing": 4}
"""So many times 0.1 s each: most balls fly; most bounce off the floor and one another."""


def heap(quick: bool) -> dict[str, Any]:
    """Cost per body and step of one crowd of balls that falls into a pit, and of ten a tenth as large; in turns."""
    small, copies = (100 if quick else 1000), 10
    heaps = {small: [_engine(small, seed) for seed in range(copies)], small * copies: [_engine(small * copies, 0)]}
    rows: dict[int, dict[str, Any]] = {size: {"bodies": size, "heaps": len(engines)} for size, engines in heaps.items()}
    for phase, parts in PARTS.items():
        seconds = dict.fromkeys(heaps, 0.0)
        for _ in range(parts):
            for size, engines in heaps.items():
                seconds[size] += _advance(engines, 24)
        for size, row in rows.items():
            row[f"ns per body and step, {phase}"] = seconds[size] / (24 * parts * small * copies) * 1e9
    few, many = rows.values()
    return {
        "rows": [few, many],
        **{f"growth, {phase}": many[key] / few[key] for phase in PARTS if (key := f"ns per body and step, {phase}")},
    }


def _engine(count: int, seed: int) -> Stepped:
    scene = falling(count, seed=seed)
    return Stepped(scene, "nc", "stepped", scene.model, STEP)


def _advance(engines: list[Stepped], steps: int) -> float:
    begin = time.perf_counter()
    for engine in engines:
        engine.advance(steps)
    return time.perf_counter() - begin
