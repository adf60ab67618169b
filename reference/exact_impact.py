"""What an event does to velocities: impacts of spheres with one another and with walls, and rest on walls. Compiled.

Frictionless under the law `nc`; under `doc` the impact shares tangential motion too (documents, rule R9).
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.exact_world import RADIUS, SPEED, World

SWEEPS = 1000


@inlined
def strike_sphere(world: World, i: int, k: int) -> bool:
    """Impact of two spheres: u' = b (u - 2 (u . n) n) (documents, rule R9) or u' = u - (1 + e) (u . n) n (Newton).

    Written about the velocity V of the common centre of mass, which stays (rule R6): with u' = 0 both leave alike to
    the last digit. Static spheres are the limit of an infinite mass (R13).

    True if the pair stays in touch: one lies on the other, pressed by gravity, and no longer bounces.
    """
    s, b = world.spheres, world.rules.bounciness[world.spheres.group[i], world.spheres.group[k]]
    m = s.motion
    d_x, d_y, d_z = m[k, 0] - m[i, 0], m[k, 1] - m[i, 1], m[k, 2] - m[i, 2]
    d, square = (d_x, d_y, d_z), d_x * d_x + d_y * d_y + d_z * d_z
    # (u . n) n = (u . d) d/d^2: the root of d^2, whose rounding would drift the energy, is not needed.
    along = ((m[k, 3] - m[i, 3]) * d_x + (m[k, 4] - m[i, 4]) * d_y + (m[k, 5] - m[i, 5]) * d_z) / square
    if along >= 0.0:
        return False
    share_i = s.inverse_mass[k] / (s.inverse_mass[i] + s.inverse_mass[k])
    share_k = s.inverse_mass[i] / (s.inverse_mass[i] + s.inverse_mass[k])
    pull = 0.0
    for axis in range(3):
        one, other = m[i, SPEED + axis], m[k, SPEED + axis]
        common, u = share_i * one + share_k * other, other - one
        after = b * (u - 2.0 * along * d[axis]) if world.rules.doc else u - (1.0 + b) * along * d[axis]
        m[i, SPEED + axis] = common - share_k * after
        m[k, SPEED + axis] = common + share_i * after
        pull += (s.acceleration[k, axis] - s.acceleration[i, axis]) * d[axis]
    return bool(pull < 0.0 and -b * along * math.sqrt(square) <= world.rules.rest)


@inlined
def strike_wall(world: World, i: int, w: int) -> None:
    """One-way impact: v' = b (v - 2 (v . n) n) (documents, rule R13) or v' = v - (1 + e) (v . n) n (Newton).

    Times have last digits of their own, so the sphere is a little before or behind the wall: it goes back b times as
    far as it got behind, else every bounce would shift the path by twice that.
    """
    s, n, rules = world.spheres, world.walls.normal[w], world.rules
    b = rules.bounciness[s.group[i], world.walls.group[w]]
    x, v = s.motion[i, :3], s.motion[i, SPEED : SPEED + 3]
    along = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    gap = x[0] * n[0] + x[1] * n[1] + x[2] * n[2] - (world.walls.level[w] + s.motion[i, RADIUS])
    for k in range(3):
        v[k] = b * (v[k] - 2.0 * along * n[k]) if rules.doc else v[k] - (1.0 + b) * along * n[k]
        x[k] -= (1.0 + b) * gap * n[k]
    rest_on_wall(world, i, w)


@inlined
def rest_on_wall(world: World, i: int, w: int) -> None:
    """After an impact: whether the sphere bounces or stays on the wall.

    Bounces get shorter without end where b < 1 (Zeno). A sphere that leaves slower than `rest` [m/s] and is pressed
    back by gravity is at rest on the wall; the bounces left out rise less than rest^2/(2 a). With b = 1, bounces of
    round-off would go on for ever: such that rise less than `rise` [m] are left out. Without a pressing gravity the
    sphere must not leave at all.
    """
    s, n, rules = world.spheres, world.walls.normal[w], world.rules
    v = s.motion[i, SPEED : SPEED + 3]
    along = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    pull = rules.gravity[0] * n[0] + rules.gravity[1] * n[1] + rules.gravity[2] * n[2]
    slow = rules.still
    if pull < 0.0:
        elastic = rules.bounciness[s.group[i], world.walls.group[w]] == 1.0
        slow = math.sqrt(-2.0 * pull * rules.rise) if elastic else rules.rest
    s.rests[i, w] = pull <= 0.0 and along <= slow
    if s.rests[i, w]:
        for k in range(3):
            v[k] -= along * n[k]


@inlined
def settle(world: World, i: int) -> None:
    """After a change of velocity: which walls the sphere still rests on, and the acceleration they leave it.

    A wall only pushes: a = g + sum of p_w n_w with p_w >= 0 and a . n_w >= 0, by sweeps over the walls it rests on.
    """
    s, walls, rules = world.spheres, world.walls, world.rules
    resting = False
    for w in range(len(walls.level)):
        if s.rests[i, w]:
            along = 0.0
            for k in range(3):
                along += s.motion[i, SPEED + k] * walls.normal[w, k]
            s.rests[i, w] = abs(along) <= rules.rest
            resting |= s.rests[i, w]
            if s.rests[i, w]:
                for k in range(3):
                    s.motion[i, SPEED + k] -= along * walls.normal[w, k]
    for k in range(3):
        s.acceleration[i, k] = rules.gravity[k]
    if resting:
        press(world, i)


@compiled
def press(world: World, i: int) -> None:
    s, walls = world.spheres, world.walls
    a, push = s.acceleration[i], walls.push
    push[:] = 0.0
    small = 1e-15 * math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    for _ in range(SWEEPS):
        worst = 0.0
        for w in range(len(push)):
            if s.rests[i, w]:
                n = walls.normal[w]
                total = max(0.0, push[w] - (a[0] * n[0] + a[1] * n[1] + a[2] * n[2]))
                for k in range(3):
                    a[k] += (total - push[w]) * n[k]
                worst = max(worst, abs(total - push[w]))
                push[w] = total
        if worst <= small:
            break
    for w in range(len(push)):
        if s.rests[i, w] and push[w] == 0.0:
            n = walls.normal[w]
            s.rests[i, w] = a[0] * n[0] + a[1] * n[1] + a[2] * n[2] <= small
