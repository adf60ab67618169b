"""Rule R2 in figures: which pairs there are, which are looked at, and what the others would cost."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from impactbench.reference.coefficients import build_coefficients
from impactbench.reference.contestant import Stepped
from impactbench.reference.gaps import locate_all
from impactbench.reference.nearby import all_pairs
from impactbench.reference.pairs import pair_counts
from impactbench.reference.particles import Bodies, Pairs, build_bodies
from impactbench.scenarios import crowds
from impactbench.scenarios.records import Scene

STEPS = 200


def count_pairs(count: int, rounds: int) -> dict[str, Any]:
    """Counts for `count` spheres, half of them static; times in alternation, the shortest of all rounds."""
    scene = _spheres(crowds.gas(count, statics=count // 2))
    static, one_way, two_way = pair_counts(count // 2, count - count // 2)
    bodies = build_bodies(scene)
    handled = all_pairs(scene, bodies, build_coefficients(scene))
    everything = _static_too(handled, count)
    ours, free, saved = _time_looks(bodies, handled, everything, rounds)
    mixed, moving = (_candidates(crowds.gas(count, statics=n)) for n in (count // 2, 0))
    share = static / (static + one_way + two_way)
    return {
        "rows": [
            {"pairs": "static-static", "number": static, "share": share, "looked at": 0},
            {"pairs": "one-way", "number": one_way, "share": one_way / len(everything.first), "looked at": one_way},
            {"pairs": "two-way", "number": two_way, "share": two_way / len(everything.first), "looked at": two_way},
        ],
        "look at handled pairs [us]": ours * 1e6,
        "look at all pairs [us]": free * 1e6,
        "time saved by R2": saved,
        "candidates a step with cells, half static": mixed,
        "candidates a step with cells, all movable": moving,
    }


def _spheres(scene: Scene) -> Scene:
    return replace(scene, bodies=tuple(body for body in scene.bodies if body.name.startswith("ball")))


def _static_too(handled: Pairs, count: int) -> Pairs:
    """What the list would be if static pairs were looked at too."""
    first, second = np.array(list(combinations(range(count), 2)), dtype=np.int64).T.copy()
    return handled._replace(first=first, second=second, gap=np.zeros(len(first)), normal=np.zeros((len(first), 3)))


def _time_looks(bodies: Bodies, handled: Pairs, everything: Pairs, rounds: int) -> tuple[float, float, float]:
    """Seconds of one look at every pair of each list, with the runner's own test of two bodies, and the share saved."""
    locate_all(bodies, handled)
    locate_all(bodies, everything)
    seconds: tuple[list[float], list[float]] = ([], [])
    for turn in range(rounds):
        for which in (0, 1) if turn % 2 else (1, 0):
            begin = time.perf_counter()
            locate_all(bodies, (handled, everything)[which])
            seconds[which].append(time.perf_counter() - begin)
    # The same work each time: whatever takes longer than the shortest look is the machine's doing.
    return min(seconds[0]), min(seconds[1]), 1 - min(seconds[0]) / min(seconds[1])


def _candidates(scene: Scene) -> float:
    """Pairs of two movable bodies that the fast runner looks at in a step."""
    engine = Stepped(scene, "doc", "stepped", scene.model, 1 / 240)
    engine.advance(STEPS)
    return engine.figures().get("pairs looked at", float("nan")) / STEPS
