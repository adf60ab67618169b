"""Impacts of explicit rigid bodies under the documents' law (documents, rule R14).

Every function returns velocities [m/s] and spins [rad/s] after the impact; the question whether the pair approaches is
left to `rigid_body.approaching`. `normal` is the unit impact normal from A to B. The two arms lead to one common point.

Write w for all velocities and spins, Q w for the inelastic case, R w for the elastic one. In the metric of kinetic
energy Q is the orthogonal projection onto the motions of the joined body, R a reflection that leaves those as they are.
So the impact is w' = Q w + b R (w - Q w), and E' = E(Q w) + b^2 (E - E(Q w)): no b in [0, 1] gains energy.
"""

from __future__ import annotations

import numpy as np
from impactbench.reference.rigid_body import (
    Motion,
    Motions,
    Rigid,
    apply_impulse,
    closing_velocity,
    parallel_axes,
    solve,
)
from impactbench.scenarios.trajectory import Floats


def effective_mass(a: Rigid, b: Rigid, normal: Floats) -> float:
    """1/(1/m_A + 1/m_B + (r_A x n) . I_A^-1 (r_A x n) + (r_B x n) . I_B^-1 (r_B x n)) [kg]."""
    if a.static and b.static:
        raise ValueError("static-static pairs are never handled (documents, rule R2)")
    inverse = 0.0
    for body in (a, b):
        lever = np.cross(body.arm, normal)
        inverse += 1 / body.mass + float(lever @ body.turned_by(lever))
    return 1 / inverse


def elastic(a: Rigid, b: Rigid, normal: Floats) -> Motions:
    """i_A = 2 m_eff (u . n) n at the contact point: u_n flips and kinetic energy is preserved (R7 and R14)."""
    closing = float(closing_velocity(a, b) @ normal)
    return apply_impulse(a, b, 2 * effective_mass(a, b, normal) * closing * normal)


def inelastic(a: Rigid, b: Rigid) -> Motions:
    """The bodies leave as if joined for an instant (R8 and R14); one-way, the movable body stops dead, spin included.

    Joined, they move with V = (m_A v_A + m_B v_B)/(m_A + m_B) and the spin w of their angular momentum about the common
    centre: I w = L, with I by parallel axes. Each leaves with V + w x c, its own centre lying at c, and with w.
    Equal centre velocities *and* equal spins would be another reading of R8: with no orbital part left, all angular
    momentum goes into spin. Two equal balls that graze would leave with 5/2 of their relative energy; joined, with 5/7.
    """
    if a.static and b.static:
        raise ValueError("static-static pairs are never handled (documents, rule R2)")
    if a.static or b.static:
        return (np.zeros(3), np.zeros(3)), (np.zeros(3), np.zeros(3))
    share_a, share_b = a.mass / (a.mass + b.mass), b.mass / (a.mass + b.mass)
    apart = a.arm - b.arm  # from the centre of A to the centre of B
    velocity = share_a * a.velocity + share_b * b.velocity
    centre_a, centre_b = -share_b * apart, share_a * apart
    momentum = _angular_momentum(a, centre_a, velocity) + _angular_momentum(b, centre_b, velocity)
    spin = solve(parallel_axes(a, centre_a) + parallel_axes(b, centre_b), momentum)
    return (velocity + np.cross(spin, centre_a), spin), (velocity + np.cross(spin, centre_b), spin.copy())


def _angular_momentum(body: Rigid, centre: Floats, common: Floats) -> Floats:
    """c x m (v - V) + I w [N m s], about the common centre of mass."""
    momentum: Floats = np.cross(centre, body.mass * (body.velocity - common)) + body.inertia @ body.spin
    return momentum


def bounce(a: Rigid, b: Rigid, normal: Floats, bounciness: float) -> Motions:
    """v' and w' = b elastic + (1 - b) inelastic (R9 and R14): at the contact point u' = b (u + K i_elastic), u_n' =
    -b u_n.

    For balls that meet head-on without spin this is R9; at an angle it is not: the joined balls turn, where R8 stops
    their relative motion altogether.
    """
    reflected, joined = elastic(a, b, normal), inelastic(a, b)
    return _between(reflected[0], joined[0], bounciness), _between(reflected[1], joined[1], bounciness)


def _between(reflected: Motion, joined: Motion, bounciness: float) -> Motion:
    b = bounciness
    return b * reflected[0] + (1 - b) * joined[0], b * reflected[1] + (1 - b) * joined[1]
