"""Free flight: no contact at all, so that whatever error remains is the integrator's."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Model, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case, Family, Truth

G = 9.81
DOWN: Vector = (0.0, 0.0, -G)

LAUNCHES: dict[int, tuple[tuple[int, ...], Vector]] = {
    1: ((2,), (0.0, 0.0, 5.0)),
    2: ((0, 2), (3.0, 0.0, 5.0)),
    3: ((0, 1, 2), (3.0, -2.0, 5.0)),
}
"""Dimension -> the model's axes, and the velocity [m/s] at t = 0."""


def free_flight(dimension: int) -> Case:
    """x(t) = x0 + v0 t + g t^2/2 (parabola), under both laws, which differ at contacts only."""
    axes, velocity = LAUNCHES[dimension]
    duration, mass, speed = 1.0, 1.0, float(np.linalg.norm(velocity))
    parameters: Parameters = {"dimension": dimension}
    scene = Scene(
        name=case_name("free_flight", parameters),
        bodies=(Body("ball", Sphere(0.1), mass, (0.0, 0.0, 5.0), velocity),),
        duration=duration,
        model=Model(axes, gravity=True),
        length=G * duration**2 / 2,  # the fall: what a frozen gravity would miss
        speed=speed,
        energy=mass * speed**2 / 2,  # kinetic, at the start
        gravity=DOWN,
        collide=False,
        parameters=parameters,
    )
    truth = Truth("trajectory", motion([opening(scene)]))
    return Case(scene, dict.fromkeys(scene.laws, truth))


def discrete_flight(scene: Scene, step: float, steps: int, velocity_first: bool) -> State:
    """What Euler's method leaves after `steps` steps of free flight, without round-off.

    Velocity first (semi-implicit): x_n = x0 + v0 t + g t^2/2 + g h t/2; position first (explicit): - g h t/2.
    Velocities are exact.
    From x_n = x0 + h sum v_k, with v_k = v0 + k h g summed over k = 1..n or k = 0..n-1.
    """
    exact = opening(scene).at(step * steps)
    g: Floats = np.array(scene.gravity)
    offset = g * step * (step * steps) / 2
    return State(exact.positions + (offset if velocity_first else -offset), exact.velocities)


FAMILIES = (
    Family(
        "free_flight",
        "How far off is the integrator where nothing touches?",
        "1 to 3 dimensions, gravity",
        lambda: [free_flight(dimension) for dimension in LAUNCHES],
    ),
)
