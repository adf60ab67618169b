"""Bodies that start inside static ones are refused: no projection knows which way is out."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import product
from operator import add

import numpy as np
from impactbench.reference.rigid_body import rotation
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Scene, Sphere, Vector

MARGIN = 1e-9
"""Next to the scene's length: a centre this close to the surface is on it."""


def refuse_interlocked(scene: Scene) -> None:
    """Raise ValueError for a movable body whose centre starts within a static one."""
    if not scene.collide:
        return
    near = Centres([scene.bodies[i] for i in scene.movable])
    for static in (scene.bodies[i] for i in scene.statics):
        for body in near.within(static):
            if depth(static, body.position) > MARGIN * scene.length:
                where = f"position {body.position} lies inside the static body {static.name!r}"
                raise ValueError(f"body {body.name!r}: {where}")


class Centres:
    """Bodies by the cell of their centre. Cells are as wide as the next power of two above the radius [m] around what
    is asked for, so that it meets few of them, whatever its size.
    """

    def __init__(self, bodies: list[Body]) -> None:
        self._bodies = bodies
        self._cells: dict[float, dict[tuple[int, ...], list[int]]] = {}

    def within(self, other: Body) -> list[Body]:
        """All bodies whose centre lies within the other, and some that do not."""
        if isinstance(other.shape, HalfSpace):
            return self._bodies
        width = 2.0 ** math.frexp(radius_around(other.shape))[1]
        if width not in self._cells:
            self._cells[width] = defaultdict(list)
            for i, body in enumerate(self._bodies):
                self._cells[width][_cell(body.position, width)].append(i)
        centre = _cell(other.position, width)
        cells = (tuple(map(add, centre, step)) for step in product((-1, 0, 1), repeat=3))
        found = sorted(i for cell in cells for i in self._cells[width].get(cell, ()))
        return [self._bodies[i] for i in found]


def _cell(place: Vector, width: float) -> tuple[int, ...]:
    return tuple(math.floor(x / width) for x in place)


def radius_around(shape: Sphere | Box | Capsule) -> float:
    """Radius [m] of the ball around the centre that holds the whole shape."""
    match shape:
        case Sphere(radius):
            return radius
        case Box(half):
            return math.hypot(*half)
        case Capsule(radius, half_length):
            return radius + half_length


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
