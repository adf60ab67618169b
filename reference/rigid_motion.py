"""How rigid bodies move for a while, with the contacts of its beginning: gravity, friction, lasting contacts, the way.

Positions move by the mean of the velocities before and after the forces, and orientations by the mean angular momentum:
free flight and free rotation are exact but for `rigid_spin`'s substeps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.rigid_contact_solve import damp, hold
from impactbench.reference.rigid_spin import spin_of, turn
from impactbench.reference.rigid_touches import Memory, Touches, parting
from impactbench.reference.solids import SPACE, Solids, orient, orientation, refresh
from impactbench.reference.triples import apply, dot, exponential, length, plus, product, put, row, rows, scale, turned
from impactbench.scenarios.records import Vector
from impactbench.scenarios.trajectory import Floats

ROUND = 1e-3
"""Gaps of this share of a touch are round-off of positions: no contact closes them."""


class Steps(NamedTuple):
    """How to step: `step` [s], `gravity` [m/s^2], `carried` and `turning` 1 on the axes that carry motion and spin.

    touch [m]: gap up to which bodies touch; keep [m]: across which a lasting contact is kept; still [m/s]: a speed that
    counts as none.
    """

    step: float
    gravity: Floats
    carried: Floats
    turning: Floats
    doc: bool
    touch: float
    keep: float
    still: float


class Poses(NamedTuple):
    """A state to come back to; shapes [n, 3] and [n, 4]."""

    position: Floats
    velocity: Floats
    orientation: Floats
    spin: Floats


@compiled
def poses(solids: Solids) -> Poses:
    """A copy of the state."""
    return Poses(solids.position.copy(), solids.velocity.copy(), solids.orientation.copy(), solids.spin.copy())


@compiled
def put_back(solids: Solids, state: Poses) -> None:
    solids.position[:] = state.position
    solids.velocity[:] = state.velocity
    solids.orientation[:] = state.orientation
    solids.spin[:] = state.spin
    for i in range(len(solids.lightness)):
        if solids.lightness[i] > 0:
            refresh(solids, i)


@compiled
def move(solids: Solids, touches: Touches, guess: Memory, steps: Steps, time: float) -> tuple[Memory, float]:
    """Gravity, lasting contacts with friction, and the way of `time` [s]. `guess` at the contacts' forces; returns what
    they were, and what change of velocity [m/s] they still found at last.
    """
    velocity, spin = solids.velocity, solids.spin
    before, spun = velocity.copy(), spin.copy()
    speed = np.array([parting(velocity, spin, touches, c) for c in range(len(touches.key))])
    for c in range(len(touches.key)):
        touches.push[c] = time * guess.push[c]
        put(touches.rub, c, scale(time, row(guess.rub, c)))
    for i in range(len(solids.lightness)):
        if solids.lightness[i] > 0:
            velocity[i] += time * steps.gravity
    if steps.doc:
        for c in range(len(touches.key)):
            if touches.viscosity[c] > 0 and speed[c] <= 1e3 * steps.still:
                damp(solids, touches, c, time)
    # No overlap at the end of the way: a contact in flight may come back as fast as it left, and no push gains.
    closing = np.zeros(len(speed))
    for c in range(len(speed)):
        flight = speed[c] if abs(speed[c]) > 1e3 * steps.still else 0.0
        closing[c] = max(0.0, 2 * max(0.0, touches.gap[c] - ROUND * steps.touch) / time + flight)
    rest = hold(solids, velocity, spin, touches, closing, not steps.doc, steps.still)
    velocity *= steps.carried
    spin *= steps.turning
    for i in range(len(solids.lightness)):
        if solids.lightness[i] > 0:
            put(
                solids.position, i, plus(row(solids.position, i), time / 2, plus(row(before, i), 1.0, row(velocity, i)))
            )
            turn_on(solids, i, row(spun, i), time)
    return Memory(touches.key, touches.push / time, touches.rub / time), rest


@compiled
def recalled(touches: Touches, memory: Memory) -> Memory:
    """What these contacts pushed and rubbed the last time, 0 if there was none; rubs in today's plane."""
    count = len(touches.key)
    push, rub = np.zeros(count), np.zeros((count, 3))
    for c in range(count):
        if touches.known[c] >= 0:
            n, last = row(touches.normal, c), row(memory.rub, touches.known[c])
            push[c] = memory.push[touches.known[c]]
            put(rub, c, plus(last, -dot(last, n), n))
    return Memory(touches.key, push, rub)


@inlined
def turn_on(solids: Solids, i: int, before: Vector, time: float) -> None:
    """Turn body i by the mean of its spins, in a plane, or of its angular momenta before and now."""
    now = row(solids.spin, i)
    if solids.plane != SPACE:
        orient(solids, i, product(exponential(scale(time / 2, plus(before, 1.0, now))), orientation(solids, i)))
    else:
        principal = row(solids.principal, i)
        tensor = turned(rows(solids.axes, i), principal)
        first, last = apply(tensor, before), apply(tensor, now)
        mean = scale(0.5, plus(first, 1.0, last))
        if length(mean) > 0:
            orient(solids, i, turn(principal, orientation(solids, i), mean, time))
        if length(last) > 0:
            put(solids.spin, i, spin_of(principal, orientation(solids, i), last))
    refresh(solids, i)
