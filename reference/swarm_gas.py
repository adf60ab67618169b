"""The light path of the fast runner: elastic spheres without friction or gravity, under either law (they agree here).

A step, as the stepped runner's (documents, rules R3, R4 and R7): impacts of the pairs that touch and approach, move,
detect, project. Without gravity no contact can last, so nothing else is needed. Impacts and projections of one instant
are taken one after the other in the order of the lists, in sweeps, until none is left: bodies in separate contacts do
not depend on that order, bodies in a chain of contacts do.

Kernels get the few arrays they use, not the record of all: every array of a record passed on costs a count of its
references, and at some 10 ns a body such things show.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import Flags, Indices
from impactbench.reference.swarm import (
    BLOCK,
    BUILDS,
    FASTEST,
    IMPACTS,
    LOOKED,
    NEAR,
    NEAR_SIDES,
    PAIRS,
    SIDES,
    SKIN,
    STIRRED,
    TRAVEL,
    Dim,
    Numbers,
    Swarm,
)
from impactbench.reference.swarm_grid import build, side_gap
from impactbench.reference.swarm_motion import add, note, speed_along, way
from impactbench.scenarios.trajectory import Floats

SWEEPS = 200
MARGIN = 2.0
"""Pairs closer than this many times the fastest body's step can overlap in the next sweep or the next step."""


@compiled
def run(swarm: Swarm, steps: int) -> int:
    """Advance by `steps`. Returns how many were done: fewer where the lists need more room (see `build`)."""
    dim, count, gauge, step, touch = swarm.dim, swarm.tally, swarm.gauge, swarm.step, swarm.touch
    place, velocity, mass, origin = swarm.now.place, swarm.now.velocity, swarm.now.inverse_mass, swarm.built.place
    pairs, near, sides, near_sides = swarm.lists.pairs, swarm.lists.near, swarm.lists.sides, swarm.lists.near_sides
    kind, where, size, until = swarm.statics.kind, swarm.statics.place, swarm.statics.size, swarm.lists.until
    stirred, moves = swarm.lists.stirred, swarm.moves
    for done in range(steps):
        for _ in range(SWEEPS):
            struck = strike_sides(dim, place, velocity, kind, where, size, near_sides, count, touch, swarm.still)
            struck += strike_pairs(dim, place, velocity, mass, stirred, count, gauge, touch, swarm.still)
            count[IMPACTS] += struck
            if struck == 0:
                break
        if not gauge[TRAVEL] + step * gauge[FASTEST] <= gauge[SKIN] / 2:
            if not build(swarm):
                return done
            gauge[TRAVEL] = 0.0
            count[BUILDS] += 1
        gauge[TRAVEL] += step * gauge[FASTEST]
        margin = touch + MARGIN * step * gauge[FASTEST]
        move_and_detect(dim, place, velocity, step, pairs, until, near, count, margin)
        detect_sides(dim, place, kind, where, size, sides, near_sides, count, margin)
        for sweep in range(SWEEPS):
            moved = lift_sides(dim, place, velocity, origin, kind, where, size, near_sides, count, gauge, touch, sweep)
            if sweep == 0:
                list_stirred(dim, place, near, count, stirred, moves, touch)
            moved += part_pairs(dim, place, velocity, origin, mass, stirred, count, gauge, touch, sweep)
            if moved == 0:
                break
    return steps


@compiled
def start(swarm: Swarm) -> bool:
    """Build the lists and find who touches at t = 0. False where the lists need more room."""
    if not build(swarm):
        return False
    swarm.gauge[TRAVEL] = 0.0
    swarm.tally[BUILDS] += 1
    margin = swarm.touch + MARGIN * swarm.step * swarm.gauge[FASTEST]
    lists, statics, place = swarm.lists, swarm.statics, swarm.now.place
    swarm.tally[NEAR] = list_near(swarm.dim, place, lists.pairs, 0, swarm.tally[PAIRS], lists.near, 0, margin)
    swarm.tally[LOOKED] += swarm.tally[PAIRS]
    list_stirred(swarm.dim, place, lists.near, swarm.tally, lists.stirred, swarm.moves, swarm.touch)
    kind, where, size = statics.kind, statics.place, statics.size
    detect_sides(swarm.dim, place, kind, where, size, lists.sides, lists.near_sides, swarm.tally, margin)
    return True


@compiled
def move_and_detect(
    dim: Dim,
    place: Floats,
    velocity: Floats,
    step: float,
    pairs: Numbers,
    until: Numbers,
    near: Numbers,
    count: Indices,
    margin: float,
) -> None:
    """Move all bodies and list the pairs that are near then.

    Pairs come in the order of their first bodies, and their second ones are not far: bodies are moved just before the
    `BLOCK` of pairs that needs them, so that of a crowd larger than the cache each is fetched once, not twice.
    """
    moved, found = np.int64(0), 0
    for begin in range(0, count[PAIRS], BLOCK):
        needed = np.int64(until[begin // BLOCK]) * (len(dim) + 1)
        for k in range(moved, needed):
            place[k] += step * velocity[k]
        moved = needed
        found = list_near(dim, place, pairs, begin, min(begin + BLOCK, count[PAIRS]), near, found, margin)
    for k in range(moved, len(place)):
        place[k] += step * velocity[k]
    count[NEAR] = found
    count[LOOKED] += count[PAIRS]


@compiled
def list_near(
    dim: Dim, place: Floats, pairs: Numbers, begin: int, end: int, near: Numbers, count: int, margin: float
) -> int:
    """Add the pairs `begin` to `end` that are near to the `count` in `near`; returns how many there are now. Without a
    branch: a pair is always written, and counted where it is one.
    """
    d = len(dim)
    stride, last, found, one = np.uint64(d + 1), np.uint64(d), np.uint64(2 * count), np.uint64(1)
    for p in range(np.uint64(begin), np.uint64(end)):
        i, j = pairs[np.uint64(2) * np.uint64(p)], pairs[np.uint64(2) * np.uint64(p) + one]
        a, b = np.uint64(i) * stride, np.uint64(j) * stride
        square = 0.0
        for k in range(d):
            off = place[a + np.uint64(k)] - place[b + np.uint64(k)]
            square += off * off
        reach = place[a + last] + place[b + last] + margin
        near[found], near[found + one] = i, j
        found += np.uint64(2) * np.uint64(square < reach * reach)
    return int(found) // 2


@compiled
def detect_sides(
    dim: Dim,
    place: Floats,
    kind: Indices,
    where: Floats,
    size: Floats,
    sides: Numbers,
    near_sides: Numbers,
    count: Indices,
    margin: float,
) -> None:
    """The same for bodies and statics."""
    found = 0
    for p in range(count[SIDES]):
        i, s = sides[2 * p], sides[2 * p + 1]
        if side_gap(dim, place, kind, where, size, i, s)[0] <= margin:
            near_sides[2 * found], near_sides[2 * found + 1] = i, s
            found += 1
    count[NEAR_SIDES] = found


@compiled
def strike_pairs(
    dim: Dim,
    place: Floats,
    velocity: Floats,
    inverse_mass: Floats,
    stirred: Numbers,
    count: Indices,
    gauge: Floats,
    touch: float,
    still: float,
) -> int:
    """Impacts of the pairs that touch and approach: i_A = 2 mu_r (u . n) n (documents, rule R7). Returns how many."""
    d, struck = len(dim), 0
    for p in range(count[STIRRED]):
        i, j = stirred[2 * p], stirred[2 * p + 1]
        a, b = i * (d + 1), j * (d + 1)
        square, along = 0.0, 0.0
        for k in range(d):
            off = place[b + k] - place[a + k]
            square += off * off
            along += off * (velocity[b + k] - velocity[a + k])
        reach = place[a + d] + place[b + d] + touch
        if square > reach * reach or along >= -still * math.sqrt(square):
            continue
        push = -2 * along / square / (inverse_mass[i] + inverse_mass[j])
        speed_a, speed_b = 0.0, 0.0
        for k in range(d):
            off = place[b + k] - place[a + k]
            velocity[a + k] -= inverse_mass[i] * push * off
            velocity[b + k] += inverse_mass[j] * push * off
            speed_a += velocity[a + k] ** 2
            speed_b += velocity[b + k] ** 2
        gauge[FASTEST] = max(gauge[FASTEST], math.sqrt(max(speed_a, speed_b)))
        struck += 1
    return struck


@compiled
def strike_sides(
    dim: Dim,
    place: Floats,
    velocity: Floats,
    kind: Indices,
    where: Floats,
    size: Floats,
    near_sides: Numbers,
    count: Indices,
    touch: float,
    still: float,
) -> int:
    """One-way impacts: the normal component flips (documents, rule R13). Returns how many."""
    struck = 0
    for p in range(count[NEAR_SIDES]):
        i, s = near_sides[2 * p], near_sides[2 * p + 1]
        gap, x, y, z = side_gap(dim, place, kind, where, size, i, s)
        along = speed_along(dim, velocity, i, x, y, z)
        if gap <= touch and along < -still:
            add(dim, velocity, i, -2 * along * x, -2 * along * y, -2 * along * z)
            struck += 1
    return struck


@compiled
def list_stirred(
    dim: Dim, place: Floats, near: Numbers, count: Indices, stirred: Numbers, moves: Flags, touch: float
) -> None:
    """List the near pairs that touch, and those that share a body with one of them, directly or through others: all
    that projection and the next impacts can concern. The more bodies, the more sweeps the slowest chain takes, and only
    chains are swept.
    """
    d, found, grows = len(dim), 0, True
    for p in range(count[NEAR]):
        moves[near[2 * p]] = moves[near[2 * p + 1]] = False
    for p in range(count[NEAR]):
        i, j = near[2 * p], near[2 * p + 1]
        square = 0.0
        for k in range(d):
            square += (place[j * (d + 1) + k] - place[i * (d + 1) + k]) ** 2
        reach = place[i * (d + 1) + d] + place[j * (d + 1) + d] + touch
        touches = square <= reach * reach
        moves[i] |= touches
        moves[j] |= touches
    while grows:
        grows = False
        for p in range(count[NEAR]):
            i, j = near[2 * p], near[2 * p + 1]
            grows |= moves[i] != moves[j]
            moves[i] = moves[j] = moves[i] | moves[j]
    for p in range(count[NEAR]):
        stirred[2 * found], stirred[2 * found + 1] = near[2 * p], near[2 * p + 1]
        found += moves[near[2 * p]]
    count[STIRRED] = found


@compiled
def part_pairs(
    dim: Dim,
    place: Floats,
    velocity: Floats,
    origin: Floats,
    inverse_mass: Floats,
    stirred: Numbers,
    count: Indices,
    gauge: Floats,
    touch: float,
    sweep: int,
) -> int:
    """Take overlapping pairs apart: dx_A = -d n w_A/(w_A + w_B), w = 1/m (documents, rule R4). Returns how many.

    Concentric bodies leave along x. The first sweep keeps the deepest overlap and the largest closing speed of those
    that overlap.
    """
    d, moved = len(dim), 0
    for p in range(count[STIRRED]):
        i, j = stirred[2 * p], stirred[2 * p + 1]
        a, b = i * (d + 1), j * (d + 1)
        square, closing = 0.0, 0.0
        for k in range(d):
            square += (place[b + k] - place[a + k]) ** 2
        reach = place[a + d] + place[b + d]
        clear = reach - touch / 2
        if clear <= 0 or square >= clear * clear:
            continue
        distance = math.sqrt(square)
        share = (reach - distance) / (inverse_mass[i] + inverse_mass[j])
        for k in range(d):
            n = (place[b + k] - place[a + k]) / distance if distance > 0 else 1.0 if k == 0 else 0.0
            closing -= n * (velocity[b + k] - velocity[a + k])
            place[a + k] -= inverse_mass[i] * share * n
            place[b + k] += inverse_mass[j] * share * n
        note(gauge, reach - distance, closing, sweep)
        gauge[TRAVEL] = max(gauge[TRAVEL], way(dim, place, origin, i), way(dim, place, origin, j))
        moved += 1
    return moved


@compiled
def lift_sides(
    dim: Dim,
    place: Floats,
    velocity: Floats,
    origin: Floats,
    kind: Indices,
    where: Floats,
    size: Floats,
    near_sides: Numbers,
    count: Indices,
    gauge: Floats,
    touch: float,
    sweep: int,
) -> int:
    """Lift bodies out of statics, which alone do not move (documents, rule R4). Returns how many."""
    moved = 0
    for p in range(count[NEAR_SIDES]):
        i, s = near_sides[2 * p], near_sides[2 * p + 1]
        gap, x, y, z = side_gap(dim, place, kind, where, size, i, s)
        if gap < -touch / 2:
            add(dim, place, i, -gap * x, -gap * y, -gap * z)
            note(gauge, -gap, -speed_along(dim, velocity, i, x, y, z), sweep)
            gauge[TRAVEL] = max(gauge[TRAVEL], way(dim, place, origin, i))
            moved += 1
    return moved
