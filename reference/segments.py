"""Nearest points of two segments, either of which may be a point."""

from __future__ import annotations

from impactbench.reference.compiled import inlined
from impactbench.reference.triples import dot, subtract
from impactbench.scenarios.records import Vector


@inlined
def nearest(p: Vector, along_a: Vector, q: Vector, along_b: Vector) -> tuple[float, float]:
    """s and t in [0, 1] of the nearest points p + s along_a, q + t along_b (Ericson, Real-Time Collision Detection,
    5.1.9).
    """
    between = subtract(p, q)
    aa, bb, ab = dot(along_a, along_a), dot(along_b, along_b), dot(along_a, along_b)
    ar, br = dot(along_a, between), dot(along_b, between)
    area = aa * bb - ab * ab
    s = within((ab * br - ar * bb) / area) if area > 1e-12 * aa * bb else 0.5
    t = within((ab * s + br) / bb) if bb > 0 else 0.0
    s = within((ab * t - ar) / aa) if aa > 0 else 0.0
    return s, t


@inlined
def within(s: float) -> float:
    return min(1.0, max(0.0, s))
