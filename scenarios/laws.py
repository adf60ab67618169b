"""The two impact laws of point-like bodies, as the truths use them: pure functions of numbers.

Both are written through the centre-of-mass velocity V and the relative velocity u = v_B - v_A, because an impact keeps
V (R6) and only maps u to u'. Then v_A' = V - (m_B/M) u' and v_B' = V + (m_A/M) u', with M = m_A + m_B. An infinite mass
is a static body (R13).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from impactbench.scenarios.records import Law
from impactbench.scenarios.trajectory import Floats

Pair: TypeAlias = tuple[Floats, Floats]


def doc_relative(u: Floats, normal: Floats, b: float) -> Floats:
    """u' = b (u - 2 (u.n) n) (R9): the elastic impact mirrors u at the contact plane (R7), R8 leaves none."""
    mirrored: Floats = u - 2 * (u @ normal) * normal
    return b * mirrored


def nc_relative(u: Floats, normal: Floats, e: float) -> Floats:
    """u' = u - (1 + e) (u.n) n: Newton restitution on the normal component, no friction."""
    changed: Floats = u - (1 + e) * (u @ normal) * normal
    return changed


def impact(law: Law, masses: tuple[float, float], velocities: Pair, normal: Floats, bounciness: float) -> Pair:
    """Velocities [m/s] of A and B just after an impact with unit normal n from A to B.
    Masses [kg]; `math.inf` is static.
    """
    (m_a, m_b), (v_a, v_b) = masses, velocities
    share_a, share_b = mass_shares(m_a, m_b)
    relative = doc_relative if law == "doc" else nc_relative
    after = relative(v_b - v_a, normal, bounciness)
    common = share_a * v_a + share_b * v_b
    return common - share_b * after, common + share_a * after


def mass_shares(m_a: float, m_b: float) -> tuple[float, float]:
    """m_A/M and m_B/M; a single infinite mass takes all."""
    if math.isinf(m_a) and math.isinf(m_b):
        raise ValueError("two static bodies have no impact (R2)")
    if math.isinf(m_a):
        return 1.0, 0.0
    if math.isinf(m_b):
        return 0.0, 1.0
    return m_a / (m_a + m_b), m_b / (m_a + m_b)


def unit(vector: Floats) -> Floats:
    scaled: Floats = vector / np.linalg.norm(vector)
    return scaled
