"""The runner for rigid bodies: truths of the catalogue, what is conserved, rest, friction, frames, refusals.

Where motion is made of pieces of constant acceleration the runner is exact. A run of some 100 steps adds as many
rounded terms: 1e-12 of the scene's scales holds 1e4 eps, a hundred for each step.
"""

from __future__ import annotations

import math
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from impactbench.reference import rigid_run
from impactbench.reference.contestant import Stepped
from impactbench.reference.rigid_body import world_inertia
from impactbench.reference.rigid_spin import spin_of, turn
from impactbench.scenarios.catalogue import all_cases
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.flight import G
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere
from impactbench.scenarios.trajectory import State

ROUND = 1e-12
STEP = 1 / 120
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
TURNED = (0.6, 0.48, 0.0, 0.64)
CASES = [(case, law) for case in all_cases() if case.scene.model.rotation for law in case.truths]
TRUE = [each for each in CASES if each[0].truths[each[1]].kind == "trajectory"]
SPACE, PLANE = (0, 1, 2), (0, 2)


def scene(*bodies: Body, axes=SPACE, gravity=0.0, duration=1.0, **contact) -> Scene:
    return Scene(
        "test",
        bodies,
        duration,
        Model(axes, rotation=True, gravity=gravity != 0, friction=True),
        length=1.0,
        speed=1.0,
        energy=1.0,
        gravity=(0.0, 0.0, -gravity),
        contact=Contact(**contact),
    )


def engine(world: Scene, law="doc", step=STEP, profile="stepped") -> Stepped:
    return Stepped(world, law, profile, world.model, step)


def after(world: Scene, law: str, steps: int, step=STEP) -> State:
    run = engine(world, law, step)
    run.advance(steps)
    return run.read()


def energy(world: Scene, state: State) -> float:
    total = 0.0
    for row, i in enumerate(world.movable):
        body, v, w = world.bodies[i], state.velocities[row], state.spins[row]
        inertia = world_inertia(body.principal_inertia(), tuple(state.orientations[row]))
        total += body.mass * (v @ v / 2 - np.array(world.gravity) @ state.positions[row]) + w @ inertia @ w / 2
    return total


def momenta(world: Scene, state: State) -> np.ndarray:
    """Momentum and angular momentum about the origin."""
    linear, angular = np.zeros(3), np.zeros(3)
    for row, i in enumerate(world.movable):
        body, v = world.bodies[i], state.velocities[row]
        inertia = world_inertia(body.principal_inertia(), tuple(state.orientations[row]))
        linear += body.mass * v
        angular += np.cross(state.positions[row], body.mass * v) + inertia @ state.spins[row]
    return np.concatenate((linear, angular))


def energies(world: Scene, law: str, steps: int, step=STEP) -> np.ndarray:
    run, found = engine(world, law, step), []
    for _ in range(steps):
        found.append(energy(world, run.read()))
        run.advance(1)
    return np.array(found)


# Truths of the catalogue


@pytest.mark.parametrize(("case", "law"), TRUE, ids=[f"{case.scene.name}-{law}" for case, law in TRUE])
def test_the_catalogues_truths_come_out_to_round_off_but_for_the_step_in_which_rolling_begins(case, law):
    world, truth, step = case.scene, case.truths[law], 1 / 30
    # Within that step the velocity has a kink; its mean errs by at most a quarter of a h, the way by a h^2/8.
    kink = world.contact.friction * G * step**2 / 8 if world.family == "rolling_onset" else 0.0
    run = engine(world, law, step)
    for n in range(1, round(world.duration / step) + 1):
        run.advance(1)
        found, true = run.read(), truth.state(n * step)
        assert np.abs(found.positions - true.positions).max() <= kink + ROUND * world.length
        assert np.abs(found.velocities - true.velocities).max() <= ROUND * world.speed
        assert np.abs(found.spins - true.spins).max() <= ROUND * max(100.0, np.abs(true.spins).max())


def test_free_rotation_keeps_momentum_and_has_order_four():
    # Substeps of s radians err by some s^5/100 each: 1/s of them per radian leave s^4/100, here 6e-8 of the energy.
    principal, orientation, momentum = (1.0, 2.0, 3.0), TURNED, (1.0, 0.5, 2.0)
    at_start = np.dot(momentum, spin_of(principal, orientation, momentum))
    turned = turn(principal, orientation, momentum, 20.0)
    assert np.dot(momentum, spin_of(principal, turned, momentum)) == pytest.approx(at_start, rel=20 * 6e-8)
    once, fine = (np.array(turn(principal, orientation, momentum, 0.01 * k)) for k in (1, 2))
    assert np.abs(once - fine).max() > 1e-3  # it does turn


# Consequences 1-6 of the rules, through the runner


within, spinning, masses = st.floats(-0.15, 0.15), st.floats(-3, 3), st.floats(0.1, 10)
pairs = st.tuples(within, within, *[spinning] * 6, masses, st.floats(0, 1), st.sampled_from("bsc"))
BOUNCE = {"bounciness": 0.5}
BALL = Body("ball", Sphere(0.1), 1.0, (-0.6, 0.0, 0.0), (4.0, 0.0, 0.0))


def meeting(case, law: str) -> Scene:
    """A spinning ball that flies into a ball, a capsule or a turned box, off centre."""
    y, z, *spins, mass, b, shape = case
    target = {
        "b": Body("target", Box((0.2, 0.3, 0.25)), mass, (0.2, y, z), orientation=TURNED),
        "s": Body("target", Sphere(0.2), mass, (0.2, y, z)),
        "c": Body("target", Capsule(0.1, 0.2), mass, (0.2, y, z), orientation=TURNED),
    }[shape]
    rough = {"friction": 0.3} if law == "nc" else {}
    return scene(replace(BALL, spin=tuple(spins[:3])), replace(target, spin=tuple(spins[3:])), bounciness=b, **rough)


@pytest.mark.parametrize("law", ["doc", "nc"])
@given(pairs)
@settings(max_examples=15, deadline=None)
def test_two_way_impacts_keep_both_momenta_and_never_gain_energy(law, case):
    world = meeting(case, law)
    before = engine(world, law).read()
    with mock.patch.object(rigid_run, "_lift", wraps=rigid_run._lift) as lifts:
        state = after(world, law, 60)
    assume(not lifts.called)  # bodies that slide on along one another: see below
    size = 4.0 + 3 * world.bodies[1].mass * 4
    # Boxes turn by substeps, which keep L; R14 solves systems of condition 100 at most.
    assert np.abs(momenta(world, state) - momenta(world, before)).max() <= 100 * ROUND * size
    gained = energy(world, state) - energy(world, before)
    if law == "doc":  # Newton's restitution with friction may gain: see rigid_newton
        assert gained <= 1e-8 * energy(world, before)  # the substeps' energy


def test_bodies_that_slide_on_along_one_another_lose_angular_momentum_to_first_order():
    """Projection (R4) moves them apart across their motion: measured 0.016 to 0.0022 N m s from 1/60 to 1/480 s."""
    world = meeting((0.1, -0.05, 1.0, 2.0, -1.0, 0.5, 0.2, -2.0, 2.0, 0.0, "b"), "nc")
    start = momenta(world, engine(world, "nc").read())
    coarse, fine = (np.abs(momenta(world, after(world, "nc", n, 0.5 / n)) - start) for n in (60, 240))
    assert max(*coarse[:3], *fine[:3]) <= 100 * ROUND
    assert fine[3:].max() < coarse[3:].max() / 3


@pytest.mark.parametrize("law", ["doc", "nc"])
@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_energy_lies_between_those_of_the_joined_body_and_the_start(law, offset):
    """E' = E(joined) + b^2 (E - E(joined)) under the documents' law: the convexity bound of R14, met exactly."""
    found = {}
    for b in (0.0, 0.5, 1.0):
        world = scene(BALL, Body("target", Sphere(0.2), 3.0, (0.2, offset, 0.0)), bounciness=b)
        found[b] = energy(world, after(world, law, 60))
    assert found[1.0] == pytest.approx(8.0, rel=ROUND)
    assert found[0.5] == pytest.approx(found[0.0] + 0.25 * (found[1.0] - found[0.0]), rel=10 * ROUND)


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_a_heavy_box_is_a_static_one_in_the_limit(law):
    heavy, fixed = (
        after(
            scene(BALL, Body("box", Box((0.2, 0.3, 0.25)), m, (0.2, 0.05, 0.1), orientation=TURNED), **BOUNCE), law, 40
        )
        for m in (1e6, None)
    )
    # Velocities differ by the ratio of the masses, 1e-6, times 4 m/s and at most (1 + r^2 m/I) = 14 for the arms.
    assert np.abs(heavy.velocities[0] - fixed.velocities[0]).max() <= 1e-4
    assert np.abs(heavy.positions[0] - fixed.positions[0]).max() <= 1e-4


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_only_the_frame_changes(law):
    world = meeting((0.05, -0.08, 1.0, 2.0, -1.0, 0.5, 0.2, -2.0, 2.0, 0.5, "b"), law)
    state = after(world, law, 60)
    shift, boost = np.array([1.0, -2.0, 0.5]), np.array([0.3, -0.2, 0.1])
    moved = [
        replace(b, position=tuple(np.add(b.position, shift)), velocity=tuple(np.add(b.velocity, boost)))
        for b in world.bodies
    ]
    other = after(replace(world, bodies=tuple(moved)), law, 60)
    assert np.abs(other.positions - shift - boost * 0.5 - state.positions).max() <= 1e-9  # impact found to 1e-10 m
    assert np.abs(other.spins - state.spins).max() <= 1e-8
    swapped = after(replace(world, bodies=world.bodies[::-1]), law, 60)
    assert np.abs(swapped.positions[::-1] - state.positions).max() <= 1e-9
    # Mirrored in y: vectors flip y, spins (axial) flip x and z.
    mirror = np.array([1.0, -1.0, 1.0])
    bodies = [
        replace(
            b,
            position=tuple(mirror * b.position),
            velocity=tuple(mirror * b.velocity),
            spin=tuple(-mirror * b.spin),
            orientation=tuple(np.array([1.0, -1.0, 1.0, -1.0]) * b.orientation),
        )
        for b in world.bodies
    ]
    image = after(replace(world, bodies=tuple(bodies)), law, 60)
    assert np.abs(image.positions * mirror - state.positions).max() <= 1e-9
    assert np.abs(image.spins * -mirror - state.spins).max() <= 1e-8


# Lasting contacts


TUMBLING = {
    "box": Body("body", Box((0.2, 0.1, 0.3)), 1.0, (0, 0, 1.0), (1.0, 0, 0), TURNED, (1.0, 2.0, 3.0)),
    "capsule": Body("body", Capsule(0.1, 0.2), 1.0, (0, 0, 1.0), (1.0, 0, 0), TURNED, (1.0, 2.0, 3.0)),
}


@pytest.mark.parametrize("shape", TUMBLING)
@pytest.mark.parametrize(("law", "b"), [("doc", 0.0), ("doc", 0.5), ("doc", 1.0), ("nc", 0.0)])
def test_a_tumbling_body_never_gains_energy_and_comes_to_rest(shape, law, b):
    world = scene(FLOOR, TUMBLING[shape], gravity=G, bounciness=b, **{"friction" if law == "nc" else "viscosity": 0.5})
    found = energies(world, law, 360)
    # Free rotation by substeps: 1e-9 of the energy over 20 rad; else only round-off.
    assert np.diff(found).max() <= 1e-9 * found[0]
    if b == 1 and law == "doc":
        return  # viscous friction takes what it can between the impacts, of which there are many: it never rests
    state = after(world, law, 360)
    assert abs(state.velocities[0, 2]) <= 1e-4
    if shape == "box":
        assert state.positions[0, 2] == pytest.approx(0.1, abs=1e-6)


def test_elastic_frictionless_tumbling_keeps_its_energy():
    world = scene(FLOOR, TUMBLING["box"], gravity=G, bounciness=1.0)
    found = energies(world, "doc", 240)
    assert np.abs(found - found[0]).max() <= 1e-8 * found[0]  # substeps of free rotation; lifts none


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_a_box_that_lands_flat_does_not_turn(law):
    world = scene(FLOOR, Body("box", Box((0.2, 0.1, 0.3)), 1.0, (0.0, 0.0, 0.8)), gravity=G, bounciness=0.5)
    state = after(world, law, 60, 1 / 60)
    assert np.abs(state.spins).max() <= ROUND
    assert np.abs(state.velocities[0, :2]).max() <= ROUND


def test_a_capsule_begins_to_roll_by_its_own_inertia():
    # Sliding ends with v = w r when m v0 = (m + I/r^2) v, whatever mu: angular momentum about the line of contact.
    body = Body("log", Capsule(0.1, 0.2), 2.0, (0.0, 0.0, 0.1), (2.0, 0.0, 0.0), (math.sqrt(0.5), math.sqrt(0.5), 0, 0))
    world = scene(FLOOR, body, gravity=G, bounciness=0.0, friction=0.4)
    share = body.principal_inertia()[2] / (2.0 * 0.1**2)
    state = after(world, "nc", 120)
    assert state.velocities[0] == pytest.approx([2 / (1 + share), 0.0, 0.0], abs=1e-9)
    assert state.spins[0] == pytest.approx([0.0, 20 / (1 + share), 0.0], abs=1e-7)


def test_viscous_friction_at_the_contact_point_of_a_ball():
    # F = -c u_t on the slip u = v - w R: du/dt = -c (1/m + R^2/I) u = -7/2 c/m u, and m v + I w/R stays: v -> 5/7 v0.
    ball = Body("ball", Sphere(0.1), 2.0, (0.0, 0.0, 0.1), (3.0, 0.0, 0.0))
    world = scene(FLOOR, ball, gravity=G, bounciness=0.0, viscosity=1.5)
    state = after(world, "doc", 60)
    slip = 3.0 * math.exp(-3.5 * 1.5 / 2.0 * 0.5)
    assert state.velocities[0, 0] - 0.1 * state.spins[0, 1] == pytest.approx(slip, rel=1e-10)
    assert state.velocities[0, 0] == pytest.approx(5 / 7 * 3.0 + 2 / 7 * slip, rel=1e-10)


def test_friction_never_reverses_the_slip_and_leaves_the_normal_alone():
    ball = Body("ball", Sphere(0.1), 2.0, (0.0, 0.0, 0.1), (3.0, 1.0, 0.0), spin=(5.0, -4.0, 2.0))
    for law, rough in (("nc", {"friction": 0.3}), ("doc", {"viscosity": 20.0})):
        run, last = engine(scene(FLOOR, ball, gravity=G, bounciness=0.0, **rough), law), None
        for _ in range(100):
            state = run.read()
            slip = (state.velocities[0] + np.cross(state.spins[0], [0.0, 0.0, -0.1]))[:2]
            if last is not None:
                assert slip @ last >= -1e-12
                assert np.linalg.norm(slip) <= np.linalg.norm(last) + 1e-12
            assert abs(state.velocities[0, 2]) <= 1e-12
            last = slip
            run.advance(1)


def test_a_fast_ball_does_not_pass_a_thin_box():
    wall = Body("wall", Box((0.005, 1.0, 1.0)), None, (0.5, 0.0, 0.0))
    world = scene(replace(BALL, velocity=(200.0, 0.0, 0.0)), wall, bounciness=1.0)
    assert after(world, "doc", 1, 1 / 30).velocities[0, 0] == pytest.approx(-200.0)


# Refusals


def test_what_it_does_not_do_is_declared():
    crate = Body("crate", Box((0.1, 0.1, 0.1)), 1.0, (0.0, 0.0, 0.1))
    with pytest.raises(Unsupported, match=r"'low' and 'crate'.*box on box"):
        engine(scene(replace(crate, name="low", mass=None), replace(crate, position=(0.0, 0.0, 1.0))))
    with pytest.raises(Unsupported, match=r"'askew'.*square"):
        engine(scene(crate, replace(crate, name="askew", position=(0.0, 0.0, 1.0), orientation=TURNED), axes=PLANE))
    with pytest.raises(Unsupported, match="one axis"):
        engine(scene(BALL, axes=(0,)))
    with pytest.raises(Unsupported, match="up to 500 movable"):
        engine(scene(*(replace(BALL, name=f"{k}", position=(float(k), 0.0, 0.0)) for k in range(501))))
    with pytest.raises(Unsupported, match="revert"):
        engine(scene(BALL), profile="revert")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, "'ball': mass 0.0"),
        ({"spin": (0.0, math.nan, 0.0)}, "'ball': spin"),
        ({"inertia": (1.0, -1.0, 1.0)}, "'ball': inertia"),
        ({"inertia": (1.0, 1.0, 3.0)}, "'ball': inertia"),
        ({"orientation": (1.0, 1.0, 0.0, 0.0)}, "'ball': orientation"),
        ({"shape": Capsule(-0.1, 0.2)}, "'ball': radius"),
        ({"shape": Capsule(0.1, math.nan)}, "'ball': half_length"),
        ({"shape": Sphere(0.0)}, "'ball': inertia"),
    ],
)
def test_a_bad_rigid_body_is_refused_by_name_and_field(change, message):
    with pytest.raises(ValueError, match=message):
        engine(scene(replace(BALL, **change)))
