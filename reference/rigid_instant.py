"""The instant of an impact within a step: rigid bodies that fly into contact do not overlap."""

from __future__ import annotations

import math
from typing import NamedTuple

from impactbench.reference.compiled import compiled
from impactbench.reference.features import Features
from impactbench.reference.rigid_motion import Poses, Steps, move, poses, put_back
from impactbench.reference.rigid_touches import Couples, Memory, Touches, least_gap
from impactbench.reference.solids import Solids
from impactbench.reference.triples import length, row

SEARCH = 80
"""Looks at most for one instant."""
SAMPLES = 1000
INSTANT = 1e-10
"""Times this close, next to the step, are one: where another corner takes a contact over, gaps may jump."""


class Way(NamedTuple):
    """The bodies' way through a step, to be gone again for other times."""

    solids: Solids
    couples: Couples
    touches: Touches
    forces: Memory
    """Of the contacts, all the way: the first guess for parts of it."""
    start: Poses
    found: Features


@compiled
def gap_after(way: Way, steps: Steps, time: float) -> tuple[float, Memory]:
    """Go the way of `time` [s]; returns the least gap [m] of what did not touch at its beginning, and the forces."""
    put_back(way.solids, way.start)
    after, _ = move(way.solids, way.touches, way.forces, steps, time)
    return least_gap(way.solids, way.couples, after, way.found), after


@compiled
def impact_time(way: Way, steps: Steps, left: float, width: float) -> tuple[float, Memory]:
    """The first time in (0, left] at which a feature that did not touch does; leaves the bodies there, with the forces
    until then. `left` if there is none: the bodies stay, gone all the way.

    width [m]: the smallest half width. Samples are close enough that no body passes another between two; then regula
    falsi.
    """
    samples = samples_of(way.solids, left, width)
    gap = least_gap(way.solids, way.couples, way.forces, way.found)
    if samples == 1 and not gap < -steps.touch / 2:
        return left, way.forces
    end, before, above = poses(way.solids), 0.0, math.inf
    for sample in range(1, samples + 1):
        time = left * sample / samples
        if samples > 1:
            gap, _ = gap_after(way, steps, time)
        if gap < -steps.touch / 2:
            if above == math.inf:
                put_back(way.solids, way.start)
                above = max(least_gap(way.solids, way.couples, way.forces, way.found), steps.touch)
            return root(way, steps, before, above, time, gap)
        before, above = time, gap
    put_back(way.solids, end)
    return left, way.forces


@compiled
def root(way: Way, steps: Steps, low: float, above: float, high: float, below: float) -> tuple[float, Memory]:
    """Time [s] at which the least gap is within a touch of 0, by Illinois' false position; `above` and `below` are the
    gaps at `low` and `high`.
    """
    last, time, after = 0.0, high, way.forces
    for _ in range(SEARCH):
        time = high - below * (high - low) / (below - above)
        if not low < time < high:
            time = (low + high) / 2
        if high - low <= INSTANT * steps.step:
            time = high
        gap, after = gap_after(way, steps, time)
        if abs(gap) <= steps.touch / 2 or time == high:
            break
        again = gap * last > 0
        if gap < 0:
            high, below, above = time, gap, above / 2 if again else above
        else:
            low, above, below = time, gap, below / 2 if again else below
        last = gap
    return time, after


@compiled
def samples_of(solids: Solids, left: float, width: float) -> int:
    """So many that between two no body moves by more than half the smallest half width."""
    fastest = 0.0
    for i in range(len(solids.lightness)):
        fastest = max(fastest, length(row(solids.velocity, i)))
    return max(1, min(SAMPLES, math.ceil(2 * fastest * left / width))) if width > 0 else 1
