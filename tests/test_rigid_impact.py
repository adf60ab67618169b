"""Properties of rule R14 for explicit rigid bodies, to round-off.

Tolerances. One operation errs by at most eps/2 of its result, a solved 3x3 system by about 10 eps of its right-hand
side (backward stable); no chain below is longer than about 60 of either. So ROUND = 256 eps times a sum of magnitudes
bounds every difference that theory says is zero. Conserved sums need no more. A *velocity* passes through I^-1, which
enlarges the errors of its right-hand side by the condition number of I: at most 100 for the boxes drawn here, whose
edges differ by a factor of 10 at most. See also `stiffness`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from impactbench.reference import rigid_impact
from impactbench.reference.rigid_body import (
    Motions,
    Rigid,
    closing_velocity,
    inverse_mass,
    kinetic_energy,
    static,
    world_inertia,
)

ROUND = 256 * np.finfo(float).eps
CONDITION = 100
patient = settings(deadline=None)  # a busy machine is no failure of the law

fractions = st.floats(0, 1)
vectors = st.tuples(*[st.floats(-5, 5)] * 3).map(np.array)
arms = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array)
ratios = st.floats(-2, 2).map(lambda exponent: 10.0**exponent)


@st.composite
def rotations(draw):
    """Unit quaternions: no rejection, all of them."""
    a, b, c = draw(st.floats(0, 1)), draw(st.floats(0, 2 * math.pi)), draw(st.floats(0, 2 * math.pi))
    p, q = math.sqrt(a), math.sqrt(1 - a)
    return p * math.cos(b), p * math.sin(b), q * math.cos(c), q * math.sin(c)


@st.composite
def normals(draw):
    height, angle = draw(st.floats(-1, 1)), draw(st.floats(0, 2 * math.pi))
    ring = math.sqrt(1 - height**2)
    raw = np.array([ring * math.cos(angle), ring * math.sin(angle), height])
    return raw / np.linalg.norm(raw)


@st.composite
def bodies(draw):
    """A box with half edges in [0.1, 1] m, turned anyhow; the arm may lead anywhere within 1 m."""
    mass, (x, y, z) = draw(ratios), draw(st.tuples(*[st.floats(0.1, 1)] * 3))
    moments = (mass * (y * y + z * z) / 3, mass * (x * x + z * z) / 3, mass * (x * x + y * y) / 3)
    return Rigid(mass, world_inertia(moments, draw(rotations())), draw(vectors), draw(vectors), draw(arms))


@st.composite
def impacts(draw, one_way=False):
    """(A, B, n, b) of an approaching pair: a separating draw is turned around. One-way, A is static."""
    a, b, n = static(draw(arms)) if one_way else draw(bodies()), draw(bodies()), draw(normals())
    closing = closing_velocity(a, b) @ n
    assume(abs(closing) > 1e-9)
    return a, b, n if closing < 0 else -n, draw(fractions)


either = st.one_of(impacts(), impacts(one_way=True))


def after(a: Rigid, b: Rigid, motions: Motions) -> tuple[Rigid, Rigid]:
    (v_a, w_a), (v_b, w_b) = motions
    return replace(a, velocity=v_a, spin=w_a), replace(b, velocity=v_b, spin=w_b)


def bounced(a: Rigid, b: Rigid, normal, bounciness: float) -> tuple[Rigid, Rigid]:
    return after(a, b, rigid_impact.bounce(a, b, normal, bounciness))


def energy(*pair: Rigid) -> float:
    return sum(kinetic_energy(body) for body in pair)


def speed(*pair: Rigid) -> float:
    """Sum of |v| + |w| [m/s]: arms and bodies are of the order of 1 m."""
    return 1e-12 + sum(float(np.linalg.norm(body.velocity) + 2 * np.linalg.norm(body.spin)) for body in pair)


def momentum_scale(*pair: Rigid) -> float:
    return sum(body.mass * speed(body) * 4 for body in pair)  # within 4 m of the reference point; |I| < m * 1 m^2


def angular_momentum(pair: tuple[Rigid, Rigid], point) -> np.ndarray:
    """About a point [m], seen from the contact point."""
    return sum(np.cross(-x.arm - point, x.mass * x.velocity) + x.inertia @ x.spin for x in pair)


def stiffness(a: Rigid, b: Rigid) -> float:
    """How far a velocity's error may exceed eps of the velocities: CONDITION, times the ratio of the masses, since the
    heavy body's momentum is rounded and the light one's velocity follows from it.
    """
    heavy = max(x.mass for x in (a, b) if not x.static)
    return CONDITION * heavy / min(a.mass, b.mass)


def close(actual, expected, scale) -> bool:
    return bool(np.all(np.abs(np.asarray(actual) - np.asarray(expected)) <= ROUND * scale))


def same(left: tuple[Rigid, Rigid], right: tuple[Rigid, Rigid], scale: float) -> bool:
    return all(
        close(x.velocity, y.velocity, scale) and close(x.spin, y.spin, scale / 0.1)  # a spin is a speed over >= 0.1 m
        for x, y in zip(left, right, strict=True)
    )


@patient
@given(impacts(), arms)
def test_momentum_and_angular_momentum_about_any_point_are_preserved(case, point):
    a, b, n, bounciness = case
    later = bounced(a, b, n, bounciness)
    scale = momentum_scale(a, b, *later)
    assert close(sum(x.mass * x.velocity for x in later), a.mass * a.velocity + b.mass * b.velocity, scale)
    assert close(angular_momentum(later, point), angular_momentum((a, b), point), scale)


@patient
@given(either)
def test_energy_above_that_of_the_joined_body_scales_by_b_squared(case):
    # E' = E_0 + b^2 (E - E_0): sharper than the convexity bound (1 - b) E_0 + b E, and never above E, as E_0 <= E.
    a, b, n, bounciness = case
    before, joined = energy(a, b), energy(*bounced(a, b, n, 0.0))
    scale = stiffness(a, b) * before
    assert joined <= before + ROUND * scale
    later = energy(*bounced(a, b, n, bounciness))
    assert close(later, joined + bounciness**2 * (before - joined), scale)
    assert later <= (1 - bounciness) * joined + bounciness * before + ROUND * scale
    assert close(energy(*bounced(a, b, n, 1.0)), before, scale)


@patient
@given(either)
def test_normal_restitution_at_the_contact_point_is_b_and_joined_bodies_do_not_part(case):
    a, b, n, bounciness = case
    later = bounced(a, b, n, bounciness)
    scale = stiffness(a, b) * speed(a, b)
    assert close(closing_velocity(*later) @ n, -bounciness * (closing_velocity(a, b) @ n), scale)
    assert close(closing_velocity(*bounced(a, b, n, 0.0)), 0, scale)


@patient
@given(either)
def test_bouncing_is_a_reflection_of_what_the_joined_body_lacks(case):
    # Twice elastic is nothing; joining after a bounce of any b gives the same joined body.
    a, b, n, bounciness = case
    once = bounced(a, b, n, 1.0)
    scale = stiffness(a, b) * speed(a, b, *once)
    assert same(bounced(*once, n, 1.0), (a, b), scale)
    assert same(bounced(*bounced(a, b, n, bounciness), n, 0.0), bounced(a, b, n, 0.0), scale)


@patient
@given(either)
def test_the_effective_mass_is_the_normal_part_of_the_inverse_mass_matrix(case):
    a, b, n, _ = case
    inverse = inverse_mass(a, b)
    assert rigid_impact.effective_mass(a, b, n) == pytest.approx(1 / (n @ inverse @ n), rel=ROUND * CONDITION)


@patient
@given(impacts())
def test_swapping_the_bodies_changes_nothing(case):
    a, b, n, bounciness = case
    swapped = bounced(b, a, -n, bounciness)
    assert same(swapped[::-1], bounced(a, b, n, bounciness), stiffness(a, b) * speed(a, b))


@patient
@given(impacts(), rotations(), st.booleans())
def test_rotating_or_mirroring_changes_only_the_frame(case, orientation, mirror):
    a, b, n, bounciness = case
    turn = world_frame(orientation) * (-1 if mirror else 1)
    handed = np.linalg.det(turn)  # spins are axial: a mirror image turns the other way

    def moved(x: Rigid) -> Rigid:
        return Rigid(x.mass, turn @ x.inertia @ turn.T, turn @ x.velocity, handed * turn @ x.spin, turn @ x.arm)

    left = bounced(moved(a), moved(b), turn @ n, bounciness)
    right = bounced(a, b, n, bounciness)
    assert same(left, (moved(right[0]), moved(right[1])), stiffness(a, b) * speed(a, b))


def world_frame(orientation) -> np.ndarray:
    """Axes by Rodrigues' formula, not by the quaternion's matrix."""
    axis = np.array(orientation[1:])
    length = math.hypot(*axis)
    if length < 1e-100:
        return np.eye(3)
    half, axis = math.atan2(length, orientation[0]), axis / length
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + math.sin(2 * half) * cross + (1 - math.cos(2 * half)) * cross @ cross


@patient
@given(impacts(), vectors, vectors)
def test_a_common_motion_of_both_as_one_body_passes_through(case, velocity, spin):
    # A common velocity, and even a common rotation: the joined body carries it, a reflection leaves it.
    a, b, n, bounciness = case

    def carried(x: Rigid) -> Rigid:
        return replace(x, velocity=x.velocity + velocity + np.cross(spin, -x.arm), spin=x.spin + spin)

    moved, rest = (carried(a), carried(b)), bounced(a, b, n, bounciness)
    scale = stiffness(a, b) * speed(a, b, *moved)
    assert same(bounced(*moved, n, bounciness), (carried(rest[0]), carried(rest[1])), scale)
