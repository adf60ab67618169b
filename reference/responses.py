"""What the pairs in contact do to velocities: impacts, lasting contacts, friction. Compiled, on flat arrays.

The laws are those of `impact`, `newton`, `coulomb` and `viscous`, written for the relative velocity u = v_B - v_A so
that no array is made per pair; tests hold the two forms together.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Bodies, Indices, Pairs
from impactbench.reference.pushes import Holds, hold_all

BETWEEN = 25
"""Sweeps with friction from one solution of the pushes alone to the next."""


@inlined
def relative(bodies: Bodies, pairs: Pairs, p: int) -> tuple[float, float, float, float]:
    """u . n and the tangential part u_p = u - (u . n) n [m/s] of pair p."""
    v_a, v_b, n = bodies.velocity[pairs.first[p]], bodies.velocity[pairs.second[p]], pairs.normal[p]
    x, y, z = v_b[0] - v_a[0], v_b[1] - v_a[1], v_b[2] - v_a[2]
    along = x * n[0] + y * n[1] + z * n[2]
    return along, x - along * n[0], y - along * n[1], z - along * n[2]


@inlined
def reduced(bodies: Bodies, pairs: Pairs, p: int) -> float:
    """mu_r [kg] of pair p; the movable's mass if the other is static."""
    inverse: float = bodies.inverse_mass[pairs.first[p]] + bodies.inverse_mass[pairs.second[p]]
    return 1 / inverse


@inlined
def exchange(bodies: Bodies, pairs: Pairs, p: int, x: float, y: float, z: float) -> None:
    """Give the impulse (x, y, z) [N s] to the second body and its opposite to the first (documents, rule R6)."""
    a, b = pairs.first[p], pairs.second[p]
    w_a, w_b = bodies.inverse_mass[a], bodies.inverse_mass[b]
    v_a, v_b = bodies.velocity[a], bodies.velocity[b]
    v_a[0] -= w_a * x
    v_a[1] -= w_a * y
    v_a[2] -= w_a * z
    v_b[0] += w_b * x
    v_b[1] += w_b * y
    v_b[2] += w_b * z


@inlined
def strike(bodies: Bodies, pairs: Pairs, p: int, doc: bool) -> None:
    """One impact. `doc`: u' = b (u - 2 (u . n) n) (documents, rule R9); else Newton on the normal, Coulomb in the
    plane.
    """
    along, x, y, z = relative(bodies, pairs, p)
    b, n, mass = pairs.bounciness[p], pairs.normal[p], reduced(bodies, pairs, p)
    normal_change = -(1 + b) * along
    plane_change = -(1 - b)
    if not doc:
        sliding = math.sqrt(x * x + y * y + z * z)
        plane_change = 0.0 if sliding == 0 else -min(1.0, pairs.friction[p] * normal_change / sliding)
    exchange(
        bodies,
        pairs,
        p,
        mass * (normal_change * n[0] + plane_change * x),
        mass * (normal_change * n[1] + plane_change * y),
        mass * (normal_change * n[2] + plane_change * z),
    )


@compiled
def resolve_impacts(bodies: Bodies, pairs: Pairs, active: Indices, doc: bool, sweeps: int) -> None:
    """Impacts of this instant, one pair after the other in sweeps, until none approaches faster than `slow`.

    A lasting contact that was already closing fast stays lasting; one set closing by an impact of this instant is an
    impact too, which hands a blow on through a row of balls. What still closes after `sweeps` (a train of ever weaker
    blows) is left to `hold`.
    """
    for p in active:
        pairs.touching[p] = not (pairs.touched[p] and relative(bodies, pairs, p)[0] < -pairs.slow[p])
    for _ in range(sweeps):
        struck = False
        for p in active:
            if pairs.touching[p] and relative(bodies, pairs, p)[0] < -pairs.slow[p]:
                strike(bodies, pairs, p, doc)
                struck = True
        if not struck:
            break
    for p in active:
        pairs.touching[p] = True


@compiled
def hold(bodies: Bodies, pairs: Pairs, active: Indices, rubbing: bool, tolerance: float, sweeps: int) -> float:
    """Inelastic along n for all contacts at once: sequential impulses with their sums kept at or above 0, started
    from `push`.

    With `rubbing`, lasting contacts also get Coulomb friction within mu times their own sum. Ends once no sweep
    changes a velocity by more than `tolerance` [m/s], or after `sweeps`; returns the last change [m/s]. `pushes` solves
    the normal part of tall columns and unlike masses first and every `BETWEEN` sweeps; without friction, that is all.
    """
    if len(active) == 0:
        return 0.0
    for p in active:
        n, push = pairs.normal[p], pairs.push[p]
        exchange(bodies, pairs, p, push * n[0], push * n[1], push * n[2])
        pairs.rub[p] = 0.0
    if not (rubbing and pairs.friction[active].any()):
        return press_all(bodies, pairs, active, tolerance)
    worst = 0.0
    for sweep in range(sweeps):
        if sweep % BETWEEN == 0:
            press_all(bodies, pairs, active, tolerance)
        worst = 0.0
        for i in range(len(active)):
            # Up and down in turn: a blow crosses a column either way in one sweep.
            p = active[i] if sweep % 2 == 0 else active[len(active) - 1 - i]
            worst = max(worst, press(bodies, pairs, p))
            if pairs.touched[p] and pairs.friction[p] > 0:
                worst = max(worst, grip(bodies, pairs, p))
        if worst <= tolerance:
            break
    return worst


@compiled
def press_all(bodies: Bodies, pairs: Pairs, active: Indices, tolerance: float) -> float:
    """Hold the contacts `active` without friction. Returns the last change of velocity [m/s]."""
    first, second = pairs.first[active], pairs.second[active]
    mass = 1 / (bodies.inverse_mass[first] + bodies.inverse_mass[second])
    holds = Holds(first, second, pairs.normal[active], pairs.push[active], mass, np.zeros(len(active)))
    worst = hold_all(bodies.velocity, bodies.inverse_mass, holds, tolerance)
    pairs.push[active] = holds.push
    return worst


@inlined
def press(bodies: Bodies, pairs: Pairs, p: int) -> float:
    """Bring the normal part of u to 0 as far as a push, never a pull, can. Returns the change of velocity [m/s]."""
    along, _, _, _ = relative(bodies, pairs, p)
    mass, n = reduced(bodies, pairs, p), pairs.normal[p]
    total = max(0.0, pairs.push[p] - mass * along)
    more: float = total - pairs.push[p]
    pairs.push[p] = total
    exchange(bodies, pairs, p, more * n[0], more * n[1], more * n[2])
    return abs(more) / mass


@inlined
def grip(bodies: Bodies, pairs: Pairs, p: int) -> float:
    """Coulomb friction: stop the sliding with an impulse of at most mu times the push. Returns the change of velocity
    [m/s].
    """
    _, x, y, z = relative(bodies, pairs, p)
    mass, total = reduced(bodies, pairs, p), pairs.rub[p]
    x, y, z = total[0] - mass * x, total[1] - mass * y, total[2] - mass * z
    size, limit = math.sqrt(x * x + y * y + z * z), float(pairs.friction[p] * pairs.push[p])
    if size > limit:
        x, y, z = x * limit / size, y * limit / size, z * limit / size
    d_x, d_y, d_z = x - total[0], y - total[1], z - total[2]
    total[0], total[1], total[2] = x, y, z
    exchange(bodies, pairs, p, d_x, d_y, d_z)
    return math.sqrt(d_x * d_x + d_y * d_y + d_z * d_z) / mass


@compiled
def damp(bodies: Bodies, pairs: Pairs, active: Indices, step: float, tolerance: float) -> None:
    """Viscous friction of the lasting contacts: u_p' = u_p exp(-c h/mu_r) (documents, rule R5), momentum conserved."""
    for p in active:
        along, x, y, z = relative(bodies, pairs, p)
        if pairs.viscosity[p] > 0 and pairs.touched[p] and along <= tolerance:
            mass = reduced(bodies, pairs, p)
            lost = mass * math.expm1(-pairs.viscosity[p] * step / mass)
            exchange(bodies, pairs, p, lost * x, lost * y, lost * z)
