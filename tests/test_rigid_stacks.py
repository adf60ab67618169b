"""Boxes on boxes in the runner: stacks at rest, margins of statics, sliding, impacts, energy of a falling pile."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference.contestant import Stepped
from impactbench.reference.rigid_run import TOUCH
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.hard_stacks import PLANAR, tall_stack
from impactbench.scenarios.hard_structures import HOLDS_AT, TIPS_AT, arch, lowered, overhang, pyramid, sunk, tipping
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Scene
from impactbench.scenarios.trajectory import State, Trajectory
from test_rigid_run import energy, momenta

STEP = 1 / 240
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))


def scene(*bodies: Body, gravity=G, **contact) -> Scene:
    return Scene("test", bodies, 2.0, PLANAR, 1.0, 1.0, 1.0, (0.0, 0.0, -gravity), Contact(**contact))


def lean(angle: float) -> tuple[float, float, float, float]:
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def after(world: Scene, seconds: float, law="nc", step=STEP) -> State:
    run = Stepped(world, law, "stepped", world.model, step)
    run.advance(round(seconds / step))
    return run.read()


def trajectory(world: Scene) -> Trajectory:
    """Start and end of the scene's run."""
    run = Stepped(world, "nc", "stepped", world.model, STEP)
    states = [run.read()]
    run.advance(round(world.duration / STEP))
    states.append(run.read())
    fields = [
        np.array([getattr(s, name) for s in states]) for name in ("positions", "velocities", "orientations", "spins")
    ]
    return Trajectory(np.array([0.0, world.duration]), *fields)


# At rest


STACKS = [tall_stack("box", 10), tall_stack("box", 40), pyramid(7), overhang(8, 0.9, "stand")]


@pytest.mark.parametrize("case", STACKS, ids=lambda case: case.scene.name)
def test_a_stack_in_equilibrium_stays_where_it_is(case):
    """A contact that touches closes no gap below a thousandth of a touch, and what it pushes leaves `STILL`: nothing
    moves by more than a touch.
    """
    found = trajectory(case.scene)
    assert np.abs(found.positions[1] - found.positions[0]).max() <= TOUCH * case.scene.length
    assert np.abs(found.velocities[1]).max() <= 1e-9 * case.scene.speed


def test_a_stack_of_ten_adds_no_energy_in_any_step():
    world = tall_stack("box", 10).scene
    run, found = Stepped(world, "nc", "stepped", world.model, STEP), []
    for _ in range(240):
        found.append(energy(world, run.read()))
        run.advance(1)
    assert np.diff(found).max() <= 1e-14 * found[0]


# Margins of statics: stands at 0.98 of the limit, falls at 1.02


def test_books_overhang_by_half_the_harmonic_sum_and_no_further():
    for count in (4, 6):
        stands, falls = (overhang(count, f, "stand").scene for f in (0.98, 1.02))
        assert sunk(stands, trajectory(stands)).max() <= 1e-9
        assert sunk(falls, trajectory(falls)).max() >= 1.0


def test_a_box_tips_where_its_weight_passes_its_edge():
    stands, tips = (replace(tipping(f * TIPS_AT, "stand").scene, duration=3.0) for f in (0.98, 1.02))
    assert np.abs(np.diff(trajectory(stands).positions, axis=0)).max() <= 1e-9
    assert abs(trajectory(tips).orientations[1, 0, 0]) == pytest.approx(math.cos(math.pi / 4), abs=1e-6)  # on its side


def test_half_an_arch_stands_where_friction_carries_its_thrust():
    stands, falls = (arch(f * HOLDS_AT, "stand").scene for f in (1.02, 0.98))
    assert lowered(stands, trajectory(stands)).max() <= 1e-9
    assert lowered(falls, trajectory(falls)).max() >= 1.0


# Sliding


def test_a_box_slides_on_a_plank_until_both_move_as_one():
    """Block m on plank M, mu between them, a smooth floor: they close in at mu g (1 + m/M) and end at m v/(m + M)."""
    m, heavy, v, mu = 1.0, 3.0, 2.0, 0.4
    plank = Body("plank", Box((2.0, 0.5, 0.1)), heavy, (0.0, 0.0, 0.1))
    block = Body("block", Box((0.1, 0.1, 0.1)), m, (-1.0, 0.0, 0.3), (v, 0.0, 0.0))
    world = replace(
        scene(FLOOR, plank, block, bounciness=0.0, friction=mu), pairs=(("floor", "plank", Contact(0.0, 0.0)),)
    )
    state = after(world, 1.0)
    assert state.velocities == pytest.approx(np.tile([m * v / (m + heavy), 0.0, 0.0], (2, 1)), abs=1e-12)
    moved = state.positions[1, 0] - state.positions[0, 0] + 1.0
    # The step in which sliding ends has a kink: its way errs by a h^2/8 at most.
    rate = mu * G * (1 + m / heavy)
    assert moved == pytest.approx(v**2 / 2 / rate, abs=rate * STEP**2 / 8)


def test_a_box_slides_from_one_box_onto_the_next_across_their_seam():
    bodies = [Body(f"{k}", Box((0.5, 0.5, 0.25)), None, (float(k), 0.0, 0.0)) for k in range(3)]
    slider = Body("slider", Box((0.1, 0.1, 0.1)), 1.0, (0.0, 0.0, 0.35), (2.0, 0.0, 0.0))
    state = after(scene(*bodies, slider, bounciness=0.5, friction=0.1), 0.9)
    assert state.positions[0] == pytest.approx([1.8 - 0.1 * G * 0.9**2 / 2, 0.0, 0.35], abs=1e-9)
    assert np.abs(state.spins).max() <= 1e-9


# Impacts


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_a_box_that_lands_flat_on_a_box_does_not_turn(law):
    low = Body("low", Box((0.5, 0.5, 0.5)), None, (0.0, 0.0, 0.0))
    world = scene(low, Body("high", Box((0.2, 0.2, 0.1)), 1.0, (0.1, 0.0, 1.0)), bounciness=0.5)
    fall = math.sqrt(2 * 0.4 / G)
    state = after(world, fall + 0.1, law, (fall + 0.1) / 48)
    assert np.abs(state.spins).max() <= 1e-12
    assert state.velocities[0] == pytest.approx([0.0, 0.0, 0.5 * G * fall - G * 0.1], abs=1e-9)


def test_a_box_that_lands_on_its_corner_leaves_as_the_effective_mass_says():
    """e = 1, no friction: J = 2 m_eff v with 1/m_eff = 1/m + x^2/I, x the corner's place beside the centre."""
    low = Body("low", Box((1.0, 0.5, 0.5)), None, (0.0, 0.0, 0.0))
    box = Body("box", Box((0.2, 0.2, 0.1)), 2.0, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lean(0.3))
    state = after(scene(low, box, gravity=0.0, bounciness=1.0), 0.4)
    x = 0.2 * math.cos(0.3) - 0.1 * math.sin(0.3)  # of the corner +-, the lowest: a spin about y lowers +x
    inertia = box.principal_inertia()[1]
    blow = 2 * 1.0 / (1 / 2.0 + x * x / inertia)
    assert state.velocities[0] == pytest.approx([0.0, 0.0, -1.0 + blow / 2.0], abs=1e-12)
    assert state.spins[0] == pytest.approx([0.0, -x * blow / inertia, 0.0], abs=1e-12)


SPINS = st.tuples(*[st.floats(-3, 3)] * 4)
SHAPES = {"box": Box((0.3, 0.2, 0.15)), "capsule": Capsule(0.1, 0.25)}


@pytest.mark.parametrize("law", ["doc", "nc"])
@given(st.sampled_from(sorted(SHAPES)), st.floats(-0.2, 0.2), SPINS, st.floats(0.2, 5), st.floats(0, 1))
@settings(max_examples=40, deadline=None)
def test_impacts_keep_both_momenta_and_gain_no_energy(law, shape, z, spins, mass, b):
    """R6 and R14, until the step of the first impact is over: bodies that stay in touch and turn are lifted (R4), which
    moves angular momentum at first order; so Newton's e is not 0.
    """
    first, second, spin, other = spins
    b = b if law == "doc" else 0.2 + 0.8 * b
    world = scene(
        Body("a", SHAPES["box"], 1.0, (-0.6, 0.0, 0.0), (4.0, 0.0, 0.0), lean(first), (0.0, spin, 0.0)),
        Body("b", SHAPES[shape], mass, (0.4, 0.0, z), (0.0, 0.0, 0.0), lean(second), (0.0, other, 0.0)),
        gravity=0.0,
        bounciness=b,
    )
    run = Stepped(world, law, "stepped", world.model, STEP)
    before = run.read()
    for _ in range(60):
        run.advance(1)
        state = run.read()
        if np.abs(state.velocities - before.velocities).max() > 0:
            break
    else:
        pytest.fail("they did not meet")
    size = 4.0 + 12.0 * mass
    assert np.abs(momenta(world, state) - momenta(world, before)).max() <= 1e-10 * size
    assert energy(world, state) - energy(world, before) <= 1e-12 * energy(world, before)


# A pile


def pile(count: int, bounciness: float, friction: float) -> Scene:
    """Boxes and capsules of all sizes that tumble down on one another."""
    random = np.random.default_rng(count)
    bodies = [FLOOR]
    for i in range(count):
        half = tuple(random.uniform(0.2, 0.5, 2))
        shape = Capsule(half[0] / 2, half[1]) if i % 4 == 3 else Box((half[0], 0.3, half[1]))
        place = ((i % 3 - 1) * 1.7 + random.uniform(-0.1, 0.1), 0.0, 1.0 + 1.7 * (i // 3))
        turned, spin = lean(random.uniform(-math.pi, math.pi)), (0.0, random.uniform(-2, 2), 0.0)
        bodies.append(Body(f"{i}", shape, random.uniform(0.5, 2.0), place, orientation=turned, spin=spin))
    return replace(
        scene(*bodies, bounciness=bounciness, friction=friction, viscosity=0.5), gravity=DOWN, length=1.0, speed=5.0
    )


@pytest.mark.parametrize(("law", "b", "mu"), [("nc", 0.0, 0.5), ("nc", 0.5, 0.0), ("doc", 0.5, 0.0)])
def test_a_falling_pile_gains_no_energy_but_what_its_lifts_still_owe(law, b, mu):
    """Kinetic and potential energy less the debts never grows; Newton's e with friction might (`rigid_newton`)."""
    world = pile(9, b, mu)
    run, found = Stepped(world, law, "stepped", world.model, 1 / 120), []
    for _ in range(300):
        found.append(energy(world, run.read()) - run._runner._solids.debt.sum())
        run.advance(1)
    assert np.diff(found).max() <= 1e-12 * found[0]
    assert run._runner._solids.debt.sum() <= 1e-3 * found[0]
    assert energy(world, run.read()) < 0.7 * found[0]


def test_an_elastic_pile_keeps_its_energy():
    world = pile(9, 1.0, 0.0)
    run = Stepped(replace(world, contact=Contact(1.0)), "doc", "stepped", world.model, 1 / 120)
    before = energy(world, run.read())
    run.advance(240)
    assert energy(world, run.read()) == pytest.approx(before, rel=1e-11)
