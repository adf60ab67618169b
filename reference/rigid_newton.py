"""The engines' impact law for explicit rigid bodies: Newton restitution at the contact point, Coulomb friction in it.

Assumptions: one impulse p at one point, its parts simultaneous through the inverse mass matrix K (u' = u + K p);
u_n' = -e u_n whatever the friction does; Coulomb's law on the velocity u_t' *after* the impact (Moreau's form, and
what engines iterate towards): either u_t' = 0 and |p_t| <= mu p_n, or p_t = -mu p_n u_t'/|u_t'|.
Routh's hypothesis follows the slip through the impact instead. For balls all forms agree: u_t keeps its direction.

Known failure (Kane and Levinson, Dynamics: Theory and Applications, 1985): where K couples n to the plane, e > 0 may
gain energy, because u_n' is prescribed while friction drives the contact. A thin rod at 45 deg whose end meets the
floor at (0.6, -1) m/s, sliding in under the rod, leaves with 17 % more at e = 1, mu = 0.5. No gain for e = 0, for
mu = 0, or where K n is along n (balls). The law is left as it is: another e would be another law. Whoever runs it
watches the energy.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.rigid_body import (
    Motions,
    Rigid,
    apply_impulse,
    closing_velocity,
    inverse_mass,
    solve,
)
from impactbench.scenarios.trajectory import Floats

ITERATIONS = 200
"""Bound on the search for the sliding impulse; a dozen suffice as a rule, for extreme needles some forty."""


def restitution(a: Rigid, b: Rigid, normal: Floats, restitution: float, friction: float = 0.0) -> Motions:
    """Velocities [m/s] and spins [rad/s] after u_n' = -e u_n with Coulomb friction mu at the contact point.

    A ball on a plane: slides if u_t >= 7/2 mu (1 + e) |u_n|, else leaves rolling with 5/7 of its tangential speed.
    """
    closing = closing_velocity(a, b)
    target = closing + restitution * float(closing @ normal) * normal  # what p must cancel if the contact sticks
    return apply_impulse(a, b, -impulse(inverse_mass(a, b), target, normal, friction))


def impulse(inverse: Floats, target: Floats, normal: Floats, friction: float) -> Floats:
    """p on B [N s]: the sticking one if it lies in the cone |p_t| <= mu p_n, else that of the slip that puts it on
    it.
    """
    if friction == 0:
        return slipping(inverse, target, normal, 0.0)
    sticking = slipping(inverse, target, normal, 1.0)
    if excess(sticking, normal, friction) <= 0:
        return sticking
    return slipping(inverse, target, normal, _slip_on_the_cone(inverse, target, normal, friction))


def slipping(inverse: Floats, target: Floats, normal: Floats, grip: float) -> Floats:
    """p with u_n' as prescribed and u_t' = -s p_t: slip against friction, s = k (1 - x)/x for a `grip` x in [0, 1].

    (K + s T) p = -target, T the projector onto the plane; its rows in the plane times x: they hold for x = 0 as well,
    no friction, where x = 1 sticks. k is the mean of K in the plane, so that p is linear in x for balls.
    """
    along = np.outer(normal, normal)
    plane = np.eye(3) - along
    mean = float(np.trace(plane @ inverse)) / 2
    rows = along + grip * plane
    return solve(rows @ inverse + mean * (1 - grip) * plane, -(rows @ target))


def excess(impulse: Floats, normal: Floats, friction: float) -> float:
    """|p_t| - mu p_n [N s]: how far the impulse lies outside the cone of friction."""
    along = float(impulse @ normal)
    plane = impulse - along * normal
    return math.sqrt(float(plane @ plane)) - friction * along


def _slip_on_the_cone(inverse: Floats, target: Floats, normal: Floats, friction: float) -> float:
    """The grip with |p_t| = mu p_n: inside the cone at 0, outside at 1, continuous between. Illinois' false
    position.
    """
    low, high, last = 0.0, 1.0, 0.0
    inside = excess(slipping(inverse, target, normal, low), normal, friction)
    outside = excess(slipping(inverse, target, normal, high), normal, friction)
    enough = 4 * np.finfo(float).eps * (outside - inside)
    for _ in range(ITERATIONS):
        grip = high - outside * (high - low) / (outside - inside)
        value = excess(slipping(inverse, target, normal, grip), normal, friction)
        if abs(value) <= enough or not low < grip < high:
            return grip
        again = value * last > 0  # on the same side twice: halve the other end's value, or that end would never move
        if value > 0:
            high, outside, inside = grip, value, inside / 2 if again else inside
        else:
            low, inside, outside = grip, value, outside / 2 if again else outside
        last = value
    raise RuntimeError(f"no sliding impulse within {ITERATIONS} iterations: mu = {friction}, u = {target}")
