"""Immovable flat walls of a scene: half-spaces, and the faces of static boxes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.particles import Flags, Indices
from impactbench.scenarios.records import Box, HalfSpace, Model, Scene, Vector
from impactbench.scenarios.trajectory import Floats


class Walls(NamedTuple):
    """Points x with x . normal = level [m], between `low` and `high` [m] along the axes (infinite for a half-space).

    Shapes [w] and [w, 3]; group as for the spheres.
    """

    normal: Floats
    level: Floats
    low: Floats
    high: Floats
    group: Indices
    bounded: Flags
    """Whether the wall is a box's face, which ends."""
    push: Floats
    """Room for `exact_impact.press`."""


Wall = tuple[Vector, float, Vector, Vector, int]
FREE = (math.inf, math.inf, math.inf)


def build_walls(scene: Scene, model: Model, groups: list[int]) -> Walls:
    """Walls a body that moves along the model's axes can meet; one that it only glides along is left out."""
    walls = list[Wall]()
    for index in scene.statics if scene.collide else ():
        body = scene.bodies[index]
        match body.shape:
            case HalfSpace(normal):
                level = sum(n * p for n, p in zip(normal, body.position, strict=True))
                walls.append((normal, level, (-math.inf, -math.inf, -math.inf), FREE, groups[index]))
            case Box(half):
                walls.extend(faces(body.position, half, groups[index]))
    walls = [wall for wall in walls if any(wall[0][axis] for axis in model.axes)]
    return Walls(
        normal=np.array([wall[0] for wall in walls], dtype=np.float64).reshape(-1, 3),
        level=np.array([wall[1] for wall in walls], dtype=np.float64),
        low=np.array([wall[2] for wall in walls], dtype=np.float64).reshape(-1, 3),
        high=np.array([wall[3] for wall in walls], dtype=np.float64).reshape(-1, 3),
        group=np.array([wall[4] for wall in walls], dtype=np.int64),
        bounded=np.array([wall[3] != FREE for wall in walls], dtype=np.bool_),
        push=np.zeros(len(walls)),
    )


def faces(centre: Vector, half: Vector, group: int) -> list[Wall]:
    """The six faces of an upright box."""
    found = list[Wall]()
    for axis in range(3):
        low = [-math.inf if k == axis else centre[k] - half[k] for k in range(3)]
        high = [math.inf if k == axis else centre[k] + half[k] for k in range(3)]
        for sign in (-1.0, 1.0):
            x, y, z = (sign if k == axis else 0.0 for k in range(3))
            level = sign * centre[axis] + half[axis]
            found.append(((x, y, z), level, (low[0], low[1], low[2]), (high[0], high[1], high[2]), group))
    return found
