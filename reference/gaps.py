"""Gap [m] and unit normal (from A to B) of two surfaces: spheres, axis-aligned boxes and half-spaces.

A negative gap is an overlap. Compiled, on flat arrays; results are tuples (gap, n_x, n_y, n_z).
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import BOX, HALF_SPACE, Bodies, Pairs
from impactbench.scenarios.trajectory import Floats

Gap = tuple[float, float, float, float]


@inlined
def locate(bodies: Bodies, pairs: Pairs, p: int) -> None:
    """Bring gap and normal of pair p up to date."""
    gap, x, y, z = between(bodies, pairs.first[p], pairs.second[p])
    pairs.gap[p] = gap
    pairs.normal[p, 0], pairs.normal[p, 1], pairs.normal[p, 2] = x, y, z


@inlined
def between(bodies: Bodies, a: int, b: int) -> Gap:
    """Gap and normal of two bodies; a half-space comes first."""
    x_a, x_b, size_a, size_b = bodies.position[a], bodies.position[b], bodies.size[a], bodies.size[b]
    box_a, box_b = bodies.shape[a] == BOX, bodies.shape[b] == BOX
    if bodies.shape[a] == HALF_SPACE:
        return above_plane(x_a, size_a, x_b, size_b, box_b)
    if box_a and box_b:
        return between_boxes(x_a, size_a, x_b, size_b)
    if box_a:
        return box_to_sphere(x_a, size_a, x_b, size_b[0])
    if box_b:
        gap, x, y, z = box_to_sphere(x_b, size_b, x_a, size_a[0])
        return gap, -x, -y, -z
    return between_spheres(x_a, size_a[0], x_b, size_b[0])


@compiled
def locate_all(bodies: Bodies, pairs: Pairs) -> None:
    """Bring all gaps and normals up to date."""
    for p in range(len(pairs.first)):
        locate(bodies, pairs, p)


@inlined
def above_plane(point: Floats, normal: Floats, centre: Floats, size: Floats, box: bool) -> Gap:
    """A sphere or box above a half-space: height of the centre less what the body reaches down."""
    gap = 0.0 if box else -size[0]
    for k in range(3):
        gap += (centre[k] - point[k]) * normal[k]
        if box:
            gap -= abs(normal[k]) * size[k]
    return gap, normal[0], normal[1], normal[2]


@inlined
def between_spheres(x_a: Floats, r_a: float, x_b: Floats, r_b: float) -> Gap:
    """Distance of the centres less both radii. Concentric spheres have no normal: x is taken."""
    x, y, z = x_b[0] - x_a[0], x_b[1] - x_a[1], x_b[2] - x_a[2]
    distance = math.sqrt(x * x + y * y + z * z)
    if distance == 0:
        return -r_a - r_b, 1.0, 0.0, 0.0
    return distance - r_a - r_b, x / distance, y / distance, z / distance


@inlined
def between_boxes(x_a: Floats, half_a: Floats, x_b: Floats, half_b: Floats) -> Gap:
    """The axis of the greatest separation (least overlap) decides."""
    x, y, z = x_b[0] - x_a[0], x_b[1] - x_a[1], x_b[2] - x_a[2]
    return nearest_face(x, y, z, half_a[0] + half_b[0], half_a[1] + half_b[1], half_a[2] + half_b[2])


@inlined
def nearest_face(x: float, y: float, z: float, half_x: float, half_y: float, half_z: float) -> Gap:
    """Gap of a point and the nearest face of the box around the origin; negative inside."""
    along_x, along_y, along_z = abs(x) - half_x, abs(y) - half_y, abs(z) - half_z
    if along_x >= along_y and along_x >= along_z:
        return along_x, math.copysign(1.0, x), 0.0, 0.0
    if along_y >= along_z:
        return along_y, 0.0, math.copysign(1.0, y), 0.0
    return along_z, 0.0, 0.0, math.copysign(1.0, z)


@inlined
def box_to_sphere(x_a: Floats, half: Floats, x_b: Floats, radius: float) -> Gap:
    """Distance from the box's nearest point; for a centre inside the box, its nearest face."""
    d_x, d_y, d_z = x_b[0] - x_a[0], x_b[1] - x_a[1], x_b[2] - x_a[2]
    x = d_x - max(-half[0], min(half[0], d_x))
    y = d_y - max(-half[1], min(half[1], d_y))
    z = d_z - max(-half[2], min(half[2], d_z))
    distance = math.sqrt(x * x + y * y + z * z)
    if distance > 0:
        return distance - radius, x / distance, y / distance, z / distance
    depth, n_x, n_y, n_z = nearest_face(d_x, d_y, d_z, half[0], half[1], half[2])
    return depth - radius, n_x, n_y, n_z
