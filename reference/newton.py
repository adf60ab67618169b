"""The engines' impact law, the second law of the harness: Newton restitution on the normal, a Coulomb impulse in the
plane.
"""

from __future__ import annotations

import math

from impactbench.reference.impact import Velocities, apply_impulse, reduced_mass, split
from impactbench.scenarios.trajectory import Floats


def restitution(
    mass_a: float,
    mass_b: float,
    velocity_a: Floats,
    velocity_b: Floats,
    normal: Floats,
    restitution: float,
    friction: float = 0.0,
) -> Velocities:
    """Velocities [m/s] after u_n' = -e u_n, with a tangential impulse of at most mu times the normal one.

    i_n = (1 + e) mu_r |u_n| and i_t = min(mu i_n, mu_r |u_t|) against the sliding: friction may stop it, never
    reverse it.
    """
    along, plane = split(velocity_b - velocity_a, normal)
    reduced = reduced_mass(mass_a, mass_b)
    impulse_a = (1 + restitution) * reduced * along
    sliding = math.sqrt(float(plane @ plane))
    if friction > 0 and sliding > 0:
        limit = friction * math.sqrt(float(impulse_a @ impulse_a))
        impulse_a = impulse_a + min(limit / sliding, reduced) * plane
    return apply_impulse(mass_a, mass_b, velocity_a, velocity_b, impulse_a)
