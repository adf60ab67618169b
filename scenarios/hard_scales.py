"""The same scene far away, small or large, and at odd steps."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.chain import chain_truth
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.hard_stacks import STANDS, stack_scene
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Body, Box, Contact, Model, Scene, Sphere
from impactbench.scenarios.survival import (
    PART,
    Criterion,
    HardFamily,
    Knob,
    at_end,
    hard_family,
    invariant,
    step_of,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 240
RADIUS, SPEED = 0.1, 1.5


def far_from_origin(offset: float) -> Case:
    """Two equal balls meet head-on, e = .5, `offset` [m] away from the origin: coordinates carry fewer digits there."""
    parameters: Parameters = {"offset": offset}
    scene = Scene(
        name=case_name("far_from_origin", parameters),
        bodies=tuple(
            Body(f"ball {k}", Sphere(RADIUS), 1.0, (offset + s * 0.613, 0.0, 0.0), (-s * SPEED, 0.0, 0.0))
            for k, s in enumerate((-1.0, 1.0))
        ),
        duration=1.0,
        model=Model((0,)),
        length=2 * SPEED,
        speed=2 * SPEED,
        energy=SPEED**2,
        contact=Contact(0.5),
        parameters=parameters,
    )
    return Case(scene, dict.fromkeys(scene.laws, chain_truth(scene)))


def far_criteria(scene: Scene) -> tuple[Criterion, ...]:
    end = far_from_origin(float(scene.parameters["offset"])).truths["nc"].state(scene.duration)
    assert end is not None

    def speed(scene: Scene, trajectory: Trajectory) -> Floats:
        return at_end(trajectory, float(np.abs(trajectory.velocities[-1] - end.velocities).max()) / scene.speed)

    def place(_: Scene, trajectory: Trajectory) -> Floats:
        late = 1.5 * SPEED * step_of(trajectory)
        return at_end(trajectory, float(np.abs(trajectory.positions[-1] - end.positions).max()) / late)

    return (
        Criterion(
            "speed", "the balls leave as they do at the origin", PART, "mechanics knows no origin (R7-R9)", speed
        ),
        Criterion(
            "place", "and are where they are there", 1.0, "an impact up to a step late is off by (1 + e) v h", place
        ),
    )


def scaled(family: str, scale: float) -> Case:
    """Three balls of `scale` [m] diameter in a column, each overlapped with the one below by a tenth of it.

    Times and steps are those of gravity at that size, sqrt(scale): every size is the same problem.
    """
    radius = scale / 2
    parameters: Parameters = {"scale": scale}
    scene = Scene(
        name=case_name(family, parameters),
        bodies=(
            FLOOR,
            *(Body(f"ball {i}", Sphere(radius), scale**3, (0.0, 0.0, radius * (1 + 1.8 * i))) for i in range(3)),
        ),
        duration=3.0 * math.sqrt(scale),
        model=Model((2,), gravity=True),
        length=scale,
        speed=math.sqrt(2 * G * scale),
        energy=3 * scale**3 * G * scale,
        gravity=DOWN,
        contact=Contact(0.0),
        phase_free=False,
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def tiny(scale: float) -> Case:
    """See `scaled`."""
    return scaled("tiny", scale)


def huge(scale: float) -> Case:
    """See `scaled`."""
    return scaled("huge", scale)


def heights(scene: Scene, trajectory: Trajectory) -> Floats:
    """Deviation of the spacings at the end, in diameters."""
    found = np.diff(trajectory.positions[-1, :, 2], prepend=0.0) / scene.length
    return at_end(trajectory, float(np.abs(found - np.array([0.5, 1.0, 1.0])).max()))


def hasty(scene: Scene, trajectory: Trajectory) -> Floats:
    """Fastest ball over the last fifth, next to what gravity adds in a step."""
    speed = np.linalg.norm(trajectory.velocities, axis=2).max(axis=1) / (G * step_of(trajectory))
    return np.asarray(np.where(trajectory.times >= 0.8 * scene.duration, speed, 0.0))


SCALED = (
    Criterion(
        "heights", "balls rest a diameter apart", PART, "gravity at any size is one problem: the answer scales", heights
    ),
    Criterion(
        "quiet", "at rest over the last fifth", 1.0, "a solver that holds a body cancels g h at every step", hasty
    ),
)


def scaled_steps(scene: Scene) -> tuple[str, ...]:
    return (f"{STEP * math.sqrt(scene.length):.6g}",)


def step_extremes(scene: str) -> Case:
    """`bounce`: a ball falls 1 m onto the floor, e = .8, and rises again. `stack`: ten blocks fall, 1 cm apart."""
    parameters: Parameters = {"scene": scene}
    if scene == "stack":
        blocks = [Body(f"block {i}", Box((0.5, 0.5, 0.5)), 1.0, (0.0, 0.0, 0.5 + 1.01 * i + 0.01)) for i in range(10)]
        found = stack_scene("step_extremes", parameters, blocks, Model((2,), gravity=True), 4.0)
        return Case(found, invariant(found))
    found = Scene(
        name=case_name("step_extremes", parameters),
        bodies=(FLOOR, Body("ball", Sphere(RADIUS), 1.0, (0.0, 0.0, 1.0 + RADIUS))),
        duration=1.0,
        model=Model((2,), gravity=True),
        length=1.0,
        speed=math.sqrt(2 * G),
        energy=G,
        gravity=DOWN,
        contact=Contact(0.8),
        parameters=parameters,
    )
    return Case(found, dict.fromkeys(found.laws, chain_truth(found)))


def step_criteria(scene: Scene) -> tuple[Criterion, ...]:
    if scene.parameters["scene"] == "stack":
        return (STANDS,)
    end = step_extremes("bounce").truths["nc"].state(scene.duration)
    assert end is not None
    e, fall = scene.contact.bounciness, math.sqrt(2 / G)

    def error(scene: Scene, trajectory: Trajectory) -> Floats:
        h = step_of(trajectory)
        # The last reading may lie up to half a step off the scene's end.
        due = step_extremes("bounce").truths["nc"].state(float(trajectory.times[-1]))
        assert due is not None
        allowed = h * ((1 + e) * scene.speed + G * scene.duration / 2 + (1 + e) * G * (scene.duration - fall))
        return at_end(trajectory, float(np.abs(trajectory.positions[-1] - due.positions).max()) / allowed)

    why = (
        "first order: an impact a step late costs (1 + e) v h, the integrator g h t/2, and a speed at the impact off by"
        " g h grows to (1 + e) g h over the rest of the time"
    )
    return (Criterion("error", "the error falls with the step, down to round-off", 1.0, why, error),)


def extreme_steps(scene: Scene) -> tuple[str, ...]:
    coarse = ("1/15", "1/30", "1/60", "1/240", "0.001")
    return coarse if scene.parameters["scene"] == "stack" else (*coarse, "0.0001", "0.00001")


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "far_from_origin",
        "Is the answer the same far from the origin?",
        "1 dimension, two-way impact",
        far_from_origin,
        far_criteria,
        [{"offset": 10.0**k} for k in (0, 3, 5, 7, 12)],
        knob=Knob("offset", 1.0, 1e16, "log"),
    ),
    hard_family(
        "tiny",
        "Does size matter where it must not: small?",
        "1 dimension, gravity, overlaps",
        tiny,
        lambda _: SCALED,
        [{"scale": 10.0**-k} for k in (0, 1, 2, 3)],
        steps=scaled_steps,
    ),
    hard_family(
        "huge",
        "Does size matter where it must not: large?",
        "1 dimension, gravity, overlaps",
        huge,
        lambda _: SCALED,
        [{"scale": 10.0**k} for k in (1, 2, 3)],
        steps=scaled_steps,
    ),
    hard_family(
        "step_extremes",
        "Which steps work, from coarse to fine?",
        "1 dimension, gravity",
        step_extremes,
        step_criteria,
        [{"scene": "bounce"}, {"scene": "stack"}],
        knob=Knob("step", 0.001, 0.2, "log", fixed={"scene": "stack"}),
        steps=extreme_steps,
        policies=("mujoco/cushion",),
    ),
)
