"""Scenes of many bodies, made from a seed, of any size: gases among walls, columns and walls of boxes.

They are for speed and for limits; the catalogue has no truth for them beyond what is conserved.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from impactbench.scenarios.records import Body, Box, Contact, HalfSpace, Model, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Floats

RADIUS = 0.5
HALF = 0.5
"""Radius and half width [m] of the bodies here."""


def gas(count: int, dimension: int = 3, fill: float = 0.1, seed: int = 1, statics: int = 0) -> Scene:
    """`count` elastic balls of 1 kg, without gravity, in a closed cube (square, line), filled by the share `fill`.

    They start on a jittered lattice, so that none overlap, with normally distributed velocities of 1 m/s along each
    axis. The first `statics` of them are static.
    """
    rng = np.random.default_rng(seed)
    places, side = lattice(count, dimension, fill, rng)
    velocities = np.zeros((count, 3))
    velocities[:, :dimension] = rng.normal(size=(count, dimension))
    fixed = set(rng.permutation(count)[:statics].tolist()) if statics else set()
    ball = Sphere(RADIUS)
    bodies = [
        Body(f"ball {i}", ball, None, _vector(x))
        if i in fixed
        else Body(f"ball {i}", ball, 1.0, _vector(x), _vector(v))
        for i, (x, v) in enumerate(zip(places.tolist(), velocities.tolist(), strict=True))
    ]
    return Scene(
        name=f"gas[bodies={count},dimension={dimension},fill={fill:g},seed={seed},statics={statics}]",
        bodies=(*bodies, *cube(side, dimension)),
        duration=10.0,
        model=Model(tuple(range(dimension))),
        length=2 * RADIUS,
        speed=1.0,
        energy=0.5 * dimension * count,
    )


def heap(count: int, fill: float = 0.3, seed: int = 1) -> Scene:
    """`count` balls of 1 kg that fall into a square pit, as high as it is wide, filled by the share `fill`.

    They start on a jittered lattice with normally distributed velocities of 1 m/s along each axis.
    """
    rng = np.random.default_rng(seed)
    places, side = lattice(count, 3, fill, rng)
    velocities = rng.normal(size=(count, 3))
    bodies = [
        Body(f"ball {i}", Sphere(RADIUS), 1.0, _vector(x), _vector(v))
        for i, (x, v) in enumerate(zip(places.tolist(), velocities.tolist(), strict=True))
    ]
    pit = [replace(w, name="floor") if w.name == "wall 2-" else w for w in cube(side, 3) if w.name != "wall 2+"]
    return Scene(
        name=f"heap[bodies={count},fill={fill:g},seed={seed}]",
        bodies=(*bodies, *pit),
        duration=2.0,
        model=Model((0, 1, 2), gravity=True, friction=True),
        length=2 * RADIUS,
        speed=math.sqrt(9.81 * side),
        energy=count * 9.81 * side / 2,
        gravity=(0.0, 0.0, -9.81),
        contact=Contact(bounciness=0.5, friction=0.3, viscosity=0.5),
    )


def lattice(count: int, dimension: int, fill: float, rng: np.random.Generator) -> tuple[Floats, float]:
    """Places [m], shape [count, 3], of balls that do not overlap, and the side [m] of the cube that holds them."""
    volume = {1: 2 * RADIUS, 2: math.pi * RADIUS**2, 3: 4 / 3 * math.pi * RADIUS**3}[dimension]
    side = (count * volume / fill) ** (1 / dimension)
    along = math.ceil(round(count ** (1 / dimension), 9))
    pitch = side / along
    if pitch < 2 * RADIUS:
        raise ValueError(
            f"fill {fill} is too much for a lattice of {count} balls; at most {fill * pitch**dimension:.3g}"
        )
    cells = np.stack(np.meshgrid(*[np.arange(along)] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    places = np.zeros((count, 3))
    jitter = rng.uniform(-0.5, 0.5, (count, dimension)) * (pitch - 2 * RADIUS)
    places[:, :dimension] = (cells[:count] + 0.5) * pitch + jitter
    return places, side


def cube(side: float, dimension: int) -> list[Body]:
    """The walls of a cube (square, line) from 0 to `side` [m]."""
    walls = []
    for axis, sign in product(range(dimension), (1.0, -1.0)):
        normal = [0.0, 0.0, 0.0]
        normal[axis] = sign
        place = (0.0, 0.0, 0.0) if sign > 0 else (side, side if dimension > 1 else 0.0, side if dimension > 2 else 0.0)
        walls.append(Body(f"wall {axis}{'-' if sign > 0 else '+'}", HalfSpace(_vector(normal)), None, place))
    return walls


def column(count: int, gap: float = 0.01, masses: list[float] | None = None) -> Scene:
    """Boxes of 1 m above a floor and one another, `gap` [m] apart at the start, inelastic: they come to rest.

    masses [kg], from the lowest up; 1 kg each if not given.
    """
    return _pile(
        f"column[boxes={count},gap={gap:g}]",
        [(0.0, level, mass) for level, mass in enumerate(masses or [1.0] * count)],
        gap,
        (2,),
    )


def wall(wide: int, high: int, gap: float = 0.01) -> Scene:
    """Bricks of 1 m in running bond, each row shifted by half a brick: each rests on two, the rows' ends stick out."""
    bricks = [(i + (0.5 if level % 2 else 0.0), level, 1.0) for level in range(high) for i in range(wide)]
    return _pile(f"wall[wide={wide},high={high},gap={gap:g}]", bricks, gap, (0, 2))


def _pile(name: str, boxes: list[tuple[float, int, float]], gap: float, axes: tuple[int, ...]) -> Scene:
    """Boxes at (x in widths, row, mass); neighbours in a row are `gap` apart as well."""
    box, high = Box((HALF, HALF, HALF)), 1 + max(row for _, row, _ in boxes)
    bodies = [
        Body(f"box {i}", box, mass, ((2 * HALF + gap) * x, 0.0, HALF + (2 * HALF + gap) * row + gap), (0.0, 0.0, 0.0))
        for i, (x, row, mass) in enumerate(boxes)
    ]
    return Scene(
        name=name,
        bodies=(Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0)), *bodies),
        duration=10.0,
        model=Model(axes, gravity=True),
        length=2 * HALF,
        speed=math.sqrt(2 * 9.81 * max(gap, 1e-3) * high),
        energy=sum(mass for _, _, mass in boxes) * 9.81 * HALF * high,
        gravity=(0.0, 0.0, -9.81),
        contact=Contact(bounciness=0.0),
    )


def _vector(values: list[float]) -> Vector:
    x, y, z = values
    return (x, y, z)
