"""Many spheres as flat arrays in the order of their cells: what the fast runner's kernels work on.

`dim` is a tuple of as many zeros as there are axes: its length is known when a kernel is compiled, so that one text
gives a kernel of its own for one, two and three dimensions, and what a scene does not need is not stored at all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.particles import BOX, HALF_SPACE, SPHERE, Flags, Indices
from impactbench.reference.swarm_statics import Statics, build_statics
from impactbench.scenarios.records import Body, HalfSpace, Scene, Sphere
from impactbench.scenarios.trajectory import Floats
from numpy.typing import NDArray

Dim = tuple[float, ...]
Numbers = NDArray[np.uint32]
Starts = NDArray[np.int32]

BLOCK = 4096
"""Pairs looked at together: they and their bodies stay in the cache meanwhile."""
LEVEL_RATIO, LEVELS = 4.0, 8
"""Spheres within this ratio of radii share a grid; the last of the grids takes all that are smaller still."""
TOUCH, STILL = 1e-10, 1e-13
"""Gap that counts as touching and speed that counts as none, next to the scene's length and speed."""

PAIRS, NEAR, SIDES, NEAR_SIDES, STIRRED, BUILDS, LOOKED, IMPACTS = range(8)
SKIN, TRAVEL, FASTEST, DEEPEST, CLOSING = range(5)


class Order(NamedTuple):
    """Bodies in the order of their cells. place and velocity are flat, [n (d + 1)]: d coordinates [m], then the radius
    [m]; d components [m/s], then 0. label: the body's row in the scene. Unsigned indices spare a test each.
    """

    place: Floats
    velocity: Floats
    inverse_mass: Floats
    label: Numbers


class Grid(NamedTuple):
    """One grid per level of sizes, from the coarsest on, all in one list of cells.

    radius: the level's largest [m]; first: its first cell's place in `start`, with room for
    first[l + 1] - first[l] - 1 cells. number, inverse [1/m] of the cells' width and origin [m], [levels, 3]: set at
    every build. start: first body of each cell, bodies of a cell follow one another. level: of each body, by label.
    """

    radius: Floats
    first: Indices
    number: Indices
    inverse: Floats
    origin: Floats
    start: Starts
    cell: Starts
    level: NDArray[np.int8]


class Level(NamedTuple):
    """One row of `Grid`."""

    first: int
    number: Indices
    inverse: Floats
    origin: Floats


class Lists(NamedTuple):
    """Flat lists of two unsigned numbers an entry. pairs: candidates (rows of `Order`), complete until a body has moved
    by half the skin; near: those that are close now; sides, near_sides: the same for (body, static). stirred: those of
    `near` that touch, or may once bodies that do are taken apart. until: for each
    `BLOCK` of candidates, how many rows of `Order` hold the bodies of all up to there.
    """

    pairs: Numbers
    near: Numbers
    sides: Numbers
    near_sides: Numbers
    stirred: Numbers
    until: Numbers


class Swarm(NamedTuple):
    """tally, by `PAIRS` ...: lengths of the lists, builds, pairs looked at, impacts. gauge, by `SKIN` ...: skin [m],
    travel since the build [m], fastest speed [m/s], deepest overlap before projection [m], largest closing speed of
    an overlapping pair [m/s].
    """

    dim: Dim
    now: Order
    built: Order
    """As at the last build: where travel starts; scratch while sorting."""
    grid: Grid
    lists: Lists
    statics: Statics
    moves: Flags
    """Bodies of the pairs in `Lists.stirred`."""
    tally: Indices
    gauge: Floats
    step: float
    touch: float
    still: float


def build_swarm(scene: Scene, axes: tuple[int, ...], step: float) -> Swarm:
    """Arrays of a scene of spheres among statics, that `why_not` has passed."""
    movable = [scene.bodies[i] for i in scene.movable]
    d, n = len(axes), len(movable)
    place, velocity = np.zeros((n, d + 1)), np.zeros((n, d + 1))
    place[:, :d] = np.array([b.position for b in movable], dtype=np.float64).reshape(-1, 3)[:, axes]
    place[:, d] = [b.shape.radius for b in movable if isinstance(b.shape, Sphere)]
    velocity[:, :d] = np.array([b.velocity for b in movable], dtype=np.float64).reshape(-1, 3)[:, axes]
    masses = np.array([b.mass for b in movable], dtype=np.float64)
    statics = [scene.bodies[i] for i in scene.statics] if scene.collide else []
    return from_arrays(
        place, velocity, masses, _statics(statics, axes, place), step, TOUCH * scene.length, STILL * scene.speed
    )


def from_arrays(
    place: Floats, velocity: Floats, masses: Floats, statics: Statics, step: float, touch: float, still: float
) -> Swarm:
    """A swarm of n spheres: place and velocity [n, d + 1] (see `Order`), masses [kg] [n]."""
    n, d = len(place), place.shape[1] - 1
    now = Order(place.ravel().copy(), velocity.ravel().copy(), 1 / masses, np.arange(n, dtype=np.uint32))
    return Swarm(
        dim=(0.0,) * d,
        now=now,
        built=Order(now.place.copy(), now.velocity.copy(), now.inverse_mass.copy(), now.label.copy()),
        grid=_grid(place[:, d]),
        lists=make_lists(64 + 2 * n, 64 + n // 4),
        statics=statics,
        moves=np.zeros(n, dtype=np.bool_),
        tally=np.zeros(8, dtype=np.int64),
        gauge=np.zeros(5),
        step=step,
        touch=touch,
        still=still,
    )


def make_lists(pairs: int, sides: int) -> Lists:
    """Room for so many pairs and sides."""
    sizes = 2 * pairs, 2 * pairs, 2 * sides, 2 * sides, 2 * pairs, pairs // BLOCK + 1
    return Lists(*(np.zeros(size, dtype=np.uint32) for size in sizes))


def _grid(radius: Floats) -> Grid:
    largest = float(radius.max(initial=0.0))
    with np.errstate(divide="ignore"):
        powers = np.log(largest / radius) / math.log(LEVEL_RATIO) if largest > 0 else np.zeros(len(radius))
    used, level = np.unique(np.minimum(powers, LEVELS - 1).astype(np.int8), return_inverse=True)
    count = np.bincount(level, minlength=len(used)) if len(used) else np.zeros(0, dtype=np.int64)
    room = [2 * int(c) + 65 for c in count]
    return Grid(
        radius=np.array([radius[level == k].max() for k in range(len(used))], dtype=np.float64),
        first=np.concatenate([[0], np.cumsum(room)]).astype(np.int64),
        number=np.ones((len(used), 3), dtype=np.int64),
        inverse=np.ones((len(used), 3)),
        origin=np.zeros((len(used), 3)),
        start=np.zeros(sum(room) + 1, dtype=np.int32),
        cell=np.zeros(len(radius), dtype=np.int32),
        level=level.astype(np.int8),
    )


def _statics(bodies: list[Body], axes: tuple[int, ...], place: Floats) -> Statics:
    """Statics that lie in the way of motion along `axes`, in those coordinates."""
    kind, points, sizes = [], [], []
    for body in bodies:
        match body.shape:
            case HalfSpace(normal):
                if any(normal[k] for k in axes):
                    kind.append(HALF_SPACE)
                    points.append(body.position)
                    sizes.append(normal)
            case Sphere(radius):
                kind.append(SPHERE)
                points.append(body.position)
                sizes.append((radius, radius, radius))
            case other:
                kind.append(BOX)
                points.append(body.position)
                sizes.append(other.half_extents)  # type: ignore[union-attr]
    d = len(axes)
    at, size = np.zeros((len(kind), 3)), np.zeros((len(kind), 3))
    at[:, :d] = np.array(points).reshape(-1, 3)[:, axes]
    size[:, :d] = np.array(sizes).reshape(-1, 3)[:, axes]
    return build_statics(np.array(kind, dtype=np.int64), at, size, float(place[:, d].max(initial=0.0)), d)
