"""How far the lists of the fast runner reach, and over what its grids span."""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.swarm import Dim
from impactbench.scenarios.trajectory import Floats

PAIR_COST, BUILD_COST = 3.0, 100.0
"""Rough ns: to look at one listed pair; to sort a body and list its pairs. They only balance the skin."""
SIGMAS = 3.0
"""A grid spans so many standard deviations of the bodies' positions, and no more than the bodies do."""


@compiled
def span(place: Floats, k: int, stride: int) -> tuple[float, float]:
    """Bounds [m] of coordinate k, without what lies `SIGMAS` off the mean."""
    n = len(place) // stride
    if n == 0:
        return 0.0, 0.0
    total, square, low, high = 0.0, 0.0, math.inf, -math.inf
    shift = place[k]
    for i in range(n):
        x = place[i * stride + k]
        total += x - shift
        square += (x - shift) * (x - shift)
        low, high = min(low, x), max(high, x)
    mean = total / n
    wide = SIGMAS * math.sqrt(max(0.0, square / n - mean * mean))
    return max(low, shift + mean - wide), min(high, shift + mean + wide)


@compiled
def best_skin(dim: Dim, density: float, diameter: float, travel: float) -> float:
    """Skin [m] at which looking at pairs and building lists cost the least together. travel [m]: fastest, per step."""
    d = len(dim)
    ball = 2.0 if d == 1 else math.pi if d == 2 else 4 * math.pi / 3
    least = 2.5 * travel
    unit = max(diameter, 4 * least)
    if unit <= 0:
        return 1.0
    best, found = math.inf, unit
    for k in range(1, 41):
        skin = max(0.05 * k * unit, least)
        cost = PAIR_COST * density / 2 * ball * (diameter + skin) ** d + BUILD_COST * 2 * travel / skin
        if cost < best:
            best, found = cost, skin
    return found
