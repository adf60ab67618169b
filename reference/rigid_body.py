"""Explicit rigid bodies in contact at one point: what both impact laws need to know of them.

Normals point from A to B, impulses [N s] act at the contact point, and arms [m] lead there from each centre of mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from impactbench.scenarios.records import Quaternion, Vector
from impactbench.scenarios.trajectory import Floats


@dataclass(frozen=True, eq=False)
class Rigid:
    """A rigid body at the instant of contact, in world axes.

    mass [kg], inertia [kg m^2] about the centre of mass, shape [3, 3], velocity [m/s] of that centre, spin [rad/s],
    arm [m]. A static body has mass `math.inf` and does not move (documents, rule R1); see `static`.
    """

    mass: float
    inertia: Floats
    velocity: Floats
    spin: Floats
    arm: Floats

    def __post_init__(self) -> None:
        if self.static:
            if np.any(self.velocity) or np.any(self.spin):
                raise ValueError("a static body cannot move")
        elif not self.mass > 0 or not np.linalg.eigvalsh(self.inertia)[0] > 0:
            raise ValueError("mass and all principal moments must be positive; give a thin rod's axis a small moment")

    @property
    def static(self) -> bool:
        return math.isinf(self.mass)

    def turned_by(self, moments: Floats) -> Floats:
        """Change of spin I^-1 (r x i) [rad/s] for moments of impulse [N m s], shape [3] or columns [3, n]."""
        if self.static:
            return np.zeros_like(moments)
        return solve(self.inertia, moments)

    def contact_velocity(self) -> Floats:
        """v + w x r [m/s]."""
        velocity: Floats = self.velocity + np.cross(self.spin, self.arm)
        return velocity


Motion = tuple[Floats, Floats]
"""Velocity [m/s] of the centre and spin [rad/s]."""

Motions = tuple[Motion, Motion]
"""Those of A and of B."""


def static(arm: Floats) -> Rigid:
    """A body that never moves: infinite mass and moments."""
    return Rigid(math.inf, np.diag([math.inf] * 3), np.zeros(3), np.zeros(3), arm)


def rotation(orientation: Quaternion) -> Floats:
    """Matrix of a unit quaternion (w, x, y, z), own to world axes: 1 + 2 w [q] + 2 [q]^2, with [q] p = q x p."""
    cross = cross_matrix(orientation[1:])
    return np.eye(3) + 2 * orientation[0] * cross + 2 * cross @ cross


def world_inertia(principal: Vector, orientation: Quaternion) -> Floats:
    """R diag(I_1, I_2, I_3) R^T [kg m^2]: principal moments along the body's own axes, seen in world axes."""
    axes = rotation(orientation)
    inertia: Floats = (axes * np.array(principal)) @ axes.T
    return inertia


def parallel_axes(body: Rigid, offset: Floats) -> Floats:
    """I + m (|c|^2 1 - c c^T) [kg m^2]: inertia about a point from which the centre lies at `offset` c [m]."""
    return body.inertia + body.mass * (float(offset @ offset) * np.eye(3) - np.outer(offset, offset))


def cross_matrix(vector: Sequence[float] | Floats) -> Floats:
    """[a] with [a] p = a x p."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def solve(matrix: Floats, right: Floats) -> Floats:
    """x with `matrix` x = `right`, for one or more columns; backward stable, unlike a product with the inverse."""
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def closing_velocity(a: Rigid, b: Rigid) -> Floats:
    """u = (v_B + w_B x r_B) - (v_A + w_A x r_A) [m/s], at the contact point."""
    return b.contact_velocity() - a.contact_velocity()


def approaching(a: Rigid, b: Rigid, normal: Floats) -> bool:
    """Whether u . n < 0 at the contact point; the centres may separate meanwhile. Other pairs are left alone (R14)."""
    return bool(closing_velocity(a, b) @ normal < 0)


def inverse_mass(a: Rigid, b: Rigid) -> Floats:
    """K [1/kg], shape [3, 3]: an impulse p on B and -p on A changes u by K p; K = sum of 1/m - [r] I^-1 [r].

    Symmetric, and positive definite as soon as one of the bodies is movable.
    """
    if a.static and b.static:
        raise ValueError("static-static pairs are never handled (documents, rule R2)")
    return _inverse_mass(a) + _inverse_mass(b)


def _inverse_mass(body: Rigid) -> Floats:
    arm = cross_matrix(body.arm)
    inverse: Floats = np.eye(3) / body.mass - arm @ body.turned_by(arm)
    return inverse


def apply_impulse(a: Rigid, b: Rigid, impulse_a: Floats) -> Motions:
    """v' = v + i/m and w' = w + I^-1 (r x i), with i_B = -i_A at the same point (documents, rules R6 and R14).

    Momentum and angular momentum stay, about any point; a static partner takes its part unmoved.
    """
    return _pushed(a, impulse_a), _pushed(b, -impulse_a)


def _pushed(body: Rigid, impulse: Floats) -> Motion:
    return body.velocity + impulse / body.mass, body.spin + body.turned_by(np.cross(body.arm, impulse))


def kinetic_energy(body: Rigid) -> float:
    """m v^2/2 + w . I w/2 [J]; that of a static body is 0."""
    if body.static:
        return 0.0
    return (body.mass * float(body.velocity @ body.velocity) + float(body.spin @ body.inertia @ body.spin)) / 2
