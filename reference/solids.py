"""Rigid bodies as flat arrays: what the kernels of the rigid runner work on. Static ones have lightness and ease 0."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Indices
from impactbench.reference.rigid_body import rotation
from impactbench.reference.triples import matrix, turned
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Quaternion, Scene, Shape, Sphere, Vector
from impactbench.scenarios.trajectory import Floats

HALF_SPACE, BOX, CAPSULE, SPHERE = 0, 1, 2, 3
"""In this order pairs of shapes are looked at."""
SPACE = -1
"""The `plane` of a scene in space."""


class Solids(NamedTuple):
    """All bodies of a scene. SI units, world axes unless told; shapes [n], [n, 3], [n, 4], [n, 3, 3]."""

    position: Floats
    velocity: Floats
    orientation: Floats
    spin: Floats
    axes: Floats
    """Columns: the body's own axes."""
    ease: Floats
    """I^-1 [1/(kg m^2)]; of a planar scene, its axis' part alone."""
    lightness: Floats
    """1/m [1/kg]."""
    principal: Floats
    debt: Floats
    """Energy [J] that lifts added and no approach has paid back yet."""
    kind: Indices
    size: Floats
    """Normal of a half-space; half extents; radius and half length; radius."""
    bound: Floats
    """Radius [m] of the ball about the centre that holds the body."""
    corners: Floats
    """Points in own axes, [n, 8, 3], whose depth below a plane is the body's own; the first `corner_count` of them."""
    corner_count: Indices
    plane: int
    """The axis a planar scene turns about, or `SPACE`."""


def build_solids(scene: Scene, plane: int) -> Solids:
    """The bodies at t = 0."""
    bodies = scene.bodies
    corners = [_corners(body, plane) for body in bodies]
    solids = Solids(
        position=_rows([b.position for b in bodies]),
        velocity=_rows([(0.0, 0.0, 0.0) if b.static else b.velocity for b in bodies]),
        orientation=_rows([b.orientation for b in bodies], 4),
        spin=_rows([(0.0, 0.0, 0.0) if b.static else b.spin for b in bodies]),
        axes=np.array([rotation(b.orientation) for b in bodies]).reshape(-1, 3, 3),
        ease=np.zeros((len(bodies), 3, 3)),
        lightness=np.array([0.0 if b.mass is None else 1 / b.mass for b in bodies], dtype=np.float64),
        principal=_rows([b.principal_inertia() for b in bodies]),
        debt=np.zeros(len(bodies)),
        kind=np.array([_size(b.shape)[0] for b in bodies], dtype=np.int64),
        size=_rows([_size(b.shape)[1] for b in bodies]),
        bound=np.array([_size(b.shape)[2] for b in bodies], dtype=np.float64),
        corners=np.array([np.resize(points, (8, 3)) for points in corners]).reshape(-1, 8, 3),
        corner_count=np.array([len(points) for points in corners], dtype=np.int64),
        plane=plane,
    )
    for i in scene.movable:
        refresh(solids, i)
    return solids


def _rows(values: list[Vector] | list[Quaternion], width: int = 3) -> Floats:
    return np.array(values, dtype=np.float64).reshape(-1, width)


def _size(shape: Shape) -> tuple[int, Vector, float]:
    match shape:
        case HalfSpace(normal):
            return HALF_SPACE, normal, math.inf
        case Box(half):
            return BOX, half, math.hypot(*half)
        case Capsule(radius, half_length):
            return CAPSULE, (radius, half_length, 0.0), radius + half_length
        case Sphere(radius):
            return SPHERE, (radius, 0.0, 0.0), radius


def _corners(body: Body, plane: int) -> Floats:
    """Corners, a capsule's two ends, or the centre. In a plane those before and behind it are one, in it."""
    match body.shape:
        case Capsule(_, half):
            return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])
        case Box(half_extents):
            corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half_extents
            if plane == SPACE:
                return corners
            across = rotation(body.orientation)[plane]  # the plane's normal in own axes
            kept: list[Floats] = []
            for corner in corners - np.outer(corners @ across, across):
                if all(math.dist(corner, other) > 1e-9 * math.hypot(*half_extents) for other in kept):
                    kept.append(corner)
            return np.array(kept)
        case _:
            return np.zeros((1, 3))


@inlined
def orientation(solids: Solids, i: int) -> Quaternion:
    q = solids.orientation
    return (q[i, 0], q[i, 1], q[i, 2], q[i, 3])


@inlined
def orient(solids: Solids, i: int, q: Quaternion) -> None:
    o = solids.orientation
    o[i, 0], o[i, 1], o[i, 2], o[i, 3] = q


@compiled
def refresh(solids: Solids, i: int) -> None:
    """Bring axes and inertia of movable body i up to date after a turn."""
    axes = matrix(orientation(solids, i))
    p, plane = solids.principal, solids.plane
    if plane == SPACE:
        ease = turned(axes, (1 / p[i, 0], 1 / p[i, 1], 1 / p[i, 2]))
        for k in range(3):
            for j in range(3):
                solids.axes[i, k, j] = axes[k][j]
                solids.ease[i, k, j] = ease[k][j]
        return
    for k in range(3):
        for j in range(3):
            solids.axes[i, k, j] = axes[k][j]
    moment = 0.0
    for k in range(3):
        moment += solids.axes[i, plane, k] * p[i, k] * solids.axes[i, plane, k]
    solids.ease[i, plane, plane] = 1 / moment
