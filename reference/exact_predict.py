"""The next event of one sphere: with whom it collides first, or when it leaves its cell. Compiled, on flat arrays."""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.events_cells import EMPTY, cell_of
from impactbench.reference.events_queue import reschedule
from impactbench.reference.events_roots import curve, land, meet
from impactbench.reference.exact_world import World

NOTHING, SPHERE, WALL, CELL, EDGE = 0, 1, 2, 3, 4
"""Kinds of events. EDGE: the sphere comes to an edge of a box, which this runner does not resolve."""

GRAIN = 1e-15
"""Gap, next to the coordinates it is the difference of, that counts as closed."""


@compiled
def fly(world: World, i: int, now: float) -> None:
    """Bring a sphere to `now` [s] on its parabola."""
    s = world.spheres
    span = now - s.time[i]
    for k in range(3):
        s.position[i, k] += span * (s.velocity[i, k] + span / 2.0 * s.acceleration[i, k])
        s.velocity[i, k] += span * s.acceleration[i, k]
    s.time[i] = now


@compiled
def predict(world: World, i: int, now: float) -> None:
    """Find and queue sphere i's next event. Leaves its motion as it is, so what others predicted stays valid."""
    s = world.spheres
    s.kind[i] = NOTHING
    due = cell_exit(world, i, now)
    if world.rules.collide:
        for w in range(len(world.walls.level)):
            due = min(due, first_wall(world, i, now, w, due))
        due = first_sphere(world, i, now, due)
    reschedule(world.queue, i, due)


@compiled
def place(world: World, i: int, k: int, now: float) -> tuple[float, float]:
    """Coordinate [m] and speed [m/s] of sphere i along axis k at `now`."""
    s = world.spheres
    span, speed, pull = now - s.time[i], s.velocity[i, k], s.acceleration[i, k]
    return s.position[i, k] + span * (speed + span / 2.0 * pull), speed + span * pull


@compiled
def cell_exit(world: World, i: int, now: float) -> float:
    s, cells, due = world.spheres, world.cells, math.inf
    for k in range(3):
        if cells.number[k] > 1:
            at, speed = place(world, i, k, now)
            low, pull = cells.cube[i, k] * cells.side[0], s.acceleration[i, k]
            for side in range(2):
                gap = low + cells.side[0] - at if side == 1 else at - low
                sign = -1.0 if side == 1 else 1.0
                time = now + land(gap, sign * speed, sign * pull)
                if time < due:
                    due, s.kind[i], s.partner[i] = time, CELL, 2 * k + side
    return due


@compiled
def first_wall(world: World, i: int, now: float, w: int, due: float) -> float:
    """Time of contact with wall w if before `due`, else `due`."""
    s, walls = world.spheres, world.walls
    if s.rests[i, w]:
        return past_the_edge(world, i, now, w, due)
    gap, speed, pull = -walls.level[w] - s.radius[i], 0.0, 0.0
    for k in range(3):
        at, rate = place(world, i, k, now)
        n = walls.normal[w, k]
        gap += n * at
        speed += n * rate
        pull += n * s.acceleration[i, k]
    if abs(gap) <= GRAIN * (abs(walls.level[w]) + s.radius[i]):
        gap = 0.0  # else a closed gap of round-off would give every bounce the speed of a fall through it
    bounded = math.isfinite(walls.low[w].max()) or math.isfinite(walls.high[w].min())
    if bounded and gap < -world.rules.touch and (speed <= 0.0 or pull >= 0.0 or speed * speed <= 2.0 * pull * gap):
        return due  # beside or behind a box's face, and it stays there
    time = now + land(gap, speed, pull)
    if not time < due:
        return due
    kind, far = WALL, s.radius[i]
    for k in range(3):
        at, _ = place(world, i, k, time)
        beside = max(walls.low[w, k] - at, at - walls.high[w, k])
        if beside >= far:
            return due
        if beside > 0.0:
            kind = EDGE
    s.kind[i], s.partner[i] = kind, w
    return time


@compiled
def past_the_edge(world: World, i: int, now: float, w: int, due: float) -> float:
    """Time at which a sphere that rests on a box's face comes to its edge, if before `due`."""
    s, walls = world.spheres, world.walls
    for k in range(3):
        if math.isfinite(walls.low[w, k]):
            at, speed = place(world, i, k, now)
            pull = s.acceleration[i, k]
            one = land(at - walls.low[w, k], speed, pull)
            other = land(walls.high[w, k] - at, -speed, -pull)
            time = now + min(one, other)
            if time < due:
                due, s.kind[i], s.partner[i] = time, EDGE, w
    return due


@compiled
def first_sphere(world: World, i: int, now: float, due: float) -> float:
    """Time of the first contact with another sphere of the neighbouring cells if before `due`, else `due`."""
    s, cells = world.spheres, world.cells
    reach_x, reach_y, reach_z = cells.number[0] > 1, cells.number[1] > 1, cells.number[2] > 1
    for a in range(-reach_x, reach_x + 1):
        for b in range(-reach_y, reach_y + 1):
            for c in range(-reach_z, reach_z + 1):
                k = cells.head[cell_of(cells, cells.cube[i, 0] + a, cells.cube[i, 1] + b, cells.cube[i, 2] + c)]
                while k != EMPTY:
                    if k != i:
                        time = now + contact(world, i, k, now)
                        if time < due:
                            due, s.kind[i], s.partner[i], s.partner_events[i] = time, SPHERE, k, s.events[k]
                    k = cells.after[k]
    return due


@compiled
def contact(world: World, i: int, k: int, now: float) -> float:
    """Time until spheres i and k touch: a quadratic if they share their acceleration, else a quartic."""
    s = world.spheres
    one, other = now - s.time[i], now - s.time[k]
    x, v, a = s.position, s.velocity, s.acceleration
    p, q, r = a[k, 0] - a[i, 0], a[k, 1] - a[i, 1], a[k, 2] - a[i, 2]
    d_x = x[k, 0] + other * (v[k, 0] + other / 2.0 * a[k, 0]) - x[i, 0] - one * (v[i, 0] + one / 2.0 * a[i, 0])
    d_y = x[k, 1] + other * (v[k, 1] + other / 2.0 * a[k, 1]) - x[i, 1] - one * (v[i, 1] + one / 2.0 * a[i, 1])
    d_z = x[k, 2] + other * (v[k, 2] + other / 2.0 * a[k, 2]) - x[i, 2] - one * (v[i, 2] + one / 2.0 * a[i, 2])
    u_x = v[k, 0] + other * a[k, 0] - v[i, 0] - one * a[i, 0]
    u_y = v[k, 1] + other * a[k, 1] - v[i, 1] - one * a[i, 1]
    u_z = v[k, 2] + other * a[k, 2] - v[i, 2] - one * a[i, 2]
    reach = s.radius[i] + s.radius[k]
    if p == 0.0 and q == 0.0 and r == 0.0:
        return meet(d_x, d_y, d_z, u_x, u_y, u_z, reach)
    grain = GRAIN * (abs(x[i, 0]) + abs(x[i, 1]) + abs(x[i, 2]) + reach)
    return curve(d_x, d_y, d_z, u_x, u_y, u_z, p, q, r, reach, grain)
