"""What a headline error is worth: what doing nothing would score in it, and where round-off begins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from impactbench.reports.cell import stack
from impactbench.reports.measures import measure
from impactbench.scenarios.pieces import opening
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 30
"""[s] The coarsest of the ladder: what these runs score hardly depends on it."""
FINEST = 1 / 960
MOST = 200_000
"""Gaps of pairs over all steps that are worth a null model: a tenth of a second."""
PLACES = ("position_error", "trajectory_error", "penetration_max")


def limits_of(case: Case) -> dict[str, Any]:
    """`null`: the headline measure of a scene that stays as it begins (`frozen`) and of a perfect integrator that
    knows no contact (`no contact`: parabolas, spins as they begin), each where it has one; under Newton-Coulomb where
    the scene allows it. `floor`: the round-off that must be allowed for on the finest rung.
    """
    scene = case.scene
    law: Law = "nc" if "nc" in case.truths else scene.laws[0]
    found = {"null": _null(case, law), "floor": floor(case)}
    return {key: value for key, value in found.items() if value}


def _null(case: Case, law: Law) -> dict[str, float]:
    scene = case.scene
    count = max(1, round(scene.duration / STEP))
    movable = len(scene.movable)
    if (movable * (movable - 1) // 2 + movable * len(scene.statics)) * count > MOST or not movable:
        return {}
    runs = {"frozen": parabolas(scene, count, frozen=True), "no contact": parabolas(scene, count, frozen=False)}
    found = {}
    for name, run in runs.items():
        with np.errstate(all="ignore"):
            figures = {figure.measure: abs(figure.value) for figure in measure(case, law, run)}
        if math.isfinite(figures.get(case.headline, math.nan)):
            found[name] = figures[case.headline]
    return found


def parabolas(scene: Scene, count: int, frozen: bool) -> Trajectory:
    """Free flight of every body through whatever is in its way; with `frozen`, the start for ever."""
    start, times = opening(scene), np.arange(count + 1) * np.float64(STEP)
    return stack(times, [start.at(0.0 if frozen else float(time)) for time in times])


def floor(case: Case) -> float:
    """Round-off of as many steps as the finest rung has, all falling the same way: n 2^-53, times how many lengths
    from the origin a place is.
    """
    scene = case.scene
    steps = scene.duration / FINEST
    if case.headline not in PLACES:
        return steps * 2.0**-53
    start = max((abs(x) for body in scene.bodies if not body.static for x in body.position), default=0.0)
    return steps * 2.0**-53 * max(1.0, (start + scene.speed * scene.duration) / scene.length)
