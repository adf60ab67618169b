"""The particle route of R14: particles joined by distance constraints, whose spin emerges; approximate by its nature.

Positions are moved by the velocities, put right by Gauss-Seidel over the distances (each shared by mass, documents,
rule R4), and velocities follow from positions. Impacts are those of single particles (R9): the struck particle alone
answers, and the distances hand the blow on. So an impact sees less mass than the rigid body's effective one (R14),
unless the struck particle carries just that, as the end of a dumbbell does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from impactbench.reference.impact import bounce
from impactbench.reference.rigid_body import Rigid
from impactbench.reference.rigid_impact import bounce as rigid_bounce
from impactbench.scenarios.trajectory import Floats

SWEEPS = 50
AXIS = np.array([1.0, 0.0, 0.0])
BALL, SPEED, TIME = 1.0, 1.0, 0.1
SHAPES = {
    "dumbbell, its end": (np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]]), 1),
    "square, a corner": (np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]), 3),
}
"""Particles of 1 kg [m] about their centre, and the one that a ball of 1 kg hits at 1 m/s along x."""


@dataclass(frozen=True)
class Outcome:
    """Ball's speed, body's speed [m/s] along x and its spin about z [rad/s] after the impact."""

    ball: float
    body: float
    spin: float


def rigid_route(shape: str, bounciness: float) -> Outcome:
    """R14 for the rigid body of the same particles."""
    places, struck = SHAPES[shape]
    inertia = sum(float(x @ x) for x in places)
    ball = Rigid(BALL, 1e-12 * np.eye(3), SPEED * AXIS, np.zeros(3), np.zeros(3))
    body = Rigid(float(len(places)), inertia * np.eye(3), np.zeros(3), np.zeros(3), places[struck])
    (ball_after, _), (velocity, spin) = rigid_bounce(ball, body, AXIS, bounciness)
    return Outcome(float(ball_after[0]), float(velocity[0]), float(spin[2]))


def particle_route(shape: str, bounciness: float, step: float) -> Outcome:
    """The same impact on joined particles, read after `TIME`; spin is angular momentum over inertia."""
    start, struck = SHAPES[shape]
    x, v = start.copy(), np.zeros_like(start)
    ball_x, ball_v = start[struck].copy(), SPEED * AXIS
    lengths = [(i, j, float(np.linalg.norm(x[i] - x[j]))) for i, j in combinations(range(len(x)), 2)]
    for _ in range(round(TIME / step)):
        if float((ball_x - x[struck]) @ AXIS) >= 0 and float((ball_v - v[struck]) @ AXIS) > 0:
            ball_v, v[struck] = bounce(BALL, 1.0, ball_v, v[struck], AXIS, bounciness)
        ball_x = ball_x + step * ball_v
        moved = x + step * v
        satisfy(moved, lengths)
        x, v = moved, (moved - x) / step
    centre, velocity = x.mean(axis=0), v.mean(axis=0)
    momentum = np.cross(x - centre, v - velocity).sum(axis=0)
    inertia = float(((x - centre) ** 2).sum())
    return Outcome(float(ball_v[0]), float(velocity[0]), float(momentum[2]) / inertia)


def satisfy(places: Floats, lengths: list[tuple[int, int, float]]) -> None:
    """Bring all distances back, pair after pair; both particles move by half, so that their centre stays."""
    for _ in range(SWEEPS):
        for i, j, length in lengths:
            between = places[j] - places[i]
            distance = float(np.linalg.norm(between))
            shift = (distance - length) / (2 * distance) * between
            places[i] += shift
            places[j] -= shift
