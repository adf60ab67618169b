"""Stacks that start at rest, touching, in static equilibrium: whatever moves is the engine's."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Body, Box, Contact, Model, Scene, Sphere
from impactbench.scenarios.survival import Criterion, HardFamily, Knob, at_rest, hard_family, masses, step_of
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

HALF = 0.5  # m; the engines' own stacks are made of unit boxes, so that figures compare
MU = 0.5
PLANAR = Model((0, 2), rotation=True, gravity=True, friction=True)
COLUMN = Model((2,), gravity=True)


def stack_scene(
    family: str, parameters: Parameters, bodies: list[Body], model: Model, duration: float, friction: float = MU
) -> Scene:
    """Inelastic bodies on the floor, at rest from the start; scales are those of a fall by one body."""
    weight = sum(body.mass or 0.0 for body in bodies)
    return Scene(
        name=case_name(family, parameters),
        bodies=(FLOOR, *bodies),
        duration=duration,
        model=model,
        length=2 * HALF,
        speed=math.sqrt(2 * G * 2 * HALF),
        energy=weight * G * 2 * HALF,
        gravity=DOWN,
        contact=Contact(0.0, friction if model.friction else 0.0),
        laws=("nc",) if model.friction else ("doc", "nc"),
        phase_free=False,
        parameters=parameters,
    )


def column(family: str, parameters: Parameters, shape: str, weights: list[float], duration: float) -> Case:
    """Bodies of half height HALF on top of each other. Balls cannot leave the line, boxes may lean and turn."""
    solid = Sphere(HALF) if shape == "sphere" else Box((HALF, HALF, HALF))
    bodies = [Body(f"body {i}", solid, m, (0.0, 0.0, HALF * (2 * i + 1))) for i, m in enumerate(weights)]
    model = PLANAR if shape == "box" else COLUMN
    scene = stack_scene(family, parameters, bodies, model, duration)
    return Case(scene, dict.fromkeys(scene.laws, at_rest(scene)))


def tall_stack(shape: str, count: int) -> Case:
    """`count` equal bodies in a column."""
    return column("tall_stack", {"shape": shape, "count": count}, shape, [1.0] * count, 10.0)


def heavy_on_light(ratio: float) -> Case:
    """A block `ratio` times as heavy on a block of 1 kg; both move along the vertical only."""
    return column("heavy_on_light", {"ratio": ratio}, "block", [1.0, ratio], 5.0)


def light_on_heavy(ratio: float) -> Case:
    """A block of 1 kg on one `ratio` times as heavy."""
    return column("light_on_heavy", {"ratio": ratio}, "block", [ratio, 1.0], 5.0)


def spacing(_: Scene, trajectory: Trajectory) -> Floats:
    """Largest deviation of the height of a body above the one below it (or the floor) from its due, in half bodies."""
    heights = trajectory.positions[:, :, 2]
    due = np.full(heights.shape[1], 2 * HALF)
    due[0] = HALF
    return np.asarray(np.abs(np.diff(heights, axis=1, prepend=0.0) - due).max(axis=1) / HALF)


def leaning(scene: Scene, trajectory: Trajectory) -> Floats:
    """How far the centre of mass of all above a body lies off its centre, in half bodies; the worst body counts."""
    weights = masses(scene)
    if len(weights) < 2:
        return np.zeros(len(trajectory.times))
    flat = trajectory.positions[:, :, :2]
    above = np.cumsum((flat * weights[:, None])[:, ::-1], axis=1)[:, ::-1][:, 1:]
    centre = above / np.cumsum(weights[::-1])[::-1][1:, None]
    return np.asarray(np.abs(centre - flat[:, :-1]).max(axis=(1, 2)) / HALF)


def restless(_: Scene, trajectory: Trajectory) -> Floats:
    """Fastest body over the last fifth of the run, next to what gravity adds in one step."""
    speed = np.linalg.norm(trajectory.velocities, axis=2).max(axis=1) / (G * step_of(trajectory))
    return np.where(trajectory.times >= 0.8 * trajectory.times[-1], speed, 0.0)


STANDS = Criterion(
    "stands",
    "every body keeps its place on the one below",
    1.0,
    "rigid bodies touch: centres are one body apart. Off by half a body, a centre has entered its neighbour or left it",
    spacing,
)
SUPPORTED = Criterion(
    "supported",
    "the centre of mass of all above a body lies over it",
    1.0,
    "statics: beyond the edge of the face (half a body) gravity's moment turns everything above over",
    leaning,
)
QUIET = Criterion(
    "quiet",
    "at rest over the last fifth",
    1.0,
    "a solver that holds a body cancels g h at every step; who moves faster has not cancelled it",
    restless,
)


def column_criteria(scene: Scene) -> tuple[Criterion, ...]:
    return (STANDS, SUPPORTED, QUIET) if scene.model.rotation else (STANDS, QUIET)


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "tall_stack",
        "Does a column stand, and how high?",
        "1 dimension (balls), 2 dimensions with rotation (boxes), gravity, friction",
        tall_stack,
        column_criteria,
        [{"shape": shape, "count": n} for shape in ("sphere", "box") for n in (5, 20, 50, 100)],
        full=({"shape": "box", "count": 200}, {"shape": "sphere", "count": 200}),
        knob=Knob("count", 2, 200, "int", criteria=("stands", "supported"), fixed={"shape": "box"}),
        policies=("pybullet/iterations", "pymunk/iterations", "mujoco/stiff", "mujoco/cushion"),
        seconds=120.0,
    ),
    hard_family(
        "heavy_on_light",
        "Does a light block carry a heavy one, up to which ratio?",
        "1 dimension, gravity, lasting contact",
        heavy_on_light,
        column_criteria,
        [{"ratio": 10.0**k} for k in (0, 1, 2, 3, 4, 6)],
        knob=Knob("ratio", 1.0, 1e8, "log", criteria=("stands",)),
        policies=("pybullet/iterations", "pymunk/iterations", "mujoco/stiff", "mujoco/cushion"),
    ),
    hard_family(
        "light_on_heavy",
        "Does a light block rest on a heavy one?",
        "1 dimension, gravity, lasting contact",
        light_on_heavy,
        column_criteria,
        [{"ratio": 10.0**k} for k in (2, 4, 6)],
        knob=Knob("ratio", 1.0, 1e8, "log", criteria=("stands",)),
    ),
)
