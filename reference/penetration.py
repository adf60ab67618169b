"""Non-penetration (documents, rule R4): one-sided, present only while bodies overlap, on positions [m].

`normal` is the unit normal from A to B and `overlap` the depth d [m]; a static body has mass `math.inf`.
"""

from __future__ import annotations

import math

from impactbench.reference.impact import reduced_mass
from impactbench.scenarios.trajectory import Floats

Positions = tuple[Floats, Floats]


def project(
    mass_a: float, mass_b: float, position_a: Floats, position_b: Floats, normal: Floats, overlap: float
) -> Positions:
    """The closest valid positions: dx_A = -d n m_B/(m_A + m_B), dx_B = +d n m_A/(m_A + m_B).

    Least in the mass-weighted sum of squares, so the common centre of mass stays. One-way: the movable body alone
    moves by d.
    """
    depth = max(0.0, overlap)
    reduced = reduced_mass(mass_a, mass_b)
    return position_a - depth * reduced / mass_a * normal, position_b + depth * reduced / mass_b * normal


def revert(position_a: Floats, position_b: Floats, valid_a: Floats, valid_b: Floats, overlap: float) -> Positions:
    """The last valid positions if the bodies overlap now, else the present ones. A static body's two positions are
    one.
    """
    return (valid_a, valid_b) if overlap > 0 else (position_a, position_b)


def touching_speed(approach: float, acceleration: float, overlap: float) -> float:
    """Approach speed [m/s] a body had when it touched, if it is found `overlap` deep with `approach` now: the lift's
    compensation.

    Projection lifts by d against `acceleration` a (the pull into the contact, [m/s^2]) and would add m a d. Going
    back along the parabola takes that from the normal motion: sqrt(s^2 - 2 a d). What exceeds it, m (a d - s^2/2),
    stays as the bound.
    """
    return math.sqrt(max(0.0, approach**2 - 2 * acceleration * overlap))
