"""Non-penetration of rigid bodies (documents, rule R4): overlaps are taken away with the least displacement in the
metric of kinetic energy, turns included, and the approach pays for it.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.features import room
from impactbench.reference.rigid_motion import Steps
from impactbench.reference.rigid_touches import Couples, Memory, Touches, give, parting, touches_now
from impactbench.reference.solids import Solids, orient, orientation, refresh
from impactbench.reference.triples import apply, cross, exponential, plus, product, put, row, rows, scale

LIFTS = 100
"""Rounds through all contacts at most: what overlaps then is left to the next step."""


@compiled
def lift_all(solids: Solids, couples: Couples, memory: Memory, steps: Steps) -> None:
    """Lift one contact after the other until none overlaps."""
    found = room()
    for _ in range(LIFTS):
        touches = touches_now(solids, couples, memory, found, -steps.touch / 2, -steps.touch / 2)
        if len(touches.key) == 0:
            return
        for c in range(len(touches.key)):
            lift(solids, touches, c, steps)


@compiled
def lift(solids: Solids, touches: Touches, c: int, steps: Steps) -> None:
    """Move and turn both bodies by what an impulse that parts them by the overlap would; their approach pays for it.

    What the approach cannot pay stays as the body's debt until the next lift.
    """
    g = steps.gravity
    impulse = scale(-touches.gap[c] * touches.mass[c], row(touches.normal, c))
    work = g[0] * impulse[0] + g[1] * impulse[1] + g[2] * impulse[2]
    a, b = touches.first[c], touches.second[c]
    cost = 0.0
    if solids.lightness[a] > 0:
        cost += solids.debt[a] + work
        solids.debt[a] = 0.0
        shift(solids, a, row(touches.arm_a, c), scale(-1.0, impulse))
    if solids.lightness[b] > 0:
        cost += solids.debt[b] - work
        solids.debt[b] = 0.0
        shift(solids, b, row(touches.arm_b, c), impulse)
    if cost > 0:
        approach = max(0.0, -parting(solids.velocity, solids.spin, touches, c))
        touched = math.sqrt(max(0.0, approach**2 - 2 * cost / touches.mass[c]))
        blow = scale(touches.mass[c] * (approach - touched), row(touches.normal, c))
        give(solids, solids.velocity, solids.spin, touches, c, blow)
        payer = a if solids.lightness[b] == 0 else b
        solids.debt[payer] = max(0.0, cost - touches.mass[c] * (approach**2 - touched**2) / 2)


@inlined
def shift(solids: Solids, i: int, arm: tuple[float, float, float], impulse: tuple[float, float, float]) -> None:
    """The displacement and turn that go with an impulse [kg m]."""
    put(solids.position, i, plus(row(solids.position, i), solids.lightness[i], impulse))
    rotation = apply(rows(solids.ease, i), cross(arm, impulse))
    orient(solids, i, product(exponential(rotation), orientation(solids, i)))
    refresh(solids, i)
