"""Consequences 1-8 of the documents' rules as properties of the particle laws, to round-off.

Tolerances: one operation errs by at most eps/2 of its result. No chain below is longer than about 40 operations on
numbers no larger than `scale`, so that ROUND * scale = 64 eps * scale bounds every difference that theory says is zero.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from impactbench.reference import bounciness, coulomb, impact, newton, pairs, penetration, viscous

ROUND = 64 * np.finfo(float).eps

masses = st.floats(-4, 4).map(lambda exponent: 10.0**exponent)
fractions = st.floats(0, 1)
vectors = st.tuples(*[st.floats(-10, 10)] * 3).map(np.array)


@st.composite
def normals(draw):
    """Unit vectors from two angles: no rejection, every direction."""
    height, angle = draw(st.floats(-1, 1)), draw(st.floats(0, 2 * math.pi))
    ring = math.sqrt(1 - height**2)
    raw = np.array([ring * math.cos(angle), ring * math.sin(angle), height])
    return raw / np.linalg.norm(raw)


@st.composite
def impacts(draw):
    """(m_A, m_B, v_A, v_B, n, b) of an approaching pair: a separating draw is turned around."""
    n, v_a, v_b = draw(normals()), draw(vectors), draw(vectors)
    if (v_b - v_a) @ n > 0:
        n = -n
    return draw(masses), draw(masses), v_a, v_b, n, draw(fractions)


def speed_scale(*velocities) -> float:
    return sum(float(np.linalg.norm(v)) for v in velocities) + 1e-12


def close(actual, expected, scale) -> bool:
    return bool(np.all(np.abs(np.asarray(actual) - np.asarray(expected)) <= ROUND * scale))


@given(impacts())
def test_1_momentum_is_preserved_for_every_bounciness_mass_ratio_and_direction(case):
    m_a, m_b, v_a, v_b, n, b = case
    after_a, after_b = impact.bounce(m_a, m_b, v_a, v_b, n, b)
    # A light body flung by a heavy one reaches twice the closing speed: momentum of either is at most (m_A + m_B) * 3
    # speeds.
    assert close(m_a * after_a + m_b * after_b, m_a * v_a + m_b * v_b, 3 * (m_a + m_b) * speed_scale(v_a, v_b))


@given(impacts(), st.floats(0.01, 10), st.floats(0.01, 10))
def test_1_angular_momentum_of_spheres_changes_by_the_shared_tangential_motion(case, r_a, r_b):
    m_a, m_b, v_a, v_b, n, b = case
    _, after_b = impact.bounce(m_a, m_b, v_a, v_b, n, b)
    reach = (r_a + r_b) * n  # from centre A, taken as the origin, to centre B
    change = np.cross(reach, m_b * (after_b - v_b))
    _, plane = impact.split(v_b - v_a, n)
    expected = -(1 - b) * impact.reduced_mass(m_a, m_b) * np.cross(reach, plane)
    assert close(change, expected, 3 * (r_a + r_b) * m_b * speed_scale(v_a, v_b))


@given(impacts())
def test_2_relative_energy_scales_by_b_squared(case):
    m_a, m_b, v_a, v_b, n, b = case
    common, relative = impact.kinetic_energy(m_a, m_b, v_a, v_b)
    after_common, after_relative = impact.kinetic_energy(m_a, m_b, *impact.bounce(m_a, m_b, v_a, v_b, n, b))
    scale = 9 * speed_scale(v_a, v_b) ** 2
    assert close(after_relative, b**2 * relative, impact.reduced_mass(m_a, m_b) * scale)
    assert close(after_common, common, (m_a + m_b) * scale)


@given(impacts())
def test_3_normal_and_tangential_relative_velocity_scale_by_b(case):
    m_a, m_b, v_a, v_b, n, b = case
    after_a, after_b = impact.bounce(m_a, m_b, v_a, v_b, n, b)
    along, plane = impact.split(v_b - v_a, n)
    after_along, after_plane = impact.split(after_b - after_a, n)
    assert close(after_along, -b * along, 3 * speed_scale(v_a, v_b))
    assert close(after_plane, b * plane, 3 * speed_scale(v_a, v_b))


def test_3_oblique_bounce_at_one_half_halves_the_sliding_which_newton_keeps():
    down, up = np.array([2.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
    assert impact.bounce_off_static(down, up, 0.5).tolist() == [1.0, 0.0, 0.5]
    assert newton.restitution(math.inf, 1.0, np.zeros(3), down, up, 0.5)[1].tolist() == [2.0, 0.0, 0.5]


@given(impacts(), st.floats(0, 2), st.sampled_from(["doc", "nc"]))
def test_4_energy_never_grows(case, friction, law):
    m_a, m_b, v_a, v_b, n, b = case
    if law == "doc":
        after = impact.bounce(m_a, m_b, v_a, v_b, n, b)
    else:
        after = newton.restitution(m_a, m_b, v_a, v_b, n, b, friction)
    before, later = sum(impact.kinetic_energy(m_a, m_b, v_a, v_b)), sum(impact.kinetic_energy(m_a, m_b, *after))
    assert later <= before + ROUND * 9 * (m_a + m_b) * speed_scale(v_a, v_b) ** 2


@given(impacts(), normals(), st.floats(0, 2 * math.pi), vectors, st.booleans())
def test_5_only_the_frame_changes(case, axis, angle, boost, mirror):
    m_a, m_b, v_a, v_b, n, b = case
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross  # Rodrigues
    turn = -turn if mirror else turn
    after_a, after_b = impact.bounce(m_a, m_b, v_a, v_b, n, b)
    moved_a, moved_b = impact.bounce(m_a, m_b, turn @ v_a + boost, turn @ v_b + boost, turn @ n, b)
    scale = 9 * speed_scale(v_a, v_b, boost)  # three-term sums in the rotation
    assert close(moved_a, turn @ after_a + boost, scale)
    assert close(moved_b, turn @ after_b + boost, scale)
    swapped_b, swapped_a = impact.bounce(m_b, m_a, v_b, v_a, -n, b)
    assert close(swapped_a, after_a, scale)
    assert close(swapped_b, after_b, scale)


@given(masses, vectors, normals(), fractions)
def test_6_one_way_is_the_limit_of_a_heavy_partner(mass, velocity, n, b):
    one_way = impact.bounce_off_static(velocity, n, b)
    rest = np.zeros(3)
    assert close(impact.bounce(math.inf, mass, rest, velocity, n, b)[1], one_way, 3 * speed_scale(velocity))
    # Theory: the difference is (1 + b) m_B/(m_A + m_B) |u| at most, which falls as 1/m_A.
    for ratio in (1e3, 1e6, 1e9):
        heavy = impact.bounce(ratio * mass, mass, rest, velocity, n, b)[1]
        assert np.linalg.norm(heavy - one_way) <= (2 / ratio + ROUND) * speed_scale(velocity)


@given(masses, vectors, vectors, normals())
def test_6_equal_masses_swap_or_share(mass, v_a, v_b, n):
    scale = 3 * speed_scale(v_a, v_b)
    assert close(impact.bounce(mass, mass, v_a, v_b, n, 1.0), impact.swap(v_a, v_b, n), scale)
    assert close(impact.bounce(mass, mass, v_a, v_b, n, 0.0), [(v_a + v_b) / 2] * 2, scale)


@given(masses, masses, vectors, normals(), st.floats(0, 10), st.floats(0, 1))
def test_7_projection_leaves_the_centre_and_no_overlap(m_a, m_b, x_a, n, reach, depth):
    x_b = x_a + (reach - depth * reach) * n
    overlap = reach - float((x_b - x_a) @ n)
    new_a, new_b = penetration.project(m_a, m_b, x_a, x_b, n, overlap)
    scale = speed_scale(x_a, x_b) + reach
    assert close(float((new_b - new_a) @ n), reach, scale)
    assert close(m_a * new_a + m_b * new_b, m_a * x_a + m_b * x_b, (m_a + m_b) * scale)
    fixed, lifted = penetration.project(math.inf, m_b, x_a, x_b, n, overlap)
    assert close(fixed, x_a, scale)
    assert close(lifted, x_b + overlap * n, scale)


def test_7_separated_bodies_are_left_alone_by_both_strategies():
    a, b, x = np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
    assert penetration.project(1.0, 1.0, a, b, x, -0.5)[1].tolist() == b.tolist()
    assert penetration.revert(a, b, a - 1, b + 1, -0.5) == (a, b)
    last = (a - 1, b + 1)
    assert penetration.revert(a, b, *last, 0.5) == last


@given(st.floats(0, 100), st.floats(0.1, 10), st.floats(0, 1))
def test_touching_speed_takes_back_what_the_lift_adds(speed, acceleration, depth):
    touched = penetration.touching_speed(speed, acceleration, depth)
    gain = acceleration * depth - (speed**2 - touched**2) / 2
    # Energies per mass; what the normal motion cannot pay is the stated bound.
    bound = max(0.0, acceleration * depth - speed**2 / 2)
    assert abs(gain - bound) <= ROUND * (speed**2 + acceleration * depth + 1e-12)


@given(impacts(), st.floats(0, 1e3), st.floats(1e-4, 1), st.sampled_from(["two-way", "one-way"]))
def test_8_viscous_friction_slows_the_sliding_and_nothing_else(case, viscosity, step, kind):
    m_a, m_b, v_a, v_b, n, _ = case
    if kind == "one-way":
        m_a, v_a = math.inf, np.zeros(3)
    along, plane = impact.split(v_b - v_a, n)
    after_a, after_b = viscous.rub(m_a, m_b, v_a, v_b, n, viscosity, step)
    after_along, after_plane = impact.split(after_b - after_a, n)
    scale = 3 * speed_scale(v_a, v_b)
    assert close(after_along, along, scale)
    assert close(after_plane, math.exp(-viscous.rate(viscosity, m_a, m_b) * step) * plane, scale)
    if kind == "two-way":
        assert close(m_a * after_a + m_b * after_b, m_a * v_a + m_b * v_b, (m_a + m_b) * scale)


@given(vectors, st.floats(0, 10), st.floats(0, 0.1), st.floats(0, 10))
def test_8_both_implementations_are_monotone_and_never_reverse(sliding, rate, step, impulse):
    for after in (
        viscous.force_step(sliding, rate, step),
        viscous.damping_step(sliding, rate, step),
        coulomb.slide(sliding, 1.0, impulse, 0.5),
    ):
        assert after @ sliding >= 0
        assert np.linalg.norm(after) <= np.linalg.norm(sliding)
        # Equal exponentials to second order: |exp(-x) - (1 - x)| <= x^2/2.
    gap = np.linalg.norm(viscous.force_step(sliding, rate, step) - viscous.damping_step(sliding, rate, step))
    assert gap <= ((rate * step) ** 2 / 2 + ROUND) * speed_scale(sliding)


def test_8_an_explicit_step_that_would_reverse_the_sliding_is_refused():
    with pytest.raises(ValueError, match="reverse the sliding"):
        viscous.force_step(np.ones(3), 10.0, 0.2)


@given(impacts(), st.floats(0, 2))
def test_newton_keeps_momentum_and_scales_the_normal_part_by_e(case, friction):
    m_a, m_b, v_a, v_b, n, e = case
    after_a, after_b = newton.restitution(m_a, m_b, v_a, v_b, n, e, friction)
    scale = 3 * speed_scale(v_a, v_b)
    assert close(m_a * after_a + m_b * after_b, m_a * v_a + m_b * v_b, (m_a + m_b) * scale)
    assert close((after_b - after_a) @ n, -e * ((v_b - v_a) @ n), scale)
    _, plane = impact.split(v_b - v_a, n)
    _, after_plane = impact.split(after_b - after_a, n)
    assert after_plane @ plane >= -ROUND * scale**2


@given(impacts())
def test_the_two_laws_agree_elastic_at_any_angle(case):
    m_a, m_b, v_a, v_b, n, _ = case
    doc, engines = impact.bounce(m_a, m_b, v_a, v_b, n, 1.0), newton.restitution(m_a, m_b, v_a, v_b, n, 1.0)
    assert close(doc, engines, 3 * speed_scale(v_a, v_b))


@given(masses, masses, st.floats(-10, 10), st.floats(-10, 10), normals(), fractions)
def test_the_two_laws_agree_head_on(m_a, m_b, s_a, s_b, n, b):
    v_a, v_b = s_a * n, s_b * n
    doc, engines = impact.bounce(m_a, m_b, v_a, v_b, n, b), newton.restitution(m_a, m_b, v_a, v_b, n, b)
    assert close(doc, engines, 3 * speed_scale(v_a, v_b))


@given(fractions, fractions, st.sampled_from(sorted(bounciness.MIXINGS)))
def test_mixing_is_symmetric_and_stays_in_range(a, b, mixing):
    mixed = bounciness.mix(mixing, a, b)
    assert mixed == bounciness.mix(mixing, b, a)
    assert 0 <= mixed <= 1
    if mixing != "product":
        # Squares below the smallest normal number lose their digits in the geometric mean: hence the absolute 1e-150.
        assert abs(bounciness.mix(mixing, a, a) - a) <= ROUND * a + 1e-150


def test_an_unknown_mixing_names_the_known_ones():
    with pytest.raises(ValueError, match=r"one of average.*did you mean 'average'"):
        bounciness.mix("avrage", 0.5, 0.5)


@given(st.integers(0, 12), st.integers(0, 12))
def test_static_pairs_are_never_formed(statics, movables):
    formed = list(pairs.handled_pairs(range(statics), range(statics, statics + movables)))
    _, one_way, two_way = pairs.pair_counts(statics, movables)
    assert len(formed) == len(set(formed)) == one_way + two_way
    assert all(second >= statics for _, second in formed)
