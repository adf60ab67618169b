"""Lasting contacts held all at once: pushes p >= 0 along the normals so that no contact approaches, and only contacts
that would approach push (the complementarity problem of frictionless inelastic contact; Baraff 1994).

Sequential impulses carry a blow on by one contact a sweep up and one down, and need some (height)^2 sweeps to balance a
column, or the ratio of masses to hold a heavy body on a light one. So after a few sweeps the contacts that push are
solved as the equations they are, by conjugate gradients scaled by the reduced masses; sweeps then let contacts in and
out, in turn until nothing changes (Silcowitz-Hansen, Niebe & Erleben 2010 speed up sweeps in a like manner).

Pushes never pull and end at speeds that do not approach, so none of this adds energy. All arrays are of the contacts
that touch now, shapes [m] and [m, 3]; bodies by number in `first` and `second`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats

SWEEPS, ROUNDS = 8, 60
"""Sweeps, up and down in turn, before each of so many rounds of conjugate gradients."""
ROUND = 4 * 2.0**-53
"""Relative round-off of a push: a light body under a heavy one gets pushes far above its weight from both sides."""


class Holds(NamedTuple):
    first: Indices
    second: Indices
    normal: Floats
    push: Floats
    mass: Floats
    """Reduced mass [kg]."""
    ahead: Floats
    """What is added to the closing: 0 for velocities; where displacements are sought, the gap [m] they start from."""


@compiled
def hold_all(velocity: Floats, inverse_mass: Floats, holds: Holds, tolerance: float) -> float:
    """Change velocities [m/s] [n, 3] and pushes [N s] until no sweep changes a speed by more than `tolerance` [m/s].
    Returns the last change.
    """
    first, second, normal, push, mass, ahead = holds
    worst = 0.0
    for _ in range(ROUNDS):
        for turn in range(SWEEPS):
            worst = sweep(velocity, inverse_mass, first, second, normal, push, mass, ahead, turn % 2 == 0)
            if worst <= tolerance:
                return worst
        balance(velocity, inverse_mass, first, second, normal, push, mass, ahead, tolerance / 4)
    return worst


@compiled
def sweep(
    velocity: Floats,
    inverse_mass: Floats,
    first: Indices,
    second: Indices,
    normal: Floats,
    push: Floats,
    mass: Floats,
    ahead: Floats,
    upwards: bool,
) -> float:
    """Bring each contact's approach to 0 in turn, as far as a push, never a pull, can. Returns the largest change,
    less what the push cannot do without: its own last digits.
    """
    worst, count = 0.0, len(push)
    for turn in range(count):
        c = turn if upwards else count - 1 - turn
        total = max(0.0, push[c] - mass[c] * (ahead[c] + closing(velocity, first[c], second[c], normal, c)))
        more = total - push[c]
        push[c] = total
        give(velocity, inverse_mass, first[c], second[c], normal, c, more)
        worst = max(worst, (abs(more) - ROUND * total) / mass[c])
    return worst


@compiled
def balance(
    velocity: Floats,
    inverse_mass: Floats,
    first: Indices,
    second: Indices,
    normal: Floats,
    push: Floats,
    mass: Floats,
    ahead: Floats,
    tolerance: float,
) -> None:
    """Conjugate gradients on the contacts that push. Ends where a push would turn into a pull: that contact lets go."""
    change = np.zeros_like(velocity)  # what a unit step along the search direction does to velocities
    free, pushed = push > 0.0, bodies_of(first, second, len(velocity))
    lack, along = np.zeros(len(push)), np.zeros(len(push))
    size = 0.0
    for c in range(len(push)):
        if free[c]:
            lack[c] = -ahead[c] - closing(velocity, first[c], second[c], normal, c)
            along[c] = mass[c] * lack[c]
            size += lack[c] * along[c]
    for _ in range(10 * len(push) + 20):
        for i in pushed:
            change[i, 0] = change[i, 1] = change[i, 2] = 0.0
        for c in range(len(push)):
            if free[c]:
                give(change, inverse_mass, first[c], second[c], normal, c, along[c])
        slope, most, stop = 0.0, math.inf, -1
        for c in range(len(push)):
            if free[c]:
                slope += along[c] * closing(change, first[c], second[c], normal, c)
                if along[c] < 0 and -push[c] / along[c] < most:
                    most, stop = -push[c] / along[c], c
        # Where contacts repeat one another (a brick on two), some directions push nothing.
        if not slope > 0.0:
            return
        length = min(size / slope, most)
        worst, before, size = 0.0, size, 0.0
        for c in range(len(push)):
            if free[c]:
                push[c] += length * along[c]
                lack[c] -= length * closing(change, first[c], second[c], normal, c)
                worst = max(worst, abs(lack[c]))
                size += lack[c] * mass[c] * lack[c]
        for i in pushed:
            for k in range(3):
                velocity[i, k] += length * change[i, k]
        if length == most:
            push[stop] = 0.0
            return
        if worst <= tolerance:
            return
        for c in range(len(push)):
            along[c] = mass[c] * lack[c] + size / before * along[c]


@compiled
def bodies_of(first: Indices, second: Indices, count: int) -> Indices:
    """Numbers of the bodies, of `count`, that are in any contact."""
    held = np.zeros(count, dtype=np.bool_)
    for c in range(len(first)):
        held[first[c]] = held[second[c]] = True
    return np.nonzero(held)[0]


@inlined
def closing(velocity: Floats, a: int, b: int, normal: Floats, c: int) -> float:
    """u . n [m/s] of contact c, negative where it approaches."""
    along: float = (velocity[b, 0] - velocity[a, 0]) * normal[c, 0]
    along += (velocity[b, 1] - velocity[a, 1]) * normal[c, 1]
    along += (velocity[b, 2] - velocity[a, 2]) * normal[c, 2]
    return along


@inlined
def give(velocity: Floats, inverse_mass: Floats, a: int, b: int, normal: Floats, c: int, push: float) -> None:
    """Give `push` [N s] along the normal to the second body and its opposite to the first (documents, rule R6)."""
    for k in range(3):
        velocity[a, k] -= inverse_mass[a] * push * normal[c, k]
        velocity[b, k] += inverse_mass[b] * push * normal[c, k]
