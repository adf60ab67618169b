"""Viscous friction of a prolonged contact (documents, rule R5): only the sliding is slowed, and never reversed.

`rate` [1/s] is c/m for a body on a static one and c/mu_r for the sliding between two movable bodies; c is in kg/s.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.impact import Velocities, apply_impulse, reduced_mass, split
from impactbench.scenarios.trajectory import Floats


def rate(viscosity: float, mass_a: float, mass_b: float = math.inf) -> float:
    """c/mu_r [1/s]; c/m_A if B is static."""
    return viscosity / reduced_mass(mass_a, mass_b)


def force_step(tangential: Floats, rate: float, step: float) -> Floats:
    """Sliding velocity [m/s] after one explicit step of the force F = -c v_t (documents, rule R5, first
    implementation).

    Beyond rate * step = 1 the step would reverse the sliding, which friction never does: such a step is refused.
    """
    if rate * step > 1:
        raise ValueError(f"viscous friction: c h/m = {rate * step:.3g} > 1 would reverse the sliding; shorten the step")
    return tangential * (1 - rate * step)


def damping_step(tangential: Floats, rate: float, step: float) -> Floats:
    """Sliding velocity [m/s] damped over a step of any length: v_t exp(-rate h) (documents, rule R5, second
    implementation).

    The exact solution of the same force, so both implementations agree as the step shrinks.
    """
    return tangential * math.exp(-rate * step)


@compiled
def as_damping(viscosity: float, ratio: float) -> float:
    """The c' [kg/s] whose damping over a step is the explicit force of c: exp(-c' h/mu_r) = 1 - ratio, ratio =
    c h/mu_r from 0 to 1.
    """
    if ratio >= 1:
        return math.inf
    return -math.log1p(-ratio) * viscosity / ratio


def distance(speed: float, rate: float, time: float) -> float:
    """(v_t0/rate)(1 - exp(-rate t)) [m], the way slid in `time`."""
    return -speed / rate * math.expm1(-rate * time)


def rub(
    mass_a: float,
    mass_b: float,
    velocity_a: Floats,
    velocity_b: Floats,
    normal: Floats,
    viscosity: float,
    step: float,
) -> Velocities:
    """Velocities [m/s] of a rubbing pair after a step: their relative sliding is damped, their momentum stays.

    One-way if a mass is infinite. The normal parts are not touched.
    """
    _, plane = split(velocity_b - velocity_a, normal)
    reduced = reduced_mass(mass_a, mass_b)
    lost = plane - damping_step(plane, viscosity / reduced, step)
    return apply_impulse(mass_a, mass_b, velocity_a, velocity_b, reduced * lost)
