"""The stepped runner against the laws: conservation to round-off, rest at exact heights, friction, both strategies of
R4.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference import coulomb, impact, newton, viscous
from impactbench.reference.coefficients import build_coefficients
from impactbench.reference.contestant import Stepped
from impactbench.reference.nearby import all_pairs
from impactbench.reference.particles import build_bodies
from impactbench.scenarios.engine import Engine, Unsupported
from impactbench.scenarios.records import FULL, Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere

G, STEP = 9.81, 1 / 240
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
EPS = np.finfo(float).eps

strategies = pytest.mark.parametrize("profile", ["stepped", "revert"])
laws = pytest.mark.parametrize("law", ["doc", "nc"])


def scene(bodies, axes=(0, 1, 2), gravity=0.0, **contact) -> Scene:
    return Scene(
        name="test[case=1]",
        bodies=tuple(bodies),
        duration=1.0,
        model=Model(axes, gravity=gravity > 0),
        length=1.0,
        speed=1.0,
        energy=1.0,
        gravity=(0.0, 0.0, -gravity),
        contact=Contact(**contact),
    )


def engine(world: Scene, law="doc", profile="stepped", step=STEP, model=None) -> Stepped:
    return Stepped(world, law, profile, model or world.model, step)


def ball(name, position, velocity=(0.0, 0.0, 0.0), mass=1.0, radius=0.1) -> Body:
    return Body(name, Sphere(radius), mass, tuple(position), tuple(velocity))


def energies(world: Scene, steps: int, **options) -> np.ndarray:
    """Kinetic and potential energy [J] at every step."""
    run, found = engine(world, **options), []
    mass = np.array([world.bodies[i].mass for i in world.movable])
    for _ in range(steps + 1):
        state = run.read()
        motion = (state.velocities**2).sum(axis=1) / 2
        found.append(float(mass @ (motion - state.positions @ np.array(world.gravity))))
        run.advance(1)
    return np.array(found)


def column(shape, gap: float, count=10) -> list[Body]:
    return [FLOOR] + [
        Body(f"{i}", shape, 1.0, (0.0, 0.0, 0.1 + 0.2 * i + gap * (i + 1)), (0.0, 0.0, 0.0)) for i in range(count)
    ]


@strategies
@laws
@pytest.mark.parametrize("offset", [0.0, 0.07, 0.13])
@pytest.mark.parametrize("b", [0.0, 0.3, 1.0])
def test_pairs_keep_momentum_and_scale_relative_energy_by_b_squared(profile, law, offset, b):
    m_a, m_b, v_a, v_b = 2.0, 0.5, np.array([3.0, 0.2, 0.0]), np.array([-1.0, 0.0, 0.4])
    world = scene([ball("a", (-0.5, 0, 0), v_a, m_a), ball("b", (0.5, offset, 0), v_b, m_b)], bounciness=b)
    run = engine(world, law, profile)
    run.advance(120)
    after_a, after_b = run.read().velocities
    momentum = m_a * v_a + m_b * v_b
    assert np.abs(m_a * after_a + m_b * after_b - momentum).max() <= 1e-13 * np.linalg.norm(momentum)
    assert not np.allclose(after_a, v_a)
    if law == "doc":
        common, relative = impact.kinetic_energy(m_a, m_b, v_a, v_b)
        after = sum(impact.kinetic_energy(m_a, m_b, after_a, after_b))
        assert after == pytest.approx(common + b**2 * relative, rel=1e-13)


@given(st.floats(-0.15, 0.15), st.floats(0.01, 100), st.floats(0, 1), st.floats(0, 1))
@settings(max_examples=50, deadline=None)
def test_the_compiled_impact_is_the_law(offset, m_a, b, friction):
    """Centres in contact range after one step: the normal is then known, and both forms of each law must agree."""
    radius, v_a, v_b = 0.1, np.array([2.0, 0.0, 0.3]), np.zeros(3)
    reach = math.sqrt(4 * radius**2 - offset**2)
    bodies = [ball("a", (-reach - 1e-3, 0, 0), v_a, m_a), ball("b", (0, offset, 0), v_b)]
    world = scene(bodies, bounciness=b, friction=friction)
    for law in ("doc", "nc"):
        run = engine(world, law, step=1e-3)
        run.advance(1)
        x_a, x_b = run.read().positions
        normal = (x_b - x_a) / np.linalg.norm(x_b - x_a)
        run.advance(1)
        if law == "doc":
            expected = impact.bounce(m_a, 1.0, v_a, v_b, normal, b)
        else:
            expected = newton.restitution(m_a, 1.0, v_a, v_b, normal, b, friction)
        # The normal is rebuilt from positions near 1 at a distance of 0.2; some 50 operations, speeds up to 2 * |v_a|.
        assert np.abs(run.read().velocities - expected).max() <= 400 * EPS * np.linalg.norm(v_a)


@strategies
@laws
def test_an_elastic_ball_keeps_its_energy_for_ten_seconds(profile, law):
    world = scene([FLOOR, ball("ball", (0, 0, 1.1))], (2,), G, bounciness=1.0)
    found = energies(world, 2400, law=law, profile=profile)
    # 2400 steps of some 10 operations on at most m g 1.1 m; errors add up at worst linearly.
    assert np.abs(found - found[0]).max() <= 2400 * 10 * EPS * found[0]


@strategies
def test_the_apex_after_ten_seconds_is_that_of_the_start(profile):
    run = engine(scene([FLOOR, ball("ball", (0, 0, 1.1))], (2,), G), profile=profile)
    run.advance(2160)
    apex = 0.0
    for _ in range(240):
        run.advance(1)
        apex = max(apex, run.read().positions[0, 2] - 0.1)
    # Sampled at whole steps, at most half a step beside the apex: g (h/2)^2 / 2 = 2.1e-5 m.
    assert abs(apex - 1) <= G * (STEP / 2) ** 2 / 2 + 1e-12


@strategies
@laws
@pytest.mark.parametrize("b", [0.0, 0.5, 0.9])
def test_a_bounce_sequence_dies_out_to_rest_and_never_gains(profile, law, b):
    world = scene([FLOOR, ball("ball", (0, 0, 1.1))], (2,), G, bounciness=b)
    found = energies(world, 3000, law=law, profile=profile)
    assert np.diff(found).max() <= 100 * EPS * found[0]
    run = engine(world, law, profile)
    run.advance(2990)
    rest = run.read()
    run.advance(10)
    assert np.array_equal(run.read().positions, rest.positions)  # no jitter at all
    assert run.read().velocities.tolist() == [[0.0, 0.0, 0.0]]
    allowed = 1e-9 if profile == "stepped" else 2 * G * STEP**2  # reverting leaves a gap: see `revert`
    assert 0 <= rest.positions[0, 2] - 0.1 + 1e-9 <= allowed + 1e-9


@pytest.mark.parametrize("shape", [Sphere(0.1), Box((0.1, 0.1, 0.1))], ids=["spheres", "boxes"])
@pytest.mark.parametrize(("gap", "b"), [(0.0, 1.0), (0.05, 0.0), (0.05, 0.6)])
def test_a_column_of_ten_rests_at_exact_heights(shape, gap, b):
    world = scene(column(shape, gap), (2,), G, bounciness=b)
    found = energies(world, 1200)
    run = engine(world)
    run.advance(1200)
    heights = 0.1 + 0.2 * np.arange(10)
    assert np.abs(run.read().positions[:, 2] - heights).max() <= 1e-8
    assert np.abs(run.read().velocities).max() <= 1e-12
    # Overlaps up to 5e-11 m stay and may close or open again: m g 10 * 10 of them, m g z is found[0] at most.
    assert np.diff(found).max() <= 100 * G * 1e-10
    assert found.max() <= found[0] * (1 + 1e-13)


@strategies
def test_an_elastic_column_keeps_its_total_energy_bounded(profile):
    found = energies(scene(column(Sphere(0.1), 0.05), (2,), G, bounciness=1.0), 2400, profile=profile)
    assert found.max() <= found[0] * (1 + 1e-12)


def test_a_row_of_touching_balls_hands_the_blow_on():
    row = [ball(f"{i}", (0.2 * i, 0, 0)) for i in range(4)]
    world = scene([ball("first", (-0.5, 0, 0), (2.0, 0, 0)), *row], (0,), bounciness=1.0)
    run = engine(world)
    run.advance(120)
    assert run.read().velocities[:, 0].tolist() == pytest.approx([0, 0, 0, 0, 2], abs=1e-14)


def test_statics_are_never_paired():
    walls = [Body(f"wall {i}", Box((1.0, 1.0, 1.0)), None, (0.0, 0.0, float(i))) for i in range(20)]
    world = scene([*walls, ball("a", (5, 0, 0)), ball("b", (6, 0, 0)), ball("c", (7, 0, 0))])
    pairs = all_pairs(world, build_bodies(world), build_coefficients(world))
    movable = build_bodies(scene([*walls, ball("a", (5, 0, 0))])).inverse_mass > 0
    assert len(pairs.first) == 20 * 3 + 3
    assert movable.sum() == 1
    assert (pairs.second >= 20).all()


@strategies
@pytest.mark.parametrize("shape", [Sphere(0.1), Box((0.1, 0.2, 0.1))], ids=["sphere", "box"])
def test_viscous_slide_is_the_exponential(profile, shape):
    mass, c, speed, time = 2.0, 3.0, 4.0, 1.0
    world = scene([FLOOR, Body("slider", shape, mass, (0, 0, 0.1), (speed, 0, 0))], (0, 2), G, viscosity=c)
    run = engine(world, profile=profile)
    run.advance(240)
    state, rate = run.read(), viscous.rate(c, mass)
    assert state.velocities[0, 0] == pytest.approx(speed * math.exp(-rate * time), rel=240 * 4 * EPS)
    # The trapezium errs by h^2/12 times the change of acceleration, below h^2/12 * v0 * rate.
    error = abs(state.positions[0, 0] - viscous.distance(speed, rate, time))
    assert error <= STEP**2 / 12 * speed * rate + 1e-12


@pytest.mark.parametrize("axes", [(0,), (0, 2), (0, 1, 2)])
@pytest.mark.parametrize("step", [1 / 60, 1 / 240, 1 / 960])
def test_coulomb_slide_stops_within_the_error_of_its_last_step(axes, step):
    mu, speed = 0.3, 2.0
    world = scene([FLOOR, Body("slider", Box((0.1, 0.1, 0.1)), 1.0, (0, 0, 0.1), (speed, 0, 0))], axes, G, friction=mu)
    run = engine(world, "nc", step=step)
    run.advance(round(2 * coulomb.stopping_time(speed, mu, G) / step))
    state = run.read()
    assert state.velocities[0, 0] == pytest.approx(0.0, abs=1e-12)
    # Only the last step errs: it takes up to mu g h of speed, over which the mean speed is off for less than one step.
    assert abs(state.positions[0, 0] - coulomb.stopping_distance(speed, mu, G)) <= mu * G * step**2 / 2


def test_two_way_viscous_friction_conserves_momentum():
    slab = Body("slab", Box((5.0, 1.0, 0.1)), 3.0, (0, 0, 0.1))
    block = Body("block", Box((0.1, 0.1, 0.1)), 1.0, (0, 0, 0.3), (2.0, 0, 0))
    smooth = ("floor", "slab", Contact(viscosity=0.0))
    world = replace(scene([FLOOR, slab, block], (0, 2), G, viscosity=2.0), pairs=(smooth,))
    run = engine(world)
    run.advance(240)
    slab_speed, block_speed = run.read().velocities[:, 0]
    assert 3 * slab_speed + block_speed == pytest.approx(2.0, rel=1e-13)
    assert block_speed - slab_speed == pytest.approx(2 * math.exp(-viscous.rate(2.0, 3.0, 1.0)), rel=1e-12)


@strategies
def test_a_ball_in_a_box_of_walls_keeps_its_speed_and_stays_inside(profile):
    walls = []
    for axis, sign in itertools.product(range(3), (1.0, -1.0)):
        normal = tuple(-sign if k == axis else 0.0 for k in range(3))
        walls.append(Body(f"wall {axis} {sign}", HalfSpace(normal), None, tuple(-n for n in normal)))
    world = scene([*walls, ball("ball", (0, 0, 0), (3.0, 2.0, 1.0))])
    run = engine(world, profile=profile)
    for _ in range(480):
        run.advance(5)
        state = run.read()
        assert np.abs(state.velocities[0]).tolist() == [3.0, 2.0, 1.0]
        assert np.abs(state.positions[0]).max() <= 0.9 + 1e-9


def test_free_flight_is_the_parabola_and_axes_not_modelled_stay():
    world = scene([ball("ball", (0, 0.5, 10), (1.0, 0, 2.0))], (0, 2), G)
    run = engine(world)
    run.advance(240)
    state = run.read()
    assert state.positions[0] == pytest.approx([1.0, 0.5, 10 + 2 - G / 2], rel=240 * 8 * EPS)
    assert state.orientations is None


def test_one_call_is_as_many_single_steps_and_reads_are_copies():
    world = scene([FLOOR, ball("ball", (0, 0, 1.1))], (2,), G, bounciness=0.7)
    whole, single = engine(world), engine(world)
    start = whole.read()
    whole.advance(300)
    for _ in range(300):
        single.advance(1)
    assert np.array_equal(whole.read().positions, single.read().positions)
    assert start.positions[0, 2] == 1.1


def test_the_full_model_of_a_scene_without_spin_is_the_same_run():
    world = scene([FLOOR, ball("ball", (0, 0, 1.1))], (2,), G, bounciness=0.7)
    contestant: Engine = engine(world, model=FULL)
    small = engine(world)
    contestant.advance(300)
    small.advance(300)
    assert np.array_equal(contestant.read().positions, small.read().positions)
    contestant.close()


def test_what_needs_spin_or_another_shape_is_declared():
    world = scene([FLOOR, ball("ball", (0, 0, 1.1))], (0, 2), G, bounciness=0.7, friction=0.2)
    with pytest.raises(Unsupported, match="needs rotation"):
        engine(replace(world, model=FULL), profile="revert")
    with pytest.raises(Unsupported, match="friction would spin"):
        engine(world, "nc", model=FULL)
    with pytest.raises(Unsupported, match="has no capsule"):
        engine(scene([Body("pill", Capsule(0.1, 0.2), 1.0, (0.0, 0.0, 0.0))]))
    turned = Body("crate", Box((1.0, 1.0, 1.0)), 1.0, (0.0, 0.0, 0.0), orientation=(0.6, 0.8, 0.0, 0.0))
    with pytest.raises(Unsupported, match=r"'crate'.*axis-aligned"):
        engine(scene([turned]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "'ball': mass 0.0"),
        ({"mass": -1.0}, "'ball': mass -1.0"),
        ({"mass": math.nan}, "'ball': mass nan"),
        ({"position": (0.0, math.nan, 0.0)}, "'ball': position"),
        ({"velocity": (math.inf, 0.0, 0.0)}, "'ball': velocity"),
        ({"shape": Sphere(-0.1)}, "'ball': radius -0.1"),
        ({"shape": Box((0.1, -0.1, 0.1))}, "'ball': half_extents"),
        ({"shape": HalfSpace((0.0, 0.0, 1.0))}, "'ball': mass 1.0 given"),
        ({"shape": HalfSpace((0.0, 0.0, 2.0)), "mass": None}, "'ball': normal"),
    ],
)
def test_a_bad_body_is_refused_by_name_and_field(change, message):
    with pytest.raises(ValueError, match=message):
        engine(scene([FLOOR, replace(ball("ball", (0, 0, 1)), **change)]))


BAD_CONTACTS = [{"bounciness": 1.1}, {"bounciness": math.nan}, {"friction": -0.1}, {"viscosity": -1.0}]


@pytest.mark.parametrize("contact", BAD_CONTACTS)
def test_a_bad_coefficient_is_refused_by_name(contact):
    with pytest.raises(ValueError, match=next(iter(contact))):
        engine(scene([FLOOR, ball("ball", (0, 0, 1))], **contact))


@pytest.mark.parametrize("step", [0.0, -1.0, math.nan, math.inf])
def test_a_bad_step_is_refused(step):
    with pytest.raises(ValueError, match="step"):
        engine(scene([ball("ball", (0, 0, 1))]), step=step)


def test_an_unknown_profile_names_the_known_ones():
    with pytest.raises(ValueError, match=r"stepped, revert, force, positions; did you mean 'revert'"):
        engine(scene([ball("ball", (0, 0, 1))]), profile="reverts")
