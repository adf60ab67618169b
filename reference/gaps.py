"""Gap [m] and unit normal (from A to B) of two surfaces: spheres, axis-aligned boxes and half-spaces.

A negative gap is an overlap. Compiled, on flat arrays; results are tuples (gap, n_x, n_y, n_z).
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled
from impactbench.reference.particles import BOX, HALF_SPACE, Bodies, Pairs
from impactbench.scenarios.trajectory import Floats

Gap = tuple[float, float, float, float]


@compiled
def locate(bodies: Bodies, pairs: Pairs, p: int) -> None:
    """Bring gap and normal of pair p up to date."""
    a, b = pairs.first[p], pairs.second[p]
    x_a, x_b, size_a, size_b = bodies.position[a], bodies.position[b], bodies.size[a], bodies.size[b]
    box_a, box_b = bodies.shape[a] == BOX, bodies.shape[b] == BOX
    if bodies.shape[a] == HALF_SPACE:
        gap, x, y, z = above_plane(x_a, size_a, x_b, size_b, box_b)
    elif box_a and box_b:
        gap, x, y, z = between_boxes(x_a, size_a, x_b, size_b)
    elif box_a:
        gap, x, y, z = box_to_sphere(x_a, size_a, x_b, size_b[0])
    elif box_b:
        gap, x, y, z = box_to_sphere(x_b, size_b, x_a, size_a[0])
        x, y, z = -x, -y, -z
    else:
        gap, x, y, z = between_spheres(x_a, size_a[0], x_b, size_b[0])
    pairs.gap[p] = gap
    pairs.normal[p, 0], pairs.normal[p, 1], pairs.normal[p, 2] = x, y, z


@compiled
def locate_all(bodies: Bodies, pairs: Pairs) -> None:
    """Bring all gaps and normals up to date."""
    for p in range(len(pairs.first)):
        locate(bodies, pairs, p)


@compiled
def above_plane(point: Floats, normal: Floats, centre: Floats, size: Floats, box: bool) -> Gap:
    """A sphere or box above a half-space: height of the centre less what the body reaches down."""
    gap = 0.0 if box else -size[0]
    for k in range(3):
        gap += (centre[k] - point[k]) * normal[k]
        if box:
            gap -= abs(normal[k]) * size[k]
    return gap, normal[0], normal[1], normal[2]


@compiled
def between_spheres(x_a: Floats, r_a: float, x_b: Floats, r_b: float) -> Gap:
    """Distance of the centres less both radii. Concentric spheres have no normal: x is taken."""
    x, y, z = x_b[0] - x_a[0], x_b[1] - x_a[1], x_b[2] - x_a[2]
    distance = math.sqrt(x * x + y * y + z * z)
    if distance == 0:
        return -r_a - r_b, 1.0, 0.0, 0.0
    return distance - r_a - r_b, x / distance, y / distance, z / distance


@compiled
def between_boxes(x_a: Floats, half_a: Floats, x_b: Floats, half_b: Floats) -> Gap:
    """The axis of the greatest separation (least overlap) decides."""
    best, axis = -math.inf, 0
    for k in range(3):
        separation = abs(x_b[k] - x_a[k]) - half_a[k] - half_b[k]
        if separation > best:
            best, axis = separation, k
    sign = 1.0 if x_b[axis] >= x_a[axis] else -1.0
    return (
        best,
        sign if axis == 0 else 0.0,
        sign if axis == 1 else 0.0,
        sign if axis == 2 else 0.0,
    )


@compiled
def box_to_sphere(x_a: Floats, half: Floats, x_b: Floats, radius: float) -> Gap:
    """Distance from the box's nearest point; for a centre inside the box, its nearest face."""
    x, y, z = x_b[0] - x_a[0], x_b[1] - x_a[1], x_b[2] - x_a[2]
    x -= max(-half[0], min(half[0], x))
    y -= max(-half[1], min(half[1], y))
    z -= max(-half[2], min(half[2], z))
    distance = math.sqrt(x * x + y * y + z * z)
    if distance > 0:
        return distance - radius, x / distance, y / distance, z / distance
    depth, n_x, n_y, n_z = between_boxes(x_a, half, x_b, 0.0 * half)
    return depth - radius, n_x, n_y, n_z
