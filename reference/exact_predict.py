"""The next event of one sphere: with whom it collides first, or when it leaves its cell. Compiled, on flat arrays."""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.events_cells import EMPTY, Cells, cross
from impactbench.reference.events_queue import reschedule
from impactbench.reference.events_roots import curve, fall_back, land, meet
from impactbench.reference.exact_world import RADIUS, SPEED, TIME, Spheres, World
from impactbench.scenarios.trajectory import Floats

NOTHING, SPHERE, WALL, EDGE = 0, 1, 2, 3
"""Kinds of contacts. EDGE: the sphere comes to an edge of a box, which this runner does not resolve."""

NO_SIDE = -1

GRAIN = 1e-15
"""Gap, next to the coordinates it is the difference of, that counts as closed."""


@inlined
def fly(world: World, i: int, now: float) -> None:
    """Bring a sphere to `now` [s] on its parabola."""
    s = world.spheres
    span = now - s.motion[i, TIME]
    for k in range(3):
        s.motion[i, k] += span * (s.motion[i, SPEED + k] + span / 2.0 * s.acceleration[i, k])
        s.motion[i, SPEED + k] += span * s.acceleration[i, k]
    s.motion[i, TIME] = now


@inlined
def predict(world: World, i: int, now: float) -> None:
    """Bring sphere i to `now` [s] on its parabola, then find and queue its next event."""
    s = world.spheres
    fly(world, i, now)
    s.kind[i] = NOTHING
    due = s.second[i] = math.inf
    if world.rules.collide:
        due = first_wall(world, i, now, due)
        due = first_sphere(s, world.cells, world.rules.pulled, i, now, due, NO_SIDE)
    s.contact[i] = due
    queue_next(world, i, now)


@inlined
def enter_cell(world: World, i: int, now: float) -> None:
    """Sphere i comes to the next cell at `now` [s]: only cells that are new to it can hold an earlier contact."""
    s = world.spheres
    fly(world, i, now)
    cross(world.cells, i, s.exit_side[i])
    if world.rules.collide:
        s.contact[i] = first_sphere(s, world.cells, world.rules.pulled, i, now, s.contact[i], s.exit_side[i])
    queue_next(world, i, now)


@inlined
def queue_next(world: World, i: int, now: float) -> None:
    """Queue the sphere's contact, or its way out of the cell if that comes first."""
    s, cells, out = world.spheres, world.cells, math.inf
    side = cells.side[0]
    for k in range(3):
        if cells.number[k] > 1:
            speed, pull = s.motion[i, 3 + k], s.acceleration[i, k]
            above = s.motion[i, k] - cells.cube[i, k] * side
            if speed < 0.0 or pull < 0.0:
                time = now + land(above, speed, pull)
                if time < out:
                    out, s.exit_side[i] = time, 2 * k
            if speed > 0.0 or pull > 0.0:
                time = now + land(side - above, -speed, -pull)
                if time < out:
                    out, s.exit_side[i] = time, 2 * k + 1
    s.leaves[i] = out < s.contact[i]
    reschedule(world.queue, i, out if s.leaves[i] else s.contact[i])


@inlined
def first_wall(world: World, i: int, now: float, due: float) -> float:
    """Time of the first contact with a wall if before `due`, else `due`."""
    s, walls, m, a = world.spheres, world.walls, world.spheres.motion, world.spheres.acceleration
    x, y, z, v_x, v_y, v_z, radius = m[i, 0], m[i, 1], m[i, 2], m[i, 3], m[i, 4], m[i, 5], m[i, RADIUS]
    for w in range(len(walls.level)):
        if s.rests[i, w]:
            if walls.bounded[w]:
                due = past_the_edge(world, i, now, w, due)
            continue
        n_x, n_y, n_z = walls.normal[w, 0], walls.normal[w, 1], walls.normal[w, 2]
        speed, pull = n_x * v_x + n_y * v_y + n_z * v_z, 0.0
        if world.rules.pulled:
            pull = n_x * a[i, 0] + n_y * a[i, 1] + n_z * a[i, 2]
        if speed >= 0.0 and pull >= 0.0:
            continue
        gap = n_x * x + n_y * y + n_z * z - (walls.level[w] + radius)
        if abs(gap) <= GRAIN * (abs(walls.level[w]) + radius):
            gap = 0.0  # else a closed gap of round-off would give every bounce the speed of a fall through it
        behind = walls.bounded[w] and gap < -world.rules.touch
        wait = fall_back(gap, speed, pull) if behind else land(gap, speed, pull)
        if now + wait < s.second[i]:
            kind = where_on_face(world, i, w, wait) if walls.bounded[w] else WALL
            if kind != NOTHING and now + wait < due:
                due, s.second[i], s.kind[i], s.partner[i] = now + wait, due, kind, w
            elif kind != NOTHING:
                s.second[i] = now + wait
    return due


@compiled
def where_on_face(world: World, i: int, w: int, wait: float) -> int:
    """Whether a sphere that comes level with a box's face in `wait` [s] meets the face, its edge, or passes beside."""
    s, kind = world.spheres, WALL
    for k in range(3):
        at = s.motion[i, k] + wait * (s.motion[i, SPEED + k] + wait / 2.0 * s.acceleration[i, k])
        beside = max(world.walls.low[w, k] - at, at - world.walls.high[w, k])
        if beside >= s.motion[i, RADIUS]:
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
            at, speed, pull = s.motion[i, k], s.motion[i, SPEED + k], s.acceleration[i, k]
            one = land(at - walls.low[w, k], speed, pull)
            other = land(walls.high[w, k] - at, -speed, -pull)
            time = now + min(one, other)
            if time < due:
                due, s.kind[i], s.partner[i] = time, EDGE, w
    return due


@inlined
def first_sphere(s: Spheres, cells: Cells, pulled: bool, i: int, now: float, due: float, side: int) -> float:
    """Time of the first contact with another sphere of the neighbouring cells if before `due`, else `due`.

    side: look only into those that became neighbours by leaving a cell on that side; `NO_SIDE`: into all. `pulled`:
    there is gravity, so that accelerations may differ.
    """
    n, m = cells.number, s.motion
    from_x, to_x = span(n[0], side, 0)
    from_y, to_y = span(n[1], side, 1)
    from_z, to_z = span(n[2], side, 2)
    own_x, own_y, own_z = cells.cube[i, 0] % n[0], cells.cube[i, 1] % n[1], cells.cube[i, 2] % n[2]
    x, y, z, v_x, v_y, v_z, radius = m[i, 0], m[i, 1], m[i, 2], m[i, 3], m[i, 4], m[i, 5], m[i, RADIUS]
    size = GRAIN * (abs(x) + abs(y) + abs(z))
    for a in range(own_x + from_x, own_x + to_x + 1):
        row = wrapped(a, n[0]) * n[1]
        for b in range(own_y + from_y, own_y + to_y + 1):
            column = (row + wrapped(b, n[1])) * n[2]
            for c in range(own_z + from_z, own_z + to_z + 1):
                k = cells.head[column + wrapped(c, n[2])]
                while k != EMPTY:
                    if k != i:
                        if pulled:
                            wait = contact(m, s.acceleration, i, k, now, size)
                        else:
                            lag = now - m[k, TIME]
                            wait = meet(
                                m[k, 0] + lag * m[k, 3] - x,
                                m[k, 1] + lag * m[k, 4] - y,
                                m[k, 2] + lag * m[k, 5] - z,
                                m[k, 3] - v_x,
                                m[k, 4] - v_y,
                                m[k, 5] - v_z,
                                radius + m[k, RADIUS],
                            )
                        if now + wait < due:
                            s.second[i] = due
                            due, s.kind[i], s.partner[i], s.partner_events[i] = now + wait, SPHERE, k, s.events[k]
                        elif now + wait < s.second[i]:
                            s.second[i] = now + wait
                    k = cells.after[k]
    return due


@inlined
def wrapped(cell: int, cells: int) -> int:
    """Number of a cell that is at most one beyond the ends, which meet."""
    if cell < 0:
        return cell + cells
    return cell - cells if cell >= cells else cell


@inlined
def span(cells: int, side: int, axis: int) -> tuple[int, int]:
    """First and last of the cells to look into along an axis, counted from the own one."""
    if cells == 1:
        return 0, 0
    if side == 2 * axis:
        return -1, -1
    if side == 2 * axis + 1:
        return 1, 1
    return -1, 1


@compiled
def contact(m: Floats, a: Floats, i: int, k: int, now: float, size: float) -> float:
    """Time until spheres i, which is at `now` [s], and k touch: a quadratic if they share their acceleration."""
    lag = now - m[k, TIME]
    p, q, r = a[k, 0] - a[i, 0], a[k, 1] - a[i, 1], a[k, 2] - a[i, 2]
    d_x = m[k, 0] + lag * (m[k, 3] + lag / 2.0 * a[k, 0]) - m[i, 0]
    d_y = m[k, 1] + lag * (m[k, 4] + lag / 2.0 * a[k, 1]) - m[i, 1]
    d_z = m[k, 2] + lag * (m[k, 5] + lag / 2.0 * a[k, 2]) - m[i, 2]
    u_x = m[k, 3] + lag * a[k, 0] - m[i, 3]
    u_y = m[k, 4] + lag * a[k, 1] - m[i, 4]
    u_z = m[k, 5] + lag * a[k, 2] - m[i, 5]
    reach = m[i, RADIUS] + m[k, RADIUS]
    if p == 0.0 and q == 0.0 and r == 0.0:
        return meet(d_x, d_y, d_z, u_x, u_y, u_z, reach)
    return curve(d_x, d_y, d_z, u_x, u_y, u_z, p, q, r, reach, size + GRAIN * reach)
