"""Contacts of rigid bodies that push, and those of them that hold without sliding, solved as the equations they are:
conjugate gradients scaled by the contacts' masses, started from the impulses so far.

Each way ends where a push would turn into a pull or a rub would leave its cone: the sweeps of `rigid_contact_solve`
then let contacts in and out. What slides keeps its rub meanwhile.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Flags
from impactbench.reference.rigid_touches import Touches, give, velocity_at
from impactbench.reference.solids import Solids
from impactbench.reference.triples import dot, plus, put, row, scale
from impactbench.scenarios.records import Vector
from impactbench.scenarios.trajectory import Floats

WITHIN = 1 - 1e-9
"""A rub within this share of its cone holds."""


@compiled
def balance(
    solids: Solids,
    velocity: Floats,
    spin: Floats,
    touches: Touches,
    closing: Floats,
    rubbing: bool,
    tolerance: float,
) -> None:
    """Bring u . n to -closing where contacts push, and the sliding to 0 where they hold, to `tolerance` [m/s]."""
    count = len(touches.push)
    pushes, holds = touches.push > 0.0, np.zeros(count, dtype=np.bool_)
    for c in range(count):
        limit, rub = WITHIN * touches.friction[c] * touches.push[c], row(touches.rub, c)
        holds[c] = rubbing and pushes[c] and dot(rub, rub) < limit * limit
    left = 10 * count + 20
    while left > 0:
        c, left = descend(solids, velocity, spin, touches, closing, pushes, holds, tolerance, left)
        if c < 0:
            return
        if holds[c] and touches.push[c] > 0:
            holds[c] = False
        else:
            pushes[c] = holds[c] = False


@compiled
def descend(
    solids: Solids,
    velocity: Floats,
    spin: Floats,
    touches: Touches,
    closing: Floats,
    pushes: Flags,
    holds: Flags,
    tolerance: float,
    ways: int,
) -> tuple[int, int]:
    """Conjugate gradients along at most so many ways; returns the contact that stops them, whose push has become 0 or
    whose rub is on its cone, or -1 if none does, and how many ways are left.
    """
    count = len(touches.push)
    lack, along = np.zeros((count, 3)), np.zeros((count, 3))
    change, turn = np.zeros_like(velocity), np.zeros_like(spin)
    size = 0.0
    for c in range(count):
        if pushes[c]:
            u = plus(velocity_at(velocity, spin, touches, c), closing[c], row(touches.normal, c))
            put(lack, c, scale(-1.0, heeded(touches, c, u, holds[c])))
            put(along, c, weighed(touches, c, row(lack, c)))
            size += dot(row(lack, c), row(along, c))
    for left in range(ways - 1, -1, -1):
        change[:] = 0.0
        turn[:] = 0.0
        for c in range(count):
            if pushes[c]:
                give(solids, change, turn, touches, c, row(along, c))
        slope, most, stop = 0.0, math.inf, -1
        for c in range(count):
            if pushes[c]:
                slope += dot(row(along, c), velocity_at(change, turn, touches, c))
                room = way_out(touches, c, row(along, c), holds[c])
                if room < most:
                    most, stop = room, c
        # Where contacts repeat one another (two corners of a box on a floor, and friction), some ways push nothing.
        if not slope > 0.0:
            return -1, left
        step, held = min(size / slope, most), touches.push[stop]
        velocity += step * change
        spin += step * turn
        worst, before, size = advance(touches, change, turn, lack, along, pushes, holds, step), size, 0.0
        if step == most:
            if touches.push[stop] <= 1e-12 * held:
                touches.push[stop] = 0.0
            return stop, left
        if worst <= tolerance:
            return -1, left
        for c in range(count):
            size += dot(row(lack, c), weighed(touches, c, row(lack, c)))
        for c in range(count):
            put(along, c, plus(weighed(touches, c, row(lack, c)), size / before, row(along, c)))
    return -1, 0


@compiled
def advance(
    touches: Touches,
    change: Floats,
    turn: Floats,
    lack: Floats,
    along: Floats,
    pushes: Flags,
    holds: Flags,
    step: float,
) -> float:
    """Go `step` along: impulses, and what velocities still lack. Returns the largest lack [m/s]."""
    worst = 0.0
    for c in range(len(lack)):
        if pushes[c]:
            n, way = row(touches.normal, c), row(along, c)
            push = dot(way, n)
            touches.push[c] += step * push
            put(touches.rub, c, plus(row(touches.rub, c), step, plus(way, -push, n)))
            gained = heeded(touches, c, velocity_at(change, turn, touches, c), holds[c])
            put(lack, c, plus(row(lack, c), -step, gained))
            worst = max(worst, math.sqrt(dot(row(lack, c), row(lack, c))))
    return worst


@inlined
def heeded(touches: Touches, c: int, u: Vector, holds: bool) -> Vector:
    """The part of a velocity that contact c settles: all where it holds, else that along the normal."""
    n = row(touches.normal, c)
    return u if holds else scale(dot(u, n), n)


@inlined
def weighed(touches: Touches, c: int, u: Vector) -> Vector:
    """A velocity times the contact's mass along and across the normal: the guess at the impulse behind it."""
    n = row(touches.normal, c)
    along = dot(u, n)
    return plus(scale(touches.side_mass[c], u), (touches.mass[c] - touches.side_mass[c]) * along, n)


@inlined
def way_out(touches: Touches, c: int, along: Vector, holds: bool) -> float:
    """How far to go along until the push of contact c ends, or its rub reaches mu times the push."""
    n, rub = row(touches.normal, c), row(touches.rub, c)
    push = dot(along, n)
    end = -touches.push[c] / push if push < 0 else math.inf
    if not holds:
        return end
    mu, side = touches.friction[c], plus(along, -push, n)
    # |rub + x side|^2 = mu^2 (push_c + x push)^2, the smallest positive root.
    a = dot(side, side) - (mu * push) ** 2
    b = dot(rub, side) - mu * mu * touches.push[c] * push
    lack = dot(rub, rub) - (mu * touches.push[c]) ** 2
    within = b * b - a * lack
    if within < 0:
        return end
    below = b + math.copysign(math.sqrt(within), b)
    for root in (-below / a if a != 0 else math.inf, -lack / below if below != 0 else math.inf):
        if 0 < root < end:
            end = root
    return end
