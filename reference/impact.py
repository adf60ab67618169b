"""Impacts of particles under the documents' law (documents, rules R6-R9 and R11-R13).

Velocities are arrays of three [m/s]; `normal` is the unit impact normal from A to B; a static body has mass
`math.inf` and velocity 0. Every function returns the velocities after the impact; it leaves the question whether the
pair approaches to `approaching`.
"""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.trajectory import Floats

Velocities = tuple[Floats, Floats]


def reduced_mass(mass_a: float, mass_b: float) -> float:
    """mu_r = m_A m_B / (m_A + m_B) [kg]; the movable body's mass if the other is static."""
    return 1 / (1 / mass_a + 1 / mass_b)


def split(velocity: Floats, normal: Floats) -> tuple[Floats, Floats]:
    """Parts along the normal and in the contact plane: v_n = (v . n) n and v_p = v - v_n (documents, rule R11)."""
    along = float(velocity @ normal) * normal
    return along, velocity - along


def approaching(velocity_a: Floats, velocity_b: Floats, normal: Floats) -> bool:
    """Whether u . n < 0: separating and resting pairs are left alone."""
    return bool((velocity_b - velocity_a) @ normal < 0)


def apply_impulse(
    mass_a: float, mass_b: float, velocity_a: Floats, velocity_b: Floats, impulse_a: Floats
) -> Velocities:
    """v' = v + i/m with i_B = -i_A (documents, rule R6): total momentum stays; a static partner takes its part
    unmoved.
    """
    return velocity_a + impulse_a / mass_a, velocity_b - impulse_a / mass_b


def elastic(mass_a: float, mass_b: float, velocity_a: Floats, velocity_b: Floats, normal: Floats) -> Velocities:
    """i_A = 2 mu_r (s_B - s_A) n, with s = v . n (documents, rule R7)."""
    closing = float((velocity_b - velocity_a) @ normal)
    impulse_a = 2 * reduced_mass(mass_a, mass_b) * closing * normal
    return apply_impulse(mass_a, mass_b, velocity_a, velocity_b, impulse_a)


def inelastic(mass_a: float, mass_b: float, velocity_a: Floats, velocity_b: Floats) -> Velocities:
    """Both leave with v' = (m_A v_A + m_B v_B)/(m_A + m_B), as if glued for an instant (documents, rule R8)."""
    share_a = reduced_mass(mass_a, mass_b) / mass_a
    common: Floats = velocity_a + share_a * (velocity_b - velocity_a)
    return common, common.copy()


def bounce(
    mass_a: float, mass_b: float, velocity_a: Floats, velocity_b: Floats, normal: Floats, bounciness: float
) -> Velocities:
    """v' = b v_elastic + (1 - b) v_inelastic (documents, rule R9): u' = b (u - 2 (u . n) n).

    The tangential part of u shrinks by b as well, which Newton restitution does not do (see `newton.restitution`).
    """
    elastic_a, elastic_b = elastic(mass_a, mass_b, velocity_a, velocity_b, normal)
    common_a, common_b = inelastic(mass_a, mass_b, velocity_a, velocity_b)
    b = bounciness
    return b * elastic_a + (1 - b) * common_a, b * elastic_b + (1 - b) * common_b


def bounce_off_static(velocity: Floats, normal: Floats, bounciness: float) -> Floats:
    """v_B' = b (v_B - 2 (v_B . n) n): one-way, the limit of an infinite m_A at rest (documents, rule R13)."""
    return bounciness * (velocity - 2 * float(velocity @ normal) * normal)


def swap(velocity_a: Floats, velocity_b: Floats, normal: Floats) -> Velocities:
    """Elastic impact of equal masses: the normal components swap (documents, rule R12)."""
    normal_a, plane_a = split(velocity_a, normal)
    normal_b, plane_b = split(velocity_b, normal)
    return plane_a + normal_b, plane_b + normal_a


def kinetic_energy(mass_a: float, mass_b: float, velocity_a: Floats, velocity_b: Floats) -> tuple[float, float]:
    """Energy of the common motion and of the relative motion of two movable bodies [J]: E_cm + E_rel."""
    total = mass_a + mass_b
    centre = (mass_a * velocity_a + mass_b * velocity_b) / total
    relative = velocity_b - velocity_a
    return total * float(np.dot(centre, centre)) / 2, reduced_mass(mass_a, mass_b) * float(relative @ relative) / 2
