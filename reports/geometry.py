"""Signed gaps between bodies, from positions and shapes alone, over a whole trajectory at once.

A gap [m] is positive where the bodies are apart and negative (a penetration) where they overlap; the unit normal
points from the first body to the second. Arrays run over time: positions [T, 3], orientations as unit quaternions
(w, x, y, z) [T, 4].
"""

from __future__ import annotations

from itertools import product

import numpy as np
from impactbench.scenarios.records import Box, Capsule, HalfSpace, Scene, Shape, Sphere
from impactbench.scenarios.trajectory import Floats, Trajectory


def rotation_matrices(quaternions: Floats) -> Floats:
    """Matrices [T, 3, 3] whose columns are the body's own axes in world axes."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


class Placed:
    """A body's shape with its pose over time: positions [T, 3]; one quaternion [1, 4] for a body that never turns."""

    def __init__(self, shape: Shape, positions: Floats, quaternions: Floats) -> None:
        self.shape = shape
        self.positions = positions
        self.axes = rotation_matrices(quaternions)

    def core(self) -> tuple[Floats, float]:
        """Ball or capsule as the ends of its core segment [2, T, 3] and its radius [m]."""
        match self.shape:
            case Sphere(radius):
                return np.stack([self.positions, self.positions]), radius
            case Capsule(radius, half):
                arm = half * self.axes[..., 2]
                return np.stack([self.positions - arm, self.positions + arm]), radius
            case _:
                raise TypeError(f"no core segment: {self.shape}")

    def corners(self) -> Floats:
        """Corners of a box [8, T, 3]."""
        assert isinstance(self.shape, Box)
        signs = np.array(list(product((-1.0, 1.0), repeat=3))) * np.array(self.shape.half_extents)
        offsets: Floats = np.einsum("...ij,cj->c...i", self.axes, signs)
        return self.positions + offsets


def placed_bodies(scene: Scene, trajectory: Trajectory) -> list[Placed]:
    """Every body of the scene, in scene order, with statics at rest."""
    count = len(trajectory.times)
    row_of = {index: row for row, index in enumerate(scene.movable)}

    def place(index: int) -> Placed:
        body, row = scene.bodies[index], row_of.get(index)
        turns = np.array([body.orientation])
        if row is None:
            return Placed(body.shape, np.broadcast_to(np.array(body.position), (count, 3)), turns)
        if trajectory.orientations is not None:
            turns = trajectory.orientations[:, row]
        return Placed(body.shape, trajectory.positions[:, row], turns)

    return [place(index) for index in range(len(scene.bodies))]


def gap(a: Placed, b: Placed) -> tuple[Floats, Floats]:
    """Gap [T] and unit normal from a to b [T, 3]. Raises TypeError for a pair of shapes that has no rule here."""
    if isinstance(a.shape, HalfSpace):
        return _from_half_space(a, b)
    if isinstance(b.shape, HalfSpace) or (isinstance(a.shape, Box) and not isinstance(b.shape, Box)):
        distance, normal = gap(b, a)
        return distance, -normal
    if isinstance(b.shape, Box):
        if isinstance(a.shape, Box):
            return _between_boxes(a, b)
        if isinstance(a.shape, Sphere):
            return _ball_to_box(a, b)
        raise TypeError("no gap rule for a capsule and a box")
    return _between_cores(a, b)


def _from_half_space(plane: Placed, other: Placed) -> tuple[Floats, Floats]:
    assert isinstance(plane.shape, HalfSpace)
    normal = np.array(plane.shape.normal) / np.linalg.norm(plane.shape.normal)
    if isinstance(other.shape, Box):
        points, radius = other.corners(), 0.0
    else:
        points, radius = other.core()
    heights = (points - plane.positions) @ normal
    return heights.min(axis=0) - radius, np.broadcast_to(normal, other.positions.shape)


def _dot(u: Floats, v: Floats) -> Floats:
    products: Floats = np.einsum("ti,ti->t", u, v)
    return products


def _nonzero(x: Floats) -> Floats:
    return np.where(x > 0, x, 1.0)


def _between_cores(a: Placed, b: Placed) -> tuple[Floats, Floats]:
    """Balls and capsules: distance of the core segments (Ericson, Real-Time Collision Detection, 5.1.9) less the
    radii.
    """
    (p1, q1), ra = a.core()
    (p2, q2), rb = b.core()
    d1, d2, r = q1 - p1, q2 - p2, p1 - p2
    aa, ee, f, c, bb = _dot(d1, d1), _dot(d2, d2), _dot(d2, r), _dot(d1, r), _dot(d1, d2)
    denominator = aa * ee - bb * bb
    s = np.where(denominator > 1e-12 * aa * ee, np.clip((bb * f - c * ee) / _nonzero(denominator), 0, 1), 0.0)
    t = np.where(ee > 0, (bb * s + f) / _nonzero(ee), 0.0)
    clipped = np.clip(t, 0, 1)
    s = np.where((t != clipped) | (ee == 0), np.where(aa > 0, np.clip((bb * clipped - c) / _nonzero(aa), 0, 1), 0.0), s)
    apart = (p2 + clipped[:, None] * d2) - (p1 + s[:, None] * d1)
    distance = np.linalg.norm(apart, axis=1)
    return distance - ra - rb, apart / np.where(distance > 0, distance, 1.0)[:, None]


def _ball_to_box(ball: Placed, box: Placed) -> tuple[Floats, Floats]:
    assert isinstance(ball.shape, Sphere)
    assert isinstance(box.shape, Box)
    extents = np.array(box.shape.half_extents)
    local = np.einsum("...ji,...j->...i", box.axes, ball.positions - box.positions)
    outside = local - np.clip(local, -extents, extents)
    distance = np.linalg.norm(outside, axis=1)
    depth = extents - np.abs(local)
    face = np.argmin(depth, axis=1)
    rows = np.arange(len(local))
    inward = np.zeros_like(local)
    inward[rows, face] = np.where(local[rows, face] < 0, -1.0, 1.0)
    inside = distance == 0
    direction = np.where(inside[:, None], inward, outside / np.where(inside, 1.0, distance)[:, None])
    signed = np.where(inside, -depth[rows, face], distance)
    return signed - ball.shape.radius, -np.einsum("...ij,...j->...i", box.axes, direction)


def _between_boxes(a: Placed, b: Placed) -> tuple[Floats, Floats]:
    """Separating axes (faces, edge pairs): the largest separation. Exact where boxes overlap or a face is nearest."""
    assert isinstance(a.shape, Box)
    assert isinstance(b.shape, Box)
    apart = b.positions - a.positions
    edges = np.cross(a.axes[:, :, :, None], b.axes[:, :, None, :], axis=1)
    faces = np.broadcast_arrays(a.axes, b.axes)
    axes = np.concatenate([*faces, edges.reshape(-1, 3, 9)], axis=2)
    norms = np.linalg.norm(axes, axis=1)
    # Edges that are parallel span no axis of their own.
    usable = norms > 1e-9
    axes = axes / np.where(usable, norms, 1.0)[:, None, :]
    reach_a = np.einsum("...ik,...ij,j->...jk", axes, a.axes, np.array(a.shape.half_extents))
    reach_b = np.einsum("...ik,...ij,j->...jk", axes, b.axes, np.array(b.shape.half_extents))
    along = np.einsum("...i,...ik->...k", apart, axes)
    separation = np.abs(along) - np.abs(reach_a).sum(axis=1) - np.abs(reach_b).sum(axis=1)
    best = np.argmax(np.where(usable, separation, -np.inf), axis=1)
    rows = np.arange(len(apart))
    normal = axes[rows if len(axes) > 1 else 0, :, best] * np.where(along[rows, best] < 0, -1.0, 1.0)[:, None]
    return separation[rows, best], normal
