"""What rigid bodies in contact do to one another's velocities: impacts, lasting contacts, friction.

Impacts are those of `rigid_impact` (R14) and `rigid_newton`. Lasting contacts are inelastic along n, by sequential
impulses whose sums stay at or above 0; friction is Coulomb's within mu times that sum (law `nc`), or viscous (R5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from impactbench.reference import rigid_impact, rigid_newton
from impactbench.reference.rigid_body import Rigid, static
from impactbench.reference.rigid_contacts import Feature, Solid
from impactbench.reference.triples import apply, cross, dot, length, plus, scale, subtract
from impactbench.scenarios.records import ZERO, Contact, Law, Vector

Key = tuple[int, int]
"""Number of the pair, number of the feature."""


class Touch:
    """A contact point of this instant: its arms, and what it has pushed and rubbed so far [N s]."""

    def __init__(self, key: Key, a: Solid, b: Solid, feature: Feature, contact: Contact) -> None:
        self.key, self.a, self.b, self.contact = key, a, b, contact
        self.gap, self.normal, self.point = feature.gap, feature.normal, feature.point
        self.arm_a, self.arm_b = subtract(feature.point, a.position), subtract(feature.point, b.position)
        self.mass = 1 / self.inverse_mass(self.normal)
        self.push = 0.0
        self.rub = ZERO

    def inverse_mass(self, along: Vector) -> float:
        """n . K n [1/kg]: 1/m_A + 1/m_B + the spins' part (documents, rule R14)."""
        lever_a, lever_b = cross(self.arm_a, along), cross(self.arm_b, along)
        turning = dot(lever_a, apply(self.a.ease, lever_a)) + dot(lever_b, apply(self.b.ease, lever_b))
        return self.a.lightness + self.b.lightness + turning

    def velocity(self) -> Vector:
        """u [m/s] at the contact point."""
        a, b = self.a, self.b
        of_a = plus(a.velocity, 1.0, cross(a.spin, self.arm_a))
        return subtract(plus(b.velocity, 1.0, cross(b.spin, self.arm_b)), of_a)

    def parting(self) -> float:
        """u . n [m/s]."""
        return dot(self.velocity(), self.normal)

    def give(self, impulse: Vector) -> None:
        """The impulse [N s] to B and its opposite to A (documents, rule R6)."""
        for solid, arm, sign in ((self.a, self.arm_a, -1.0), (self.b, self.arm_b, 1.0)):
            if not solid.static:
                solid.velocity = plus(solid.velocity, sign * solid.lightness, impulse)
                solid.spin = plus(solid.spin, sign, apply(solid.ease, cross(arm, impulse)))

    def press(self, closing: float) -> float:
        """Bring u . n to no less than `-closing` [m/s], by a push only. Returns the change of velocity [m/s]."""
        total = max(0.0, self.push - self.mass * (self.parting() + closing))
        more = total - self.push
        self.push = total
        self.give(scale(more, self.normal))
        return abs(more) / self.mass

    def grip(self) -> float:
        """Coulomb: stop the sliding with at most mu times the push. Returns the change of velocity [m/s]."""
        u = self.velocity()
        sliding = plus(u, -dot(u, self.normal), self.normal)
        speed = length(sliding)
        if speed == 0:
            return 0.0
        inverse = self.inverse_mass(scale(1 / speed, sliding))
        total = plus(self.rub, -1 / inverse, sliding)
        size, limit = length(total), self.contact.friction * self.push
        if size > limit:
            total = scale(limit / size, total)
        more = subtract(total, self.rub)
        self.rub = total
        self.give(more)
        return length(more) * inverse

    def damp(self, step: float) -> None:
        """u_t falls by exp(-c k h), k = t . K t along the sliding (documents, rule R5: c/m, for particles)."""
        u = self.velocity()
        sliding = plus(u, -dot(u, self.normal), self.normal)
        speed = length(sliding)
        if speed > 0:
            inverse = self.inverse_mass(scale(1 / speed, sliding))
            self.give(scale(math.expm1(-self.contact.viscosity * inverse * step) / inverse, sliding))


def hold(touches: Sequence[Touch], closing: Sequence[float], rubbing: bool, tolerance: float, sweeps: int) -> float:
    """All lasting contacts at once, from their `push` and `rub` as first guess: u . n >= -closing [m/s] in the end.

    Returns the last change of velocity [m/s].
    """
    for touch in touches:
        touch.give(plus(touch.rub, touch.push, touch.normal))
    worst = 0.0
    for sweep in range(sweeps):
        worst = 0.0
        order = range(len(touches)) if sweep % 2 == 0 else range(len(touches) - 1, -1, -1)
        for i in order:
            worst = max(worst, touches[i].press(closing[i]))
            if rubbing and touches[i].contact.friction > 0:
                worst = max(worst, touches[i].grip())
        if worst <= tolerance:
            break
    return worst


def strike(touches: Sequence[Touch], law: Law) -> None:
    """One impact of a pair, at the middle of the points that meet at this instant: a box that lands flat does not turn.

    In a planar scene only the turn about its axis is kept; shapes are symmetric to the plane, so there is no other.
    """
    first, share = touches[0], 1 / len(touches)
    point, normal = ZERO, ZERO
    for touch in touches:
        point, normal = plus(point, share, touch.point), plus(normal, share, touch.normal)
    n = np.array(scale(1 / length(normal), normal))
    a, b, contact = _rigid(first.a, point), _rigid(first.b, point), first.contact
    if law == "doc":
        after = rigid_impact.bounce(a, b, n, contact.bounciness)
    else:
        after = rigid_newton.restitution(a, b, n, contact.bounciness, contact.friction)
    for solid, (velocity, spin) in zip((first.a, first.b), after, strict=True):
        if not solid.static:
            solid.velocity = (float(velocity[0]), float(velocity[1]), float(velocity[2]))
            solid.spin = (float(spin[0]), float(spin[1]), float(spin[2]))


def _rigid(solid: Solid, point: Vector) -> Rigid:
    arm = np.array(subtract(point, solid.position))
    if solid.static:
        return static(arm)
    axes = np.array(solid.axes)
    inertia = (axes * np.array(solid.principal)) @ axes.T
    return Rigid(solid.mass, inertia, np.array(solid.velocity), np.array(solid.spin), arm)
