"""The contact points of an instant, and which pairs are near enough to have any.

Pairs are looked for once for many instants: all whose bounding balls come within a margin, which holds until a body has
moved by half of it (a neighbour list; Verlet 1967).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.features import NUMBERS, Features
from impactbench.reference.particles import Indices
from impactbench.reference.rigid_contacts import find
from impactbench.reference.solids import SPACE, Solids
from impactbench.reference.triples import apply, cross, dot, plus, put, row, rows, subtract, unit
from impactbench.scenarios.records import Vector
from impactbench.scenarios.trajectory import Floats


class Couples(NamedTuple):
    """The handled pairs (documents, rule R2), shape [p], and the list of those that are near."""

    first: Indices
    second: Indices
    friction: Floats
    viscosity: Floats
    near: Indices
    """Numbers of the near pairs, ascending; the first `listed[0]` of them."""
    listed: Indices
    margin: float
    """[m]"""
    seen: Floats
    """Positions [m], shape [n, 3], at which the list was made."""


class Touches(NamedTuple):
    """Contact points, shapes [m] and [m, 3]. Arms lead from each centre to the point; `push` and `rub` are what it has
    pushed and rubbed so far [N s].
    """

    key: Indices
    """`NUMBERS` times the pair's number, plus the feature's."""
    first: Indices
    second: Indices
    friction: Floats
    viscosity: Floats
    gap: Floats
    normal: Floats
    point: Floats
    arm_a: Floats
    arm_b: Floats
    mass: Floats
    """1/(n . K n) [kg]: what a push along the normal moves (documents, rule R14)."""
    side_mass: Floats
    """The same for rubbing, in the mean of all directions across the normal."""
    known: Indices
    """Its place in memory, -1 if it did not touch before."""
    push: Floats
    rub: Floats


class Memory(NamedTuple):
    """What lasts from one instant to the next: keys of the contacts, ascending by pair, and their mean forces [N]."""

    key: Indices
    push: Floats
    rub: Floats


@compiled
def look_around(solids: Solids, couples: Couples, force: bool) -> None:
    """Renew the list of near pairs where a body has moved by half the margin, or by `force`."""
    if not force:
        farthest = 0.0
        for i in range(len(solids.lightness)):
            if solids.lightness[i] > 0:
                way = subtract(row(solids.position, i), row(couples.seen, i))
                farthest = max(farthest, dot(way, way))
        if farthest <= (couples.margin / 2) ** 2:
            return
    count = 0
    for p in range(len(couples.first)):
        a, b = couples.first[p], couples.second[p]
        way = subtract(row(solids.position, a), row(solids.position, b))
        reach = solids.bound[a] + solids.bound[b] + couples.margin
        if not dot(way, way) > reach * reach:
            couples.near[count] = p
            count += 1
    couples.listed[0] = count
    couples.seen[:] = solids.position


@compiled
def touches_now(
    solids: Solids, couples: Couples, memory: Memory, found: Features, touch: float, keep: float
) -> Touches:
    """All points with a gap of at most `touch` [m], of contacts in memory at most `keep` [m]."""
    look_around(solids, couples, False)
    key, known, gap, place = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int64), np.zeros(64), np.zeros((64, 6))
    count, first = 0, 0
    for k in range(couples.listed[0]):
        p = couples.near[k]
        first = from_pair(memory, p, first)
        for f in range(find(solids, couples.first[p], couples.second[p], found)):
            here = p * NUMBERS + found.number[f]
            at = remembered(memory, here, first)
            if found.gap[f] <= (keep if at >= 0 else touch):
                if count == len(key):
                    key, known, gap, place = more_room(key, known, gap, place)
                key[count], known[count], gap[count] = here, at, found.gap[f]
                place[count, :3], place[count, 3:] = found.normal[f], found.point[f]
                count += 1
    return complete(solids, couples, key[:count], known[:count], gap[:count], place[:count])


@compiled
def more_room(key: Indices, known: Indices, gap: Floats, place: Floats) -> tuple[Indices, Indices, Floats, Floats]:
    """The same with twice the room."""
    count = len(key)
    keys, knowns, gaps = np.zeros(2 * count, dtype=np.int64), np.zeros(2 * count, dtype=np.int64), np.zeros(2 * count)
    places = np.zeros((2 * count, 6))
    for c in range(count):
        keys[c], knowns[c], gaps[c] = key[c], known[c], gap[c]
        for k in range(6):
            places[c, k] = place[c, k]
    return keys, knowns, gaps, places


@inlined
def from_pair(memory: Memory, p: int, first: int) -> int:
    """The first place in memory, not before `first`, of pair p or a later one."""
    while first < len(memory.key) and memory.key[first] < p * NUMBERS:
        first += 1
    return first


@inlined
def remembered(memory: Memory, key: int, first: int) -> int:
    """The place of a contact in memory, whose pair begins at `first`; -1 if it is not there."""
    at = first
    while at < len(memory.key) and memory.key[at] // NUMBERS == key // NUMBERS:
        if memory.key[at] == key:
            return at
        at += 1
    return -1


@compiled
def complete(solids: Solids, couples: Couples, key: Indices, known: Indices, gap: Floats, place: Floats) -> Touches:
    """What else belongs to the points found; `place` holds their normals and points."""
    pair = key // NUMBERS
    count = len(key)
    touches = Touches(
        key=key,
        first=couples.first[pair],
        second=couples.second[pair],
        friction=couples.friction[pair],
        viscosity=couples.viscosity[pair],
        gap=gap,
        normal=place[:, :3].copy(),
        point=place[:, 3:].copy(),
        arm_a=np.zeros((count, 3)),
        arm_b=np.zeros((count, 3)),
        mass=np.zeros(count),
        side_mass=np.zeros(count),
        known=known,
        push=np.zeros(count),
        rub=np.zeros((count, 3)),
    )
    for c in range(count):
        a, b = touches.first[c], touches.second[c]
        put(touches.arm_a, c, subtract(row(touches.point, c), row(solids.position, a)))
        put(touches.arm_b, c, subtract(row(touches.point, c), row(solids.position, b)))
        normal = row(touches.normal, c)
        along = inverse_mass(solids, touches, c, normal)
        touches.mass[c] = 1 / along
        touches.side_mass[c] = 1 / across(solids, touches, c, normal, along)
    return touches


@inlined
def inverse_mass(solids: Solids, touches: Touches, c: int, along: Vector) -> float:
    """e . K e [1/kg] for the direction e: 1/m_A + 1/m_B + the spins' part (documents, rule R14)."""
    a, b = touches.first[c], touches.second[c]
    lever_a, lever_b = cross(row(touches.arm_a, c), along), cross(row(touches.arm_b, c), along)
    turning = dot(lever_a, apply(rows(solids.ease, a), lever_a)) + dot(lever_b, apply(rows(solids.ease, b), lever_b))
    total: float = solids.lightness[a] + solids.lightness[b] + turning
    return total


@inlined
def across(solids: Solids, touches: Touches, c: int, normal: Vector, along: float) -> float:
    """Mean of e . K e [1/kg] across the normal; `along` is n . K n. In a plane there is one such direction."""
    if solids.plane != SPACE:
        return inverse_mass(solids, touches, c, cross(unit(solids.plane), normal))
    trace = 0.0
    for axis in range(3):
        trace += inverse_mass(solids, touches, c, unit(axis))
    return (trace - along) / 2


@inlined
def velocity_at(velocity: Floats, spin: Floats, touches: Touches, c: int) -> Vector:
    """u = v_B + w_B x r_B - v_A - w_A x r_A [m/s] of contact c."""
    a, b = touches.first[c], touches.second[c]
    of_a = plus(row(velocity, a), 1.0, cross(row(spin, a), row(touches.arm_a, c)))
    return subtract(plus(row(velocity, b), 1.0, cross(row(spin, b), row(touches.arm_b, c))), of_a)


@inlined
def parting(velocity: Floats, spin: Floats, touches: Touches, c: int) -> float:
    """u . n [m/s], negative where it approaches."""
    return dot(velocity_at(velocity, spin, touches, c), row(touches.normal, c))


@inlined
def give(solids: Solids, velocity: Floats, spin: Floats, touches: Touches, c: int, impulse: Vector) -> None:
    """The impulse [N s] to B and its opposite to A (documents, rule R6)."""
    a, b = touches.first[c], touches.second[c]
    put(velocity, a, plus(row(velocity, a), -solids.lightness[a], impulse))
    put(velocity, b, plus(row(velocity, b), solids.lightness[b], impulse))
    turn_a = apply(rows(solids.ease, a), cross(row(touches.arm_a, c), impulse))
    turn_b = apply(rows(solids.ease, b), cross(row(touches.arm_b, c), impulse))
    put(spin, a, subtract(row(spin, a), turn_a))
    put(spin, b, plus(row(spin, b), 1.0, turn_b))


@compiled
def least_gap(solids: Solids, couples: Couples, memory: Memory, found: Features) -> float:
    """Of all features that are not in memory; at most the margin, which pairs off the list surely exceed."""
    look_around(solids, couples, False)
    least, first = couples.margin / 2, 0
    for k in range(couples.listed[0]):
        p = couples.near[k]
        first = from_pair(memory, p, first)
        for f in range(find(solids, couples.first[p], couples.second[p], found)):
            if found.gap[f] < least and remembered(memory, p * NUMBERS + found.number[f], first) < 0:
                least = found.gap[f]
    return least


def margin_of(solids: Solids) -> float:
    """A fifth of the smallest body [m]: a list of few pairs that lasts for many steps."""
    finite = solids.bound[np.isfinite(solids.bound)]
    return 0.2 * float(finite.min()) if len(finite) else math.inf
