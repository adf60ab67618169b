"""Fast and glancing bodies: what a step can jump over."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Box, Contact, Model, Scene, Sphere
from impactbench.scenarios.survival import PART, Criterion, HardFamily, Knob, at_end, from_time, hard_family
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Truth

STEP = 1 / 240  # s; the travel per step is a parameter of these scenes, so they are made for one step
RADIUS, THICKNESS, BULLETS = 0.05, 0.02, 8


def bullet_wall(travel: float) -> Case:
    """Balls side by side fly at a thin fixed wall, `travel` of its thicknesses per step; b = 1.

    They start at equal fractions of a step from one another, so that every impact phase is there. Truth: back with -v.
    """
    speed = travel * THICKNESS / STEP
    parameters: Parameters = {"travel": travel}
    reach = RADIUS + THICKNESS / 2
    starts = [-reach - 1.0 - k / BULLETS * speed * STEP for k in range(BULLETS)]
    places = [k - (BULLETS - 1) / 2 for k in range(BULLETS)]
    slab = Body("wall", Box((THICKNESS / 2, 1.0, float(BULLETS))), None, (0.0, 0.0, 0.0))
    balls = [
        Body(f"ball {k}", Sphere(RADIUS), 1.0, (x, 0.0, z), (speed, 0.0, 0.0))
        for k, (x, z) in enumerate(zip(starts, places, strict=True))
    ]
    times = [(-reach - x) / speed for x in starts]
    scene = Scene(
        name=case_name("bullet_wall", parameters),
        bodies=(slab, *balls),
        duration=1.5 * max(times) + 10 * STEP,
        model=Model((0,)),
        length=1.0,
        speed=speed,
        energy=BULLETS * speed**2 / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )
    pieces = [opening(scene)]
    for time in sorted(times):
        turned = pieces[-1].velocities.copy()
        turned[times.index(time)] *= -1
        pieces.append(pieces[-1].then(time, velocities=turned))
    truth = Truth("trajectory", motion(pieces), tuple(sorted(times)))
    return Case(scene, dict.fromkeys(scene.laws, truth))


def beyond(_: Scene, trajectory: Trajectory) -> Floats:
    """Radii by which the furthest ball's centre lies beyond the wall's middle for good.

    For good: the least over all time to come. A centre that is past the middle at one reading
    and back at the next has not passed.
    """
    x = trajectory.positions[:, :, 0]
    for_good = np.minimum.accumulate(x[::-1], axis=0)[::-1]
    return np.asarray(for_good.max(axis=1) / RADIUS)


def approach(scene: Scene, trajectory: Trajectory) -> Floats:
    """Speed before the first ball can touch, next to the speed it was given."""
    speed = np.abs(trajectory.velocities[:, :, 0] / scene.speed - 1).max(axis=1)
    return np.where(trajectory.times < 1.0 / scene.speed - STEP, speed, 0.0)


def rebound(scene: Scene, trajectory: Trajectory) -> Floats:
    """Final velocities next to -v."""
    return at_end(trajectory, float(np.abs(trajectory.velocities[-1, :, 0] / scene.speed + 1).max()))


BULLET = (
    Criterion("holds", "no ball's centre gets beyond the wall for good", 0.0, "a wall is solid", beyond),
    Criterion("approach", "the speed is that given, until the wall", PART, "nothing acts on a free ball", approach),
    Criterion("rebound", "every ball comes back with -v", PART, "b = 1 against a fixed wall (R13)", rebound),
)


def fast_flight(speed: float) -> Case:
    """One ball, no forces, no contacts: it keeps its velocity."""
    parameters: Parameters = {"speed": speed}
    scene = Scene(
        name=case_name("fast_flight", parameters),
        bodies=(Body("ball", Sphere(RADIUS), 1.0, (0.0, 0.0, 0.0), (speed, 0.0, 0.0)),),
        duration=1.0,
        model=Model((0,)),
        length=speed,
        speed=speed,
        energy=speed**2 / 2,
        collide=False,
        parameters=parameters,
    )
    return Case(scene, dict.fromkeys(scene.laws, Truth("trajectory", motion([opening(scene)]))))


def slowed(scene: Scene, trajectory: Trajectory) -> Floats:
    return from_time(trajectory, 0.0, np.abs(trajectory.velocities[:, 0, 0] / scene.speed - 1))


def clipped(scene: Scene, trajectory: Trajectory) -> Floats:
    """Relative change of the velocity over the first step."""
    change = np.zeros(len(trajectory.times))
    change[1] = abs(trajectory.velocities[1, 0, 0] / scene.speed - 1)
    return change


FAST = (
    Criterion("speed", "the speed stays as given", PART, "no force acts: v is constant", slowed),
    Criterion(
        "unclipped",
        "one step takes no more than a twentieth of the speed",
        0.05,
        "no force acts. Damping of a vendor's defaults takes little a step; a largest speed takes all above it, so "
        "this breaks a twentieth above it",
        clipped,
    ),
)

FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "bullet_wall",
        "At which travel per step does a ball pass through a thin wall?",
        "1 dimension, one-way impacts",
        bullet_wall,
        lambda _: BULLET,
        [{"travel": travel} for travel in (0.1, 0.5, 1.0, 4.0, 10.0, 20.0, 100.0, 1000.0)],
        knob=Knob("travel", 0.1, 1000.0, "log", criteria=("holds",)),
        policies=("pybullet/swept", "mujoco/speculative", "pymunk/substeps"),
    ),
    hard_family(
        "fast_flight",
        "Is a free body allowed to be fast?",
        "1 dimension, no contact",
        fast_flight,
        lambda _: FAST,
        [{"speed": 10.0**k} for k in (0, 1, 2, 3, 4, 11)],
        knob=Knob("speed", 1.0, 1e6, "log", criteria=("unclipped",)),
        outcome=lambda _, trajectory: f"{trajectory.velocities[1, 0, 0]:.6g} m/s after one step",
    ),
)
