"""Bodies that start inside static ones are refused: no projection knows which way is out."""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.rigid_body import rotation
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Scene, Sphere, Vector

MARGIN = 1e-9
"""Next to the scene's length: a centre this close to the surface is on it."""


def refuse_interlocked(scene: Scene) -> None:
    """Raise ValueError for a movable body whose centre starts within a static one."""
    if not scene.collide:
        return
    for static in (scene.bodies[i] for i in scene.statics):
        for body in (scene.bodies[i] for i in scene.movable):
            if depth(static, body.position) > MARGIN * scene.length:
                where = f"position {body.position} lies inside the static body {static.name!r}"
                raise ValueError(f"body {body.name!r}: {where}")


def depth(static: Body, point: Vector) -> float:
    """How far [m] a point lies below the body's surface; negative outside (there no more than a sign)."""
    away = np.subtract(point, static.position)
    if isinstance(static.shape, HalfSpace):
        return -float(away @ np.array(static.shape.normal))
    x, y, z = (float(way) for way in away @ rotation(static.orientation))
    match static.shape:
        case Sphere(radius):
            return radius - math.hypot(x, y, z)
        case Box((a, b, c)):
            return min(a - abs(x), b - abs(y), c - abs(z))
        case Capsule(radius, half_length):
            return radius - math.hypot(x, y, z - min(half_length, max(-half_length, z)))
