"""Free rotation of a rigid body: the angular momentum L in world axes stays, the orientation follows w = I^-1 L.

Closed form where two principal moments agree (a body's frame turns steadily about L, and the body in it about its own
axis); else a commutator-free Lie-group method of order 4 (Celledoni, Marthinsen and Owren, Commutator-free Lie group
methods, Future Generation Computer Systems 19, 2003), which keeps L by construction and the energy to its order.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.triples import (
    apply,
    back,
    exponential,
    length,
    matrix,
    plus,
    product,
    scale,
)
from impactbench.scenarios.records import Quaternion, Vector

ALIKE = 1e-12
"""Principal moments this close, next to the largest, are equal."""
TURN = 0.05
"""[rad] Largest turn in one substep of the method; its local error is of the order of TURN^5/100 = 3e-9."""


@compiled
def axis_of(principal: Vector) -> int:
    """The body's axis of symmetry: 0, 1 or 2 where the other two moments agree, 3 if all do, -1 if none."""
    i, j, k = principal
    near = ALIKE * max(i, j, k)
    if abs(j - k) <= near:
        return 3 if abs(k - i) <= near and abs(i - j) <= near else 0
    if abs(k - i) <= near:
        return 1
    return 2 if abs(i - j) <= near else -1


@compiled
def spin_of(principal: Vector, q: Quaternion, momentum: Vector) -> Vector:
    """w = R diag(1/I) R^T L [rad/s]."""
    axes = matrix(q)
    own = back(axes, momentum)
    return apply(axes, (own[0] / principal[0], own[1] / principal[1], own[2] / principal[2]))


@compiled
def turn(principal: Vector, q: Quaternion, momentum: Vector, time: float) -> Quaternion:
    """The orientation after `time` [s] of free rotation with the angular momentum L [kg m^2/s]."""
    axis = axis_of(principal)
    if axis == 3:
        return product(exponential(scale(time / principal[0], momentum)), q)
    if axis >= 0:
        across = principal[(axis + 1) % 3]
        own = back(matrix(q), momentum)[axis] * (1 / principal[axis] - 1 / across)
        twist = (own * time if axis == 0 else 0.0, own * time if axis == 1 else 0.0, own * time if axis == 2 else 0.0)
        return product(exponential(scale(time / across, momentum)), product(q, exponential(twist)))
    slowest = min(principal[0], principal[1], principal[2])
    parts = max(1, math.ceil(length(momentum) / slowest * time / TURN))
    for _ in range(parts):
        q = _fourth_order(principal, q, momentum, time / parts)
    return q


@compiled
def _fourth_order(principal: Vector, q: Quaternion, momentum: Vector, h: float) -> Quaternion:
    first = spin_of(principal, q, momentum)
    half = product(exponential(scale(h / 2, first)), q)
    second = spin_of(principal, half, momentum)
    third = spin_of(principal, product(exponential(scale(h / 2, second)), q), momentum)
    last = product(exponential(scale(h, plus(third, -0.5, first))), half)
    fourth = spin_of(principal, last, momentum)
    middle = plus(scale(2.0, second), 2.0, third)
    early, late = plus(plus(middle, 3.0, first), -1.0, fourth), plus(plus(middle, -1.0, first), 3.0, fourth)
    return product(exponential(scale(h / 12, late)), product(exponential(scale(h / 12, early)), q))
