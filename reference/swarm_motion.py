"""Single bodies of the fast runner: what they do along a direction, how far they went."""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.swarm import CLOSING, DEEPEST, Dim
from impactbench.scenarios.trajectory import Floats


@compiled
def note(gauge: Floats, depth: float, closing: float, sweep: int) -> None:
    if sweep == 0:
        gauge[DEEPEST] = max(gauge[DEEPEST], depth)
        gauge[CLOSING] = max(gauge[CLOSING], closing)


@compiled
def speed_along(dim: Dim, velocity: Floats, i: int, x: float, y: float, z: float) -> float:
    d = len(dim)
    at = i * (d + 1)
    along = float(velocity[at] * x)
    if d > 1:
        along += velocity[at + 1] * y
    if d > 2:
        along += velocity[at + 2] * z
    return along


@compiled
def add(dim: Dim, values: Floats, i: int, x: float, y: float, z: float) -> None:
    """Add (x, y, z) to the row of body i, as far as it has axes."""
    d = len(dim)
    at = i * (d + 1)
    values[at] += x
    if d > 1:
        values[at + 1] += y
    if d > 2:
        values[at + 2] += z


@compiled
def way(dim: Dim, place: Floats, origin: Floats, i: int) -> float:
    """How far [m] body i is from where the lists were built. They stay complete while no body is further than `TRAVEL`
    says.
    """
    d, square = len(dim), 0.0
    for k in range(d):
        square += (place[i * (d + 1) + k] - origin[i * (d + 1) + k]) ** 2
    return math.sqrt(square)
