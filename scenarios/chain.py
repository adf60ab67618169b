"""Bodies on a line, solved event by event without a time step: the truth of every one-dimensional chain."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.laws import impact
from impactbench.scenarios.pieces import Piece, motion, opening
from impactbench.scenarios.records import Box, Scene, Sphere
from impactbench.scenarios.trajectory import Floats
from impactbench.scenarios.truth import Truth

MOST_EVENTS = 1000
FLOOR = -1
"""Index of the lower partner of body 0, where there is a floor."""


def chain_truth(scene: Scene) -> Truth:
    """Impacts one after the other along the model's only axis (R7-R9 head-on, the same under both laws).

    Movable bodies are listed in ascending order. All share one acceleration, so neighbours approach uniformly:
    t = gap/closing speed. A static half-space at the origin, if any, is the floor: gap + v t - g t^2/2 = 0.
    """
    (axis,) = scene.model.axes
    piece = opening(scene)
    pieces, times = [piece], list[float]()
    for _ in range(MOST_EVENTS):
        waits = _waits(scene, axis, piece)
        lower = min(waits, key=lambda pair: waits[pair])
        time = float(piece.start + waits[lower])
        if time > scene.duration:
            return Truth("trajectory", motion(pieces), tuple(times))
        piece = _impact(scene, axis, piece, lower, time)
        pieces.append(piece)
        times.append(time)
    raise RuntimeError(f"{scene.name}: more than {MOST_EVENTS} impacts before {piece.start} s")


def half_size(scene: Scene, row: int, axis: int) -> float:
    """Half the extent [m] of movable body number `row` along the axis."""
    shape = scene.bodies[scene.movable[row]].shape
    if isinstance(shape, Sphere):
        return shape.radius
    assert isinstance(shape, Box)
    return shape.half_extents[axis]


def _waits(scene: Scene, axis: int, piece: Piece) -> dict[int, float]:
    """Lower body of each pair that can meet -> time [s] until it does; infinite for pairs that do not approach."""
    x, v = piece.positions[:, axis], piece.velocities[:, axis]
    sizes = [half_size(scene, row, axis) for row in range(len(x))]
    waits = {FLOOR: _fall(x[0] - sizes[0], v[0], -scene.gravity[axis])} if scene.statics else {}
    for row in range(len(x) - 1):
        gap, closing = x[row + 1] - x[row] - sizes[row] - sizes[row + 1], v[row] - v[row + 1]
        # A gap just closed is zero up to round-off, either sign.
        waits[row] = float(max(gap, 0.0) / closing) if closing > 0 else math.inf
    return waits


def _fall(gap: float, velocity: float, g: float) -> float:
    """Positive root of gap + v t - g t^2/2 = 0, in the form that does not cancel."""
    gap = max(gap, 0.0)
    root = math.sqrt(velocity**2 + 2 * g * gap)
    if velocity > 0:
        return (velocity + root) / g if g > 0 else math.inf
    return 2 * gap / (root - velocity) if root > velocity else math.inf


def _impact(scene: Scene, axis: int, piece: Piece, lower: int, time: float) -> Piece:
    along: Floats = np.zeros(3)
    along[axis] = 1.0
    velocities = piece.at(time).velocities.copy()
    upper = lower + 1
    bodies = (scene.statics[0] if lower == FLOOR else scene.movable[lower], scene.movable[upper])
    masses = [scene.bodies[i].mass or math.inf for i in bodies]
    before = np.zeros(3) if lower == FLOOR else velocities[lower]
    bounciness = scene.contact_of(*bodies).bounciness
    after = impact("nc", (masses[0], masses[1]), (before, velocities[upper]), along, bounciness)
    if lower != FLOOR:
        velocities[lower] = after[0]
    velocities[upper] = after[1]
    return piece.then(time, velocities=velocities)
