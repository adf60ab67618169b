"""What can be chosen in the reference: strategies of R4, frictions of R5, the callback of R3, and what is refused."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from impactbench.reference.contestant import Stepped
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.flight import G
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Model, Scene, Sphere

STEP = 1 / 120
FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
BLOCK = Body("block", Box((0.2, 0.2, 0.05)), 2.0, (0.0, 0.0, 0.05), (3.0, 0.0, 0.0))
LEFT = Body("left", Sphere(0.1), 1.0, (-0.5, 0.0, 0.0), (2.0, 0.0, 0.0))
RIGHT = Body("right", Sphere(0.1), 3.0, (0.5, 0.0, 0.0))


def scene(*bodies: Body, gravity=0.0, rotation=False, **contact) -> Scene:
    model = Model((0, 1, 2), rotation=rotation, gravity=gravity != 0, friction=True)
    return Scene("test", bodies, 1.0, model, 1.0, 1.0, 1.0, (0.0, 0.0, -gravity), Contact(**contact))


def engine(world: Scene, profile="stepped", step=STEP, law="doc") -> Stepped:
    return Stepped(world, law, profile, world.model, step)


def kinetic(world: Scene, run: Stepped) -> float:
    masses = np.array([world.bodies[i].mass for i in world.movable])
    return float((masses[:, None] * run.read().velocities ** 2).sum() / 2)


def test_viscous_friction_as_a_force_is_eulers_explicit_step():
    run = engine(scene(FLOOR, BLOCK, gravity=G, bounciness=0.0, viscosity=4.0), "force")
    run.advance(30)
    assert run.read().velocities[0, 0] == pytest.approx(3 * (1 - 4.0 * STEP / 2.0) ** 30, rel=1e-12)


def test_between_two_bodies_the_force_goes_by_the_reduced_mass_and_keeps_momentum():
    upper = replace(BLOCK, name="upper", mass=1.0, position=(0.0, 0.0, 0.15))
    lower = replace(BLOCK, velocity=(0.0, 0.0, 0.0))
    world = replace(
        scene(FLOOR, lower, upper, gravity=G, bounciness=0.0),
        pairs=(("block", "upper", Contact(0.0, 0.0, 4.0)),),
    )
    run = engine(world, "force")
    run.advance(20)
    lower_x, upper_x = run.read().velocities[:, 0]
    assert 2 * lower_x + upper_x == pytest.approx(3.0, rel=1e-12)
    assert upper_x - lower_x == pytest.approx(3 * (1 - 4.0 * STEP * (1 + 1 / 2)) ** 20, rel=1e-11)


def test_a_force_that_would_reverse_the_sliding_is_refused_and_one_that_just_stops_it_is_not():
    with pytest.raises(ValueError, match=r"c h/m = 1.04 > 1"):
        engine(scene(FLOOR, BLOCK, gravity=G, bounciness=0.0, viscosity=250.0), "force")
    run = engine(scene(FLOOR, BLOCK, gravity=G, bounciness=0.0, viscosity=2.0 / STEP), "force")
    run.advance(2)
    assert abs(run.read().velocities[0, 0]) <= 1e-12


@pytest.mark.parametrize("law", ["doc", "nc"])
def test_velocities_from_positions_never_add_energy_and_keep_momentum(law):
    for b, offset, speed in itertools.product((0.0, 0.5, 1.0), (0.0, 0.12), (0.3, 2.0, 9.0)):
        world = scene(
            replace(LEFT, velocity=(speed, 0.0, 0.0)), replace(RIGHT, position=(0.3, offset, 0.0)), bounciness=b
        )
        run, last = engine(world, "positions", law=law), speed**2 / 2
        for _ in range(150):
            run.advance(1)
            now = kinetic(world, run)
            assert now <= last * (1 + 1e-14)
            last = now
        velocities = run.read().velocities
        assert velocities[0] + 3 * velocities[1] == pytest.approx([speed, 0.0, 0.0], abs=1e-13)
        assert last <= speed**2 / 2


def test_velocities_from_positions_are_close_to_an_inelastic_impact():
    """The first overlap d is less than s h: the approach falls to s - d/h, of which an elastic impact returns all."""
    world = scene(replace(LEFT, velocity=(2.0, 0.0, 0.0)), replace(RIGHT, mass=None, position=(0.31, 0.0, 0.0)))
    run = engine(world, "positions", step=0.1)  # after 4 steps 0.8 m: an overlap of 0.19 m of the 0.2 m of that step
    run.advance(5)
    gap = 0.61
    overlap = 0.8 - gap
    assert run.read().velocities[0, 0] == pytest.approx(-(2.0 - overlap / 0.1), rel=1e-9)


def test_the_callback_hears_of_contacts_and_its_marks_leave_at_the_end_of_the_step():
    third = replace(RIGHT, name="third", position=(2.0, 0.0, 0.0))
    run, heard = engine(scene(LEFT, RIGHT, third)), []

    def told(time: float, first: str, second: str) -> list[str]:
        heard.append((first, second, run.read().positions.shape[0]))
        return ["right"]

    run.on_contact(told)
    run.advance(120)
    assert heard == [("left", "right", 3)]
    positions, velocities = run.read().positions, run.read().velocities
    assert positions.shape == (2, 3)  # left and third, in the scene's order
    assert positions[1] == pytest.approx([2.0, 0.0, 0.0])
    assert abs(velocities[0, 0]) < 2  # the impact happened; the mark took the body away after it


def test_a_callback_that_marks_nothing_changes_nothing():
    world = scene(FLOOR, replace(LEFT, position=(0.0, 0.0, 0.5)), gravity=G, bounciness=0.7)
    plain, told, times = engine(world), engine(world), []
    told.on_contact(lambda time, *names: times.append(time) or ())
    plain.advance(200)
    told.advance(200)
    assert np.array_equal(plain.read().positions, told.read().positions)
    assert np.array_equal(plain.read().velocities, told.read().velocities)
    assert times[0] == pytest.approx(math.sqrt(2 * 0.4 / G), abs=2 * STEP)


def test_a_callback_that_names_no_body_is_refused_by_name():
    run = engine(scene(LEFT, RIGHT))
    run.on_contact(lambda *_: ["rihgt"])
    with pytest.raises(ValueError, match=r"rihgt.*left, right"):
        run.advance(120)
    with pytest.raises(Unsupported, match="runner of particles only"):
        engine(scene(LEFT, rotation=True)).on_contact(lambda *_: ())


STATICS = [
    FLOOR,
    Body("floor", Box((1.0, 1.0, 1.0)), None, (0.0, 0.0, -1.0), orientation=(0.6, 0.0, 0.0, 0.8)),
    Body("floor", Sphere(1.0), None, (0.0, 0.0, -1.0)),
    Body("floor", Capsule(1.0, 1.0), None, (0.0, 0.0, -2.0)),
]


@pytest.mark.parametrize("static", STATICS, ids=["half-space", "box", "sphere", "capsule"])
def test_a_body_that_starts_inside_a_static_one_is_refused_by_both_names(static):
    ball = replace(LEFT, position=(0.0, 0.0, -0.01))
    turning = not isinstance(static.shape, (HalfSpace, Sphere))
    with pytest.raises(ValueError, match=r"'left': position .* inside the static body 'floor'"):
        engine(scene(static, ball, rotation=turning))
    engine(scene(static, replace(ball, position=(0.0, 0.0, 0.05)), rotation=turning))  # half in: projected
