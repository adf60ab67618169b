"""Newton restitution and Coulomb friction of rigid bodies: its definition as properties, balls in closed form, and the
energy it may create. Tolerances as in `test_rigid_impact`; friction adds a search that ends within 4 eps of the cone.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from impactbench.reference import newton, rigid_impact, rigid_newton
from impactbench.reference.rigid_body import Rigid, closing_velocity, inverse_mass, static
from test_rigid_closed_forms import X, Y, Z, ball, near
from test_rigid_impact import (
    ROUND,
    after,
    angular_momentum,
    arms,
    close,
    either,
    energy,
    fractions,
    impacts,
    momentum_scale,
    normals,
    patient,
    ratios,
    rotations,
    same,
    speed,
    stiffness,
    vectors,
    world_frame,
)

frictions = st.one_of(st.just(0.0), st.floats(0.001, 3))


def struck(a: Rigid, b: Rigid, normal, e: float, mu: float) -> tuple[Rigid, Rigid]:
    return after(a, b, rigid_newton.restitution(a, b, normal, e, mu))


def split(vector, normal) -> tuple[float, np.ndarray]:
    along = float(vector @ normal)
    return along, vector - along * normal


@patient
@given(impacts(), frictions, arms)
def test_momentum_and_angular_momentum_about_any_point_are_preserved(case, mu, point):
    a, b, n, e = case
    later = struck(a, b, n, e, mu)
    scale = momentum_scale(a, b, *later)
    assert close(sum(x.mass * x.velocity for x in later), a.mass * a.velocity + b.mass * b.velocity, scale)
    assert close(angular_momentum(later, point), angular_momentum((a, b), point), scale)


@patient
@given(either, frictions)
def test_newton_and_coulomb_hold_at_the_contact_point(case, mu):
    a, b, n, e = case
    later = struck(a, b, n, e, mu)
    before_n = float(closing_velocity(a, b) @ n)
    after_n, slip = split(closing_velocity(*later), n)
    scale = stiffness(a, b) * speed(a, b, *later)
    assert close(after_n, -e * before_n, scale)
    impulse_n, impulse_t = split(b.mass * (later[1].velocity - b.velocity), n)
    push = np.linalg.norm(impulse_t)
    rounding = ROUND * b.mass * scale
    assert impulse_n > -rounding
    assert push <= mu * impulse_n + (1 + mu) * rounding
    if push < mu * impulse_n - (1 + mu) * rounding:
        assert close(slip, 0, scale)  # strictly inside the cone: sticks
    else:  # on the cone: against the slip that is left
        lost = push * np.linalg.norm(slip)
        assert abs(float(impulse_t @ slip) + lost) <= (1 + mu) * rounding * (np.linalg.norm(slip) + scale)


@patient
@given(either, frictions)
def test_energy_changes_by_the_work_of_the_impulse_and_never_grows_where_it_cannot(case, mu):
    a, b, n, e = case
    later, dead, smooth = struck(a, b, n, e, mu), struck(a, b, n, 0.0, mu), struck(a, b, n, e, 0.0)
    impulse = b.mass * (later[1].velocity - b.velocity)
    work = float(impulse @ (closing_velocity(a, b) + closing_velocity(*later))) / 2
    scale = stiffness(a, b) * (energy(a, b) + energy(*later))
    assert close(energy(*later) - energy(a, b), work, scale)
    # e = 0: p . u' <= 0 by Coulomb, so the work p . (u + u')/2 = p . u' - p . K p/2 < 0.
    assert energy(*dead) <= energy(a, b) + ROUND * scale
    assert energy(*smooth) <= energy(a, b) + ROUND * scale


@patient
@given(either)
def test_without_friction_and_losses_it_is_the_elastic_case_of_the_documents(case):
    a, b, n, _ = case
    scale = stiffness(a, b) * speed(a, b)
    assert same(struck(a, b, n, 1.0, 0.0), after(a, b, rigid_impact.elastic(a, b, n)), scale)


@patient
@given(impacts(), st.sampled_from([0.0, 0.3, 30.0]), rotations(), st.booleans(), vectors, vectors)
def test_only_the_frame_changes(case, mu, orientation, mirror, velocity, spin):
    a, b, n, e = case
    turn = world_frame(orientation) * (-1 if mirror else 1)
    handed = np.linalg.det(turn)  # spins are axial

    def moved(x: Rigid) -> Rigid:
        v, w = x.velocity + velocity + np.cross(spin, -x.arm), x.spin + spin  # a common motion of both as one body
        return Rigid(x.mass, turn @ x.inertia @ turn.T, turn @ v, handed * turn @ w, turn @ x.arm)

    right = struck(a, b, n, e, mu)
    # The root of the cone's equation is found to 4 eps of its range, its slope as small as the contact is coupled.
    scale = 100 * stiffness(a, b) * speed(a, b, moved(a), moved(b), *right)
    assert same(struck(moved(a), moved(b), turn @ n, e, mu), (moved(right[0]), moved(right[1])), scale)
    assert same(struck(b, a, -n, e, mu)[::-1], right, scale)


@patient
@given(impacts(one_way=True), frictions)
def test_one_way_is_the_limit_of_a_heavy_partner(case, mu):
    a, b, n, e = case
    heavy = Rigid(1e12 * b.mass, 1e12 * b.mass * np.eye(3), 0 * X, 0 * X, a.arm)
    error = 1e-12 * (1 + 3) * stiffness(a, b) / ROUND  # K_A/K_B, with |r_A|^2 <= 3 m^2
    one, two = struck(a, b, n, e, mu), struck(heavy, b, n, e, mu)
    assert same(one[1:], two[1:], 100 * (error + stiffness(a, b)) * speed(b, *one))


# Balls


@patient
@given(ratios, vectors, vectors, normals(), fractions, st.floats(0.01, 1), st.floats(0.1, 1))
def test_a_ball_on_a_plane_slides_or_rolls(mass, velocity, spin, n, e, mu, radius):
    n = n if velocity @ n < 0 else -n
    b = ball(mass, radius, velocity, spin, -radius * n)
    fall, slip = split(closing_velocity(static(0 * X), b), n)
    later = struck(static(0 * X), b, n, e, mu)[1]
    u, scale = float(np.linalg.norm(slip)), 100 * speed(b)
    # K = (1/m + R^2/I) = 7/(2 m) in the plane, 1/m along n: sticking takes p_t = 2/7 m u_t, the cone allows
    # mu (1 + e) m |u_n|.
    slides = u > 0 and u >= 7 / 2 * mu * (1 + e) * -fall
    push = -slip / u * mu * (1 + e) * -fall if slides else -2 / 7 * slip  # impulse per mass
    assert close(later.velocity, velocity + push - (1 + e) * fall * n, scale)
    assert close(later.spin, spin + 5 / (2 * radius) * np.cross(-n, push), scale / radius)
    assert energy(later) <= energy(b) + ROUND * 100 * energy(b)  # K n is along n


def test_a_ball_without_spin_leaves_rolling_with_five_sevenths_of_its_speed():
    b = ball(2.0, 0.1, [3.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, -0.1])
    (_, _), (velocity, spin) = rigid_newton.restitution(static(0 * X), b, Z, 0.5, 1.0)  # 3 < 7/2 * 1.5
    assert velocity == near([15 / 7, 0.0, 0.5])
    assert spin == near([0.0, 150 / 7, 0.0])
    (_, _), (velocity, spin) = rigid_newton.restitution(static(0 * X), b, Z, 0.5, 0.2)  # 3 > 7/2 * 0.3
    assert velocity == near([2.7, 0.0, 0.5])
    assert spin == near([0.0, 7.5, 0.0])


@patient
@given(ratios, ratios, vectors, vectors, normals(), fractions)
def test_balls_without_friction_are_particles(m_a, m_b, v_a, v_b, n, e):
    n = n if (v_b - v_a) @ n < 0 else -n
    a, b = ball(m_a, 0.2, v_a, 0 * X, 0.2 * n), ball(m_b, 0.3, v_b, 0 * X, -0.3 * n)
    expected = newton.restitution(m_a, m_b, v_a, v_b, n, e)
    assert close([x.velocity for x in struck(a, b, n, e, 0.0)], expected, stiffness(a, b) * speed(a, b))


# The known failure


def test_a_rod_that_slides_in_under_itself_gains_energy():
    # m = 1, L = 1 at 45 deg, arm (-1, 0, -1)/sqrt(8), I = 1/12: K = (2.5, -1.5; -1.5, 2.5) in (x, z), whose inverse is
    # (2.5, 1.5; 1.5, 2.5)/4. u = (0.6, -1), e = 1: p = K^-1 (-0.6, 2) = (0.375, 1.025), inside mu = 0.5. The contact
    # sticks, u' = (0, 1), work = p . (u + u')/2 = 0.375 * 0.3 = 0.1125 on top of (0.36 + 1)/2 = 0.68: + 17 %.
    arm = np.array([-1.0, 0.0, -1.0]) / math.sqrt(8)
    rod = Rigid(1.0, np.eye(3) / 12, np.array([0.6, 0.0, -1.0]), 0 * X, arm)
    floor = static(0 * X)
    assert inverse_mass(floor, rod)[::2, ::2] == near(np.array([[2.5, -1.5], [-1.5, 2.5]]))
    later = struck(floor, rod, Z, 1.0, 0.5)[1]
    assert later.velocity - rod.velocity == near([0.375, 0.0, 1.025])
    assert energy(later) - energy(rod) == near(0.1125)
    # Less friction or restitution, or a slide outwards: no gain.
    for e, mu in ((1.0, 0.0), (0.0, 0.5)):
        assert energy(struck(floor, rod, Z, e, mu)[1]) <= energy(rod) * (1 + 1e-15)
    outwards = replace(rod, velocity=rod.velocity * [-1.0, 1.0, 1.0])
    assert energy(struck(floor, outwards, Z, 1.0, 0.5)[1]) < energy(rod)


def test_the_search_ends_for_every_friction():
    # K of a needle differs by up to 1e6 between its directions, and the slip turns while friction acts. False position
    # that never halves the end that stays would need more than the bound here.
    axis, velocity, arm = np.array([3.0, 4.0, 12.0]) / 13, np.array([1.0, 0.0, -1.0]), np.array([0.3, -0.2, -1.0])
    across = 1e-2 * (np.eye(3) - np.outer(axis, axis))
    for axial, mu, e in itertools.product((1e-2, 1e-4, 1e-6, 1e-8), 10.0 ** np.arange(-8, 3.5, 0.5), (0.0, 0.5, 1.0)):
        needle = Rigid(1.0, across + axial * np.eye(3), velocity, Y, arm)
        before, later = (
            closing_velocity(static(0 * X), needle),
            closing_velocity(*struck(static(0 * X), needle, Z, e, mu)),
        )
        assert later[2] == pytest.approx(-e * before[2], abs=1e-6), (axial, mu, e)  # eps, enlarged by that 1e6 and arms
