"""Impacts of several pairs at one instant, all at once, so that a symmetric scene has a symmetric outcome. Compiled.

The approaching pairs among spheres and walls that touch one another are one impact (Smith, Kaufman, Vouga, Tamstorf &
Grinspun 2012, Reflections on Simultaneous Impact). Let p be the velocities nearest to the present v, in the metric of
kinetic energy, at which none of them approaches: p is the inelastic outcome along the normals, v + 2 (p - v) the
elastic one. Pairs that approach after that are the next impact of the same instant, until none is left, so a blow still
runs through a row of touching balls one by one. A single pair gets R7 or Newton's law, and energy never grows.

The documents' inelastic outcome (R8): all bodies that the approaching pairs join leave as if glued.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.exact_impact import rest_on_wall
from impactbench.reference.exact_predict import SPHERE, fly
from impactbench.reference.exact_world import RADIUS, SPEED, TIME, World
from impactbench.reference.particles import Indices
from impactbench.reference.pushes import Holds, closing, hold_all
from impactbench.scenarios.trajectory import Floats

ROUNDS = 1000
"""Impacts in a row within one instant; what still approaches then is left to the pairs."""
ROUND_OFF = 4 * 2.0**-52
NO_WALL = -1


class Cluster(NamedTuple):
    """Movable spheres `members` that touch one another or a wall now, and their m contacts, shapes [m] and [m, 3].

    second: the sphere; first: the other one, or the number after the last sphere for a wall; normal from first.
    """

    members: Indices
    first: Indices
    second: Indices
    wall: Indices
    normal: Floats
    bounciness: Floats


@inlined
def several(world: World, i: int, now: float) -> bool:
    """Whether sphere i or its partner may meet others too at this instant."""
    s, span = world.spheres, one_instant(world, now)
    if s.second[i] <= now + span or now - s.struck[i] <= span:
        return True
    k = s.partner[i]
    if s.kind[i] != SPHERE or k >= world.rules.movable:
        return False
    elsewhere = s.contact[k] <= now + span and not (s.kind[k] == SPHERE and s.partner[k] == i)
    return bool(elsewhere or s.second[k] <= now + span or now - s.struck[k] <= span)


@inlined
def one_instant(world: World, now: float) -> float:
    """Span of time [s] that counts as one instant."""
    return max(world.rules.instant, 4e-16 * now)


@compiled
def strike_together(world: World, i: int, now: float) -> Indices:
    """All impacts of this instant that hang together with sphere i. Returns the spheres concerned.

    None where there is only one pair, or where bounciness differs from pair to pair: nothing has changed then.
    """
    cluster, s = gather(world, i, now), world.spheres
    nobody = cluster.members[:0]
    if len(cluster.first) < 2 or (cluster.bounciness != cluster.bounciness[0]).any():
        return nobody
    n = len(s.motion)
    velocity, inverse_mass = np.zeros((n + 1, 3)), np.zeros(n + 1)
    velocity[:n], inverse_mass[:n] = s.motion[:, SPEED : SPEED + 3], s.inverse_mass
    struck = np.zeros(len(cluster.first), dtype=np.bool_)
    for _ in range(ROUNDS):
        pairs = approaching(velocity, cluster, world.rules.still)
        if len(pairs) == 0:
            break
        reflect(velocity, inverse_mass, cluster, pairs, world.rules.doc)
        struck[pairs] = True
        walls = (cluster.wall[pairs] != NO_WALL).sum()
        world.tally[0] += len(pairs) - walls
        world.tally[1] += walls
    if not struck.any():
        return nobody
    s.motion[:, SPEED : SPEED + 3] = velocity[:n]
    for c in range(len(struck)):
        if struck[c] and cluster.wall[c] != NO_WALL:
            rest_on_wall(world, cluster.second[c], cluster.wall[c])
    return cluster.members


@compiled
def gather(world: World, i: int, now: float) -> Cluster:
    """Sphere i and all that touch it, directly or through others, brought to `now` [s]."""
    s, walls, rules = world.spheres, world.walls, world.rules
    n = len(s.motion)
    found, looked = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    found[i] = True
    members, pairs = [i], [(n, i, NO_WALL)]
    pairs.pop()  # an empty list has no type
    done = 0
    while done < len(members):
        a = members[done]
        done += 1
        looked[a] = True
        fly(world, a, now)
        pairs.extend([(n, a, w) for w in range(len(walls.level)) if stands_on(world, a, w)])
        for k in range(n):
            if not looked[k] and touches(world, a, k, now):
                pairs.append((k, a, NO_WALL))
                if k < rules.movable and not found[k]:
                    found[k] = True
                    members.append(k)
    count = len(pairs)
    first, second, wall = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    normal, bounciness = np.empty((count, 3)), np.empty(count)
    for c in range(count):
        k, a, w = pairs[c]
        first[c], second[c], wall[c] = k, a, w
        if w == NO_WALL:
            normal[c] = s.motion[a, :3] - s.motion[k, :3]
            normal[c] /= math.sqrt((normal[c] ** 2).sum())
        else:
            normal[c] = walls.normal[w]
        bounciness[c] = rules.bounciness[s.group[a], s.group[k] if w == NO_WALL else walls.group[w]]
    return Cluster(np.array(members), first, second, wall, normal, bounciness)


@compiled
def touches(world: World, a: int, k: int, now: float) -> bool:
    """Whether the surfaces of sphere a, which is at `now` [s], and k are apart by round-off at most."""
    m, pull = world.spheres.motion, world.spheres.acceleration[k]
    lag, square, size = now - m[k, TIME], 0.0, 0.0
    for axis in range(3):
        off = m[k, axis] + lag * (m[k, SPEED + axis] + lag / 2.0 * pull[axis]) - m[a, axis]
        square += off * off
        size += abs(m[a, axis])
    return bool(math.sqrt(square) - m[a, RADIUS] - m[k, RADIUS] <= world.rules.closed + ROUND_OFF * size)


@compiled
def stands_on(world: World, a: int, w: int) -> bool:
    """Whether sphere a touches the face of wall w, up to round-off."""
    m, walls = world.spheres.motion, world.walls
    gap, size = -walls.level[w] - m[a, RADIUS], abs(walls.level[w])
    for axis in range(3):
        gap += m[a, axis] * walls.normal[w, axis]
        size += abs(m[a, axis])
        if not walls.low[w, axis] <= m[a, axis] <= walls.high[w, axis]:
            return False
    return bool(abs(gap) <= world.rules.closed + ROUND_OFF * size)


@compiled
def approaching(velocity: Floats, cluster: Cluster, still: float) -> Indices:
    """Numbers of the pairs that approach by more than `still` [m/s]."""
    found = np.zeros(len(cluster.first), dtype=np.bool_)
    for c in range(len(found)):
        found[c] = closing(velocity, cluster.first[c], cluster.second[c], cluster.normal, c) < -still
    return np.nonzero(found)[0]


@compiled
def reflect(velocity: Floats, inverse_mass: Floats, cluster: Cluster, pairs: Indices, doc: bool) -> None:
    """The impact of `pairs`: v' = v + (1 + e) (p - v), or by R9 b times the elastic and 1 - b times the glued one."""
    first, second, b = cluster.first[pairs], cluster.second[pairs], cluster.bounciness[0]
    nearest, none = velocity.copy(), np.zeros(len(pairs))
    mass = 1.0 / (inverse_mass[first] + inverse_mass[second])
    holds = Holds(first, second, cluster.normal[pairs], none, mass, none.copy())
    hold_all(nearest, inverse_mass, holds, ROUND_OFF * np.abs(velocity).max())
    if not doc or b == 1.0:
        velocity += (1.0 + b) * (nearest - velocity)
        return
    elastic, glued = velocity + 2.0 * (nearest - velocity), velocity.copy()
    glue(glued, inverse_mass, first, second)
    velocity[:] = b * elastic + (1.0 - b) * glued


@compiled
def glue(velocity: Floats, inverse_mass: Floats, first: Indices, second: Indices) -> None:
    """All that the pairs join gets the velocity of its common centre of mass (documents, rule R8); 0 with a static."""
    group = np.arange(len(velocity))
    for _ in range(len(first)):
        for c in range(len(first)):
            group[first[c]] = group[second[c]] = min(group[first[c]], group[second[c]])
    for g in np.unique(group[second]):
        joined = np.nonzero(group == g)[0]
        mass, momentum = 0.0, np.zeros(3)
        for i in joined:
            mass += 1.0 / inverse_mass[i]  # infinite with a static, which leaves no speed
            if inverse_mass[i] > 0.0:
                momentum += velocity[i] / inverse_mass[i]
        for i in joined:
            velocity[i] = momentum / mass
