"""Non-penetration of all bodies at once (documents, rule R4), and how what it adds to the energy is paid.

The displacements are the least, weighed by mass, that leave no overlap: the same problem as that of the pushes, with
gaps in place of speeds. Displacements along movable pairs alone cost nothing, as their common centre stays; a lift off
a static body adds m a d. Bodies that touch one another pay for it together out of their approach: their velocities go
so far towards those of a wholly inelastic contact as that loses what the lift added. For one body on a floor that is
the speed it had when it touched (`penetration.touching_speed`). What they cannot pay waits as their debt.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.compiled import compiled, inlined, merged
from impactbench.reference.nearby import Rooms, all_listed, look
from impactbench.reference.particles import Bodies, Indices, Pairs
from impactbench.reference.progress import Progress
from impactbench.reference.pushes import Holds, hold_all
from impactbench.reference.responses import exchange, reduced, relative
from impactbench.scenarios.trajectory import Floats

TIMES = 20
"""Solutions in a row at most: one for boxes unless they meet others, a few for spheres, whose normals turn."""


@merged
def project(
    bodies: Bodies, pairs: Pairs, rooms: Rooms, progress: Progress, gravity: Floats, touch: float, still: float
) -> bool:
    """Move overlapping bodies apart until none is deeper than `touch`/2 [m], and let them pay. still [m/s]: none.
    `parted` says how far each pair was pushed apart. Returns False, to go on from there, if a new list is wanted.

    A heap that needs more than `TIMES` keeps its rest of overlap for the next step.
    """
    while True:
        if not all_listed(bodies.position, rooms, progress, touch):
            return False
        if progress.stage[1] == TIMES:
            break
        deepest = look(bodies, pairs, touch)
        if deepest <= touch / 2:
            break
        if not all_listed(bodies.position, rooms, progress, 4 * deepest):
            return False
        look(bodies, pairs, 4 * deepest)
        separate(bodies, pairs, np.nonzero(pairs.gap < 4 * deepest)[0], gravity, touch / 16)
        progress.stage[1] += 1
    if progress.stage[1] > 0:
        pay(bodies, pairs, np.nonzero(pairs.gap <= touch)[0], still)
    progress.stage[1] = 0
    return True


@compiled
def follow(bodies: Bodies, pairs: Pairs, step: float) -> None:
    """Velocities from positions (documents, rule R4): the speed at which projection moved each pair apart within `step`
    [s], off its approach.

    Never more than the approach, so it takes energy and adds none; the impact that follows finds less to return.
    """
    for p in range(len(pairs.parted)):
        if pairs.parted[p] > 0:
            n, approach = pairs.normal[p], max(0.0, -relative(bodies, pairs, p)[0])
            blow = min(approach, pairs.parted[p] / step) * reduced(bodies, pairs, p)
            exchange(bodies, pairs, p, blow * n[0], blow * n[1], blow * n[2])


@compiled
def separate(bodies: Bodies, pairs: Pairs, near: Indices, gravity: Floats, tolerance: float) -> None:
    """The least displacements that leave no overlap among the pairs `near`, which were just looked at; bodies note what
    theirs cost [J].
    """
    first, second = pairs.first[near], pairs.second[near]
    mass = 1 / (bodies.inverse_mass[first] + bodies.inverse_mass[second])
    holds = Holds(first, second, pairs.normal[near], np.zeros(len(near)), mass, pairs.gap[near])
    way = np.zeros_like(bodies.position)
    hold_all(way, bodies.inverse_mass, holds, tolerance)
    pairs.parted[near] += holds.push / mass
    for i in range(len(way)):
        if bodies.inverse_mass[i] > 0:
            for k in range(3):
                bodies.position[i, k] += way[i, k]
                bodies.debt[i] -= gravity[k] * way[i, k] / bodies.inverse_mass[i]


@compiled
def pay(bodies: Bodies, pairs: Pairs, active: Indices, still: float) -> None:
    """Take the debts of bodies that touch one another from the energy of their approach."""
    count, v = len(bodies.debt), bodies.velocity
    first, second = pairs.first[active], pairs.second[active]
    mass = 1 / (bodies.inverse_mass[first] + bodies.inverse_mass[second])
    zero = np.zeros(len(active))
    change = v.copy()
    hold_all(change, bodies.inverse_mass, Holds(first, second, pairs.normal[active], zero, mass, zero.copy()), still)
    change -= v
    group = join(first, second, bodies.inverse_mass)
    cost, slope, bend, weight = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(count):
        if bodies.inverse_mass[i] > 0:
            m, g = 1 / bodies.inverse_mass[i], group[i]
            cost[g] += bodies.debt[i]
            slope[g] += m * (v[i, 0] * change[i, 0] + v[i, 1] * change[i, 1] + v[i, 2] * change[i, 2])
            bend[g] += m / 2 * (change[i, 0] ** 2 + change[i, 1] ** 2 + change[i, 2] ** 2)
            weight[g] += m
    for i in range(count):
        if bodies.inverse_mass[i] > 0:
            g = group[i]
            part = share(cost[g], slope[g], bend[g])
            left = max(0.0, cost[g] + part * (slope[g] + part * bend[g]))
            bodies.debt[i] = left / bodies.inverse_mass[i] / weight[g]
            for k in range(3):
                v[i, k] += part * change[i, k]


@inlined
def share(cost: float, slope: float, bend: float) -> float:
    """The part x <= 1 of the change of velocities that loses `cost` [J]: cost + slope x + bend x^2 = 0; 1 if none
    does.
    """
    within = slope * slope - 4 * bend * cost
    if within < 0:
        return 1.0
    below = math.sqrt(within) - slope
    return min(1.0, 2 * cost / below) if below > 0 else 0.0


@compiled
def join(first: Indices, second: Indices, inverse_mass: Floats) -> Indices:
    """A number for each body, shared by the movable ones that touch one another, directly or through others."""
    group = np.arange(len(inverse_mass))
    for c in range(len(first)):
        if inverse_mass[first[c]] > 0 and inverse_mass[second[c]] > 0:
            a, b = root(group, first[c]), root(group, second[c])
            group[max(a, b)] = min(a, b)
    for i in range(len(group)):
        group[i] = root(group, i)
    return group


@inlined
def root(group: Indices, i: int) -> int:
    """The lowest number joined to body i so far."""
    while group[i] != i:
        group[i] = group[group[i]]
        i = group[i]
    return i
