"""What lasting contacts of rigid bodies do to velocities: inelastic along n, by sequential impulses whose sums stay at
or above 0; friction is Coulomb's within mu times that sum (law `nc`), or viscous (R5).

Sweeps alone need some (height)^2 turns to balance a stack, so that between them the contacts that push and hold are
solved as the equations they are (`rigid_balance`), as in the particles' `pushes`.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.rigid_balance import balance
from impactbench.reference.rigid_touches import Touches, give, inverse_mass, parting, velocity_at
from impactbench.reference.solids import Solids
from impactbench.reference.triples import dot, length, plus, put, row, scale, subtract
from impactbench.scenarios.trajectory import Floats

SWEEPS, ROUNDS = 10, 100
"""Sweeps, up and down in turn, before each of so many rounds of conjugate gradients."""
ROUND = 4 * 2.0**-53
"""Relative round-off of a push, as in `pushes`."""


@compiled
def hold(
    solids: Solids, velocity: Floats, spin: Floats, touches: Touches, closing: Floats, rubbing: bool, tolerance: float
) -> float:
    """All lasting contacts at once, from their `push` and `rub` as first guess: u . n >= -closing [m/s] in the end.

    Returns the last change of velocity [m/s].
    """
    count = len(touches.push)
    for c in range(count):
        give(solids, velocity, spin, touches, c, plus(row(touches.rub, c), touches.push[c], row(touches.normal, c)))
    worst = 0.0
    for _ in range(ROUNDS):
        for turn in range(SWEEPS):
            worst = 0.0
            for i in range(count):
                c = i if turn % 2 == 0 else count - 1 - i
                worst = max(worst, press(solids, velocity, spin, touches, c, closing[c]))
                if rubbing and touches.friction[c] > 0:
                    worst = max(worst, grip(solids, velocity, spin, touches, c))
            if worst <= tolerance:
                return worst
        balance(solids, velocity, spin, touches, closing, rubbing, tolerance / 32)
    return worst


@inlined
def press(solids: Solids, velocity: Floats, spin: Floats, touches: Touches, c: int, closing: float) -> float:
    """Bring u . n to no less than `-closing` [m/s], by a push only. Returns the change of velocity [m/s]."""
    mass = touches.mass[c]
    total = max(0.0, touches.push[c] - mass * (parting(velocity, spin, touches, c) + closing))
    more = total - touches.push[c]
    touches.push[c] = total
    give(solids, velocity, spin, touches, c, scale(more, row(touches.normal, c)))
    change: float = (abs(more) - ROUND * total) / mass
    return change


@inlined
def grip(solids: Solids, velocity: Floats, spin: Floats, touches: Touches, c: int) -> float:
    """Coulomb: stop the sliding with at most mu times the push. Returns the change of velocity [m/s]."""
    u, n = velocity_at(velocity, spin, touches, c), row(touches.normal, c)
    sliding = plus(u, -dot(u, n), n)
    speed = length(sliding)
    if speed == 0:
        return 0.0
    inverse = inverse_mass(solids, touches, c, scale(1 / speed, sliding))
    before = row(touches.rub, c)
    total = plus(before, -1 / inverse, sliding)
    size, limit = length(total), touches.friction[c] * touches.push[c]
    if size > limit:
        total = scale(limit / size, total)
    more = subtract(total, before)
    put(touches.rub, c, total)
    give(solids, velocity, spin, touches, c, more)
    change: float = (length(more) - ROUND * touches.push[c]) * inverse
    return change


@compiled
def damp(solids: Solids, touches: Touches, c: int, step: float) -> None:
    """u_t falls by exp(-c k h), k = t . K t along the sliding (documents, rule R5: c/m, for particles)."""
    u, n = velocity_at(solids.velocity, solids.spin, touches, c), row(touches.normal, c)
    sliding = plus(u, -dot(u, n), n)
    speed = length(sliding)
    if speed > 0:
        inverse = inverse_mass(solids, touches, c, scale(1 / speed, sliding))
        lost = math.expm1(-touches.viscosity[c] * inverse * step) / inverse
        give(solids, solids.velocity, solids.spin, touches, c, scale(lost, sliding))
