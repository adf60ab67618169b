"""Rule R14 against closed forms derived here line by line, its limits, and its relation to R7-R9."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from impactbench.reference import impact, rigid_impact, rigid_newton
from impactbench.reference.rigid_body import (
    Rigid,
    approaching,
    closing_velocity,
    rotation,
    static,
    world_inertia,
)
from test_rigid_impact import (
    ROUND,
    after,
    bodies,
    bounced,
    close,
    energy,
    fractions,
    impacts,
    normals,
    patient,
    ratios,
    rotations,
    speed,
    stiffness,
    vectors,
    world_frame,
)

X, Y, Z = np.eye(3)


def near(expected):
    """To 1e-12: some tens of operations on numbers near 1, with well-conditioned axes."""
    return pytest.approx(expected, rel=1e-12, abs=1e-12)


def ball(mass: float, radius: float, velocity, spin, arm) -> Rigid:
    return Rigid(mass, 0.4 * mass * radius**2 * np.eye(3), np.array(velocity), np.array(spin), np.array(arm))


# The world's inertia


@patient
@given(rotations())
def test_a_quaternion_turns_by_its_angle_about_its_axis(orientation):
    assert close(rotation(orientation), world_frame(orientation), 4)


@patient
@given(rotations(), vectors)
def test_principal_moments_belong_to_the_turned_axes(orientation, spin):
    inertia, axes = world_inertia((1.0, 2.0, 3.0), orientation), rotation(orientation)
    assert close(inertia @ axes, axes * [1.0, 2.0, 3.0], 3)
    own = axes.T @ spin
    assert close(spin @ inertia @ spin, own[0] ** 2 + 2 * own[1] ** 2 + 3 * own[2] ** 2, 3 * float(spin @ spin) + 1e-12)


# One-way and its limit


@patient
@given(impacts(one_way=True))
def test_one_way_inelastic_stops_dead_and_elastic_acts_along_n(case):
    a, b, n, bounciness = case
    stopped, struck = bounced(a, b, n, 0.0)[1], bounced(a, b, n, 1.0)[1]
    assert not stopped.velocity.any()
    assert not stopped.spin.any()
    impulse = b.mass * (struck.velocity - b.velocity)
    assert close(np.cross(n, impulse), 0, b.mass * speed(b, struck))
    twist = b.inertia @ (struck.spin - b.spin)
    assert close(twist, np.cross(b.arm, impulse), 4 * b.mass * speed(b, struck))
    between = bounced(a, b, n, bounciness)[1]
    assert close(between.velocity, bounciness * struck.velocity, speed(struck))
    assert close(between.spin, bounciness * struck.spin, speed(struck))


@patient
@given(bodies(), impacts(one_way=True), st.sampled_from([1e4, 1e8, 1e12]))
def test_one_way_is_the_limit_of_a_heavy_partner(heavy, case, ratio):
    a, b, n, _ = case
    # Mass *and* inertia grow: with a finite inertia the heavy partner would still be set spinning.
    scale = ratio * b.mass / heavy.mass
    heavy = replace(heavy, mass=ratio * b.mass, inertia=scale * heavy.inertia, velocity=0 * X, spin=0 * X, arm=a.arm)
    one, two = bounced(a, b, n, 1.0)[1], bounced(heavy, b, n, 1.0)[1]
    change = np.concatenate((one.velocity - b.velocity, one.spin - b.spin))
    error = np.concatenate((two.velocity - one.velocity, two.spin - one.spin))
    # The impulse is 2 |u_n|/(k_A + k_B), so the change falls short by the factor k_B/(k_A + k_B), at most k_A/k_B off.
    k_a, k_b = 1 / rigid_impact.effective_mass(heavy, static(b.arm), n), 1 / rigid_impact.effective_mass(a, b, n)
    assert np.linalg.norm(error) <= k_a / k_b * np.linalg.norm(change) + ROUND * 100 * speed(b, one)
    # Joined: V = m_B v_B/(m_A + m_B), and the spin is at most |L|/I_A, with L about the common centre.
    glued = bounced(heavy, b, n, 0.0)[1]
    apart = np.linalg.norm(heavy.arm - b.arm)
    least = np.linalg.eigvalsh(heavy.inertia)[0]
    momentum = apart * b.mass * np.linalg.norm(b.velocity) + np.linalg.norm(b.inertia @ b.spin)
    spin = momentum / least * (1 + 1e-9) + 1e-300
    assert np.linalg.norm(glued.spin) <= spin
    assert np.linalg.norm(glued.velocity) <= np.linalg.norm(b.velocity) / ratio + spin * apart + 1e-300


def test_two_static_bodies_are_refused():
    for refuse in (
        lambda: rigid_impact.bounce(static(X), static(-X), X, 1.0),
        lambda: rigid_impact.inelastic(static(X), static(-X)),
        lambda: rigid_newton.restitution(static(X), static(-X), X, 1.0),
    ):
        with pytest.raises(ValueError, match="static-static"):
            refuse()
    with pytest.raises(ValueError, match="cannot move"):
        replace(static(X), velocity=X)
    with pytest.raises(ValueError, match="positive"):
        replace(ball(1.0, 0.1, X, X, X), inertia=np.diag([1.0, 1.0, 0.0]))


# Balls: where R14 is R7-R9, and where not


@patient
@given(ratios, ratios, vectors, vectors, normals(), st.floats(0.1, 1), st.floats(0.1, 1), fractions)
def test_balls_without_spin(m_a, m_b, v_a, v_b, n, r_a, r_b, bounciness):
    n = n if (v_b - v_a) @ n < 0 else -n
    a, b = ball(m_a, r_a, v_a, 0 * X, r_a * n), ball(m_b, r_b, v_b, 0 * X, -r_b * n)
    scale = stiffness(a, b) * speed(a, b)
    # Elastic at any angle, as the arms have no moment about n; and head-on for every b: nothing makes the joined balls
    # turn.
    elastic = impact.elastic(m_a, m_b, v_a, v_b, n)
    assert close([x.velocity for x in bounced(a, b, n, 1.0)], elastic, scale)
    along = [replace(x, velocity=float(x.velocity @ n) * n) for x in (a, b)]
    head_on = impact.bounce(m_a, m_b, along[0].velocity, along[1].velocity, n, bounciness)
    assert close([x.velocity for x in bounced(*along, n, bounciness)], head_on, scale)
    # At an angle R8 ends all relative motion, while the joined balls turn, D = R_A + R_B apart: from
    # L = mu_r D n x u_p and I = mu_r D^2 + I_A + I_B the centres keep w x D n = u_p mu_r D^2/I.
    plane = impact.split(v_b - v_a, n)[1]
    orbital = impact.reduced_mass(m_a, m_b) * (r_a + r_b) ** 2
    keep = orbital / (orbital + 0.4 * m_a * r_a**2 + 0.4 * m_b * r_b**2)
    left, right = bounced(a, b, n, 0.0)
    assert close(right.velocity - left.velocity, keep * plane, scale)


def test_equal_centre_velocities_and_spins_would_create_energy():
    # Grazing balls m, R, at relative speed u, L = m/2 2R u: into spin alone, w = L/(2 * 2/5 m R^2) = 5 u/(4 R), so
    # E = 2/5 m R^2 w^2 = 5/8 m u^2 against the m u^2/4 there was. Joined: I = m/2 (2R)^2 + 4/5 m R^2 = 14/5 m R^2,
    # E = L^2/(2 I) = 5/28 m u^2.
    u, r = 2.0, 0.1
    a, b = ball(1.0, r, -u / 2 * Y, 0 * X, r * X), ball(1.0, r, u / 2 * Y, 0 * X, -r * X)
    assert energy(a, b) == near(u**2 / 4)
    spun = 5 * u / (4 * r) * Z
    alike = after(a, b, ((0 * X, spun), (0 * X, spun)))
    assert energy(*alike) == near(5 / 2 * energy(a, b))
    assert energy(*bounced(a, b, X, 0.0)) == near(5 / 7 * energy(a, b))


def test_contacts_may_approach_while_centres_separate():
    # B leaves at 1 m/s but its near end swings back at 3 m/s * 1 m.
    a = ball(1.0, 0.1, 0 * X, 0 * X, 0.1 * X)
    b = Rigid(1.0, np.eye(3), X, 3 * Z, np.array([-0.1, 1.0, 0.0]))
    assert (b.velocity - a.velocity) @ X > 0
    assert approaching(a, b, X)
    assert not approaching(a, replace(b, spin=Z), X)  # resting at the contact
    assert closing_velocity(*bounced(a, b, X, 0.5)) @ X == near(1.0)
    assert not approaching(*bounced(a, b, X, 0.5), X)


# Rods and boxes


def test_a_particle_hits_the_end_of_a_resting_rod_of_its_mass():
    # m = M = L = v = 1, I = 1/12, arm 1/2: J = 2/(1 + 1 + 12/4) = 2/5, so 3/5 and 2/5, and w = J/2 * 12 = 12/5.
    # Joined: V = 1/2, centre L/4 from either, I = 1/12 + 2/16 = 5/24, L = 1/4: w = 6/5; 1/2 +- 6/5 * 1/4.
    point = Rigid(1.0, 1e-18 * np.eye(3), X, 0 * X, 0 * X)
    rod = Rigid(1.0, np.diag([1 / 12, 1e-6, 1 / 12]), 0 * X, 0 * X, np.array([0.0, -0.5, 0.0]))
    particle, struck = bounced(point, rod, X, 1.0)
    assert (particle.velocity[0], struck.velocity[0], struck.spin[2]) == near((3 / 5, 2 / 5, 12 / 5))
    particle, struck = bounced(point, rod, X, 0.0)
    assert (particle.velocity[0], struck.velocity[0], struck.spin[2]) == near((4 / 5, 1 / 5, 6 / 5))


def test_a_blow_at_the_centre_of_percussion_leaves_the_far_end_at_rest():
    # V = J/M and w = 12 J s/(M L^2): the far end, L/2 away, moves with V - w L/2 = 0 for s = L/6, whatever the blow.
    for mass, e in itertools.product((0.1, 1.0, 10.0), (0.0, 0.5, 1.0)):
        point = Rigid(mass, 1e-18 * np.eye(3), X, 0 * X, 0 * X)
        rod = Rigid(1.0, np.diag([1 / 12, 1e-6, 1 / 12]), 0 * X, 0 * X, np.array([0.0, -1 / 6, 0.0]))
        (_, _), (velocity, spin) = rigid_newton.restitution(point, rod, X, e)
        assert velocity + np.cross(spin, 0.5 * Y) == near(np.zeros(3))


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.5])
def test_a_falling_rod_turns_about_its_end(angle):
    # The arm to the lower end is -(cos, 0, sin) L/2; (r x n)^2/I = (L/2 cos)^2 * 12/(m L^2) = 3 cos^2/m.
    mass, length, fall, c = 2.0, 1.5, 0.7, math.cos(angle)
    axis = np.array([c, 0.0, math.sin(angle)])
    inertia = mass * length**2 / 12 * (np.eye(3) - np.outer(axis, axis)) + 1e-4 * np.outer(axis, axis)
    rod = Rigid(mass, inertia, -fall * Z, 0 * X, -length / 2 * axis)
    for e in (0.0, 0.5, 1.0):
        impulse = (1 + e) * mass * fall / (1 + 3 * c * c)
        (_, _), (velocity, spin) = rigid_newton.restitution(static(0 * X), rod, Z, e)
        assert velocity == near((impulse / mass - fall) * Z)
        assert spin == near(6 * impulse * c / (mass * length) * Y)
    elastic = rigid_newton.restitution(static(0 * X), rod, Z, 1.0)[1]
    for b in (0.0, 0.5, 1.0):
        assert np.array(rigid_impact.bounce(static(0 * X), rod, Z, b)[1]) == near(b * np.array(elastic))
