"""The next event of one sphere: with whom it collides first, or when it leaves its cell. Compiled, on flat arrays."""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.events_cells import EMPTY, cell_of
from impactbench.reference.events_queue import reschedule
from impactbench.reference.events_roots import curve, fall_back, land, meet
from impactbench.reference.exact_world import World
from impactbench.scenarios.trajectory import Floats

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
    """Bring sphere i to `now` [s] on its parabola, then find and queue its next event."""
    s = world.spheres
    fly(world, i, now)
    s.kind[i] = NOTHING
    due = cell_exit(world, i, now)
    if world.rules.collide:
        due = first_wall(world, i, now, due)
        due = first_sphere(world, i, now, due)
    reschedule(world.queue, i, due)


@compiled
def cell_exit(world: World, i: int, now: float) -> float:
    s, cells, due = world.spheres, world.cells, math.inf
    for k in range(3):
        if cells.number[k] > 1:
            at, speed, pull = s.position[i, k], s.velocity[i, k], s.acceleration[i, k]
            low = cells.cube[i, k] * cells.side[0]
            for side in range(2):
                gap = low + cells.side[0] - at if side == 1 else at - low
                sign = -1.0 if side == 1 else 1.0
                time = now + land(gap, sign * speed, sign * pull)
                if time < due:
                    due, s.kind[i], s.partner[i] = time, CELL, 2 * k + side
    return due


@compiled
def first_wall(world: World, i: int, now: float, due: float) -> float:
    """Time of the first contact with a wall if before `due`, else `due`."""
    s, walls, touch = world.spheres, world.walls, world.rules.touch
    x, v, a, normal, radius = s.position, s.velocity, s.acceleration, walls.normal, s.radius[i]
    for w in range(len(walls.level)):
        if s.rests[i, w]:
            if walls.bounded[w]:
                due = past_the_edge(world, i, now, w, due)
            continue
        gap, speed, pull = -walls.level[w] - radius, 0.0, 0.0
        for k in range(3):
            gap += normal[w, k] * x[i, k]
            speed += normal[w, k] * v[i, k]
            pull += normal[w, k] * a[i, k]
        if abs(gap) <= GRAIN * (abs(walls.level[w]) + radius):
            gap = 0.0  # else a closed gap of round-off would give every bounce the speed of a fall through it
        behind = walls.bounded[w] and gap < -touch
        wait = fall_back(gap, speed, pull) if behind else land(gap, speed, pull)
        if now + wait < due:
            kind = where_on_face(world, i, w, wait) if walls.bounded[w] else WALL
            if kind != NOTHING:
                due, s.kind[i], s.partner[i] = now + wait, kind, w
    return due


@compiled
def where_on_face(world: World, i: int, w: int, wait: float) -> int:
    """Whether a sphere that comes level with a box's face in `wait` [s] meets the face, its edge, or passes beside."""
    s, kind = world.spheres, WALL
    for k in range(3):
        at = s.position[i, k] + wait * (s.velocity[i, k] + wait / 2.0 * s.acceleration[i, k])
        beside = max(world.walls.low[w, k] - at, at - world.walls.high[w, k])
        if beside >= s.radius[i]:
            return NOTHING
        if beside > 0.0:
            kind = EDGE
    return kind


@compiled
def past_the_edge(world: World, i: int, now: float, w: int, due: float) -> float:
    """Time at which a sphere that rests on a box's face comes to its edge, if before `due`."""
    s, walls = world.spheres, world.walls
    for k in range(3):
        if math.isfinite(walls.low[w, k]):
            at, speed, pull = s.position[i, k], s.velocity[i, k], s.acceleration[i, k]
            one = land(at - walls.low[w, k], speed, pull)
            other = land(walls.high[w, k] - at, -speed, -pull)
            time = now + min(one, other)
            if time < due:
                due, s.kind[i], s.partner[i] = time, EDGE, w
    return due


@compiled
def first_sphere(world: World, i: int, now: float, due: float) -> float:
    """Time of the first contact with another sphere of the neighbouring cells if before `due`, else `due`."""
    s, cells, x = world.spheres, world.cells, world.spheres.position
    size = GRAIN * (abs(x[i, 0]) + abs(x[i, 1]) + abs(x[i, 2]))
    wide_x, wide_y, wide_z = cells.number[0] > 1, cells.number[1] > 1, cells.number[2] > 1
    for a in range(-wide_x, wide_x + 1):
        for b in range(-wide_y, wide_y + 1):
            for c in range(-wide_z, wide_z + 1):
                k = cells.head[cell_of(cells.number, cells.cube[i, 0] + a, cells.cube[i, 1] + b, cells.cube[i, 2] + c)]
                while k != EMPTY:
                    if k != i:
                        time = now + contact(
                            s.position, s.velocity, s.acceleration, s.radius, i, k, now - s.time[k], size
                        )
                        if time < due:
                            due, s.kind[i], s.partner[i], s.partner_events[i] = time, SPHERE, k, s.events[k]
                    k = cells.after[k]
    return due


@compiled
def contact(x: Floats, v: Floats, a: Floats, radius: Floats, i: int, k: int, lag: float, size: float) -> float:
    """Time until spheres i and k touch, k's state being `lag` [s] old: a quadratic if they share their acceleration."""
    p, q, r = a[k, 0] - a[i, 0], a[k, 1] - a[i, 1], a[k, 2] - a[i, 2]
    d_x = x[k, 0] + lag * (v[k, 0] + lag / 2.0 * a[k, 0]) - x[i, 0]
    d_y = x[k, 1] + lag * (v[k, 1] + lag / 2.0 * a[k, 1]) - x[i, 1]
    d_z = x[k, 2] + lag * (v[k, 2] + lag / 2.0 * a[k, 2]) - x[i, 2]
    u_x = v[k, 0] + lag * a[k, 0] - v[i, 0]
    u_y = v[k, 1] + lag * a[k, 1] - v[i, 1]
    u_z = v[k, 2] + lag * a[k, 2] - v[i, 2]
    reach = radius[i] + radius[k]
    if p == 0.0 and q == 0.0 and r == 0.0:
        return meet(d_x, d_y, d_z, u_x, u_y, u_z, reach)
    return curve(d_x, d_y, d_z, u_x, u_y, u_z, p, q, r, reach, size + GRAIN * reach)
