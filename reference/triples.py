"""Vectors, matrices and quaternions as tuples of floats: in kernels they stay in registers, where an array is made."""

from __future__ import annotations

import math

from impactbench.reference.compiled import inlined
from impactbench.scenarios.records import Quaternion, Vector
from impactbench.scenarios.trajectory import Floats

Matrix = tuple[Vector, Vector, Vector]


@inlined
def unit(axis: int) -> Vector:
    """Along one of the axes 0, 1, 2."""
    return (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)


@inlined
def row(a: Floats, i: int) -> Vector:
    """Row i of an array [n, 3]."""
    return (a[i, 0], a[i, 1], a[i, 2])


@inlined
def put(a: Floats, i: int, value: Vector) -> None:
    """Set row i of an array [n, 3]."""
    a[i, 0], a[i, 1], a[i, 2] = value


@inlined
def rows(a: Floats, i: int) -> Matrix:
    """Matrix i of an array [n, 3, 3]."""
    return (
        (a[i, 0, 0], a[i, 0, 1], a[i, 0, 2]),
        (a[i, 1, 0], a[i, 1, 1], a[i, 1, 2]),
        (a[i, 2, 0], a[i, 2, 1], a[i, 2, 2]),
    )


@inlined
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def length(a: Vector) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inlined
def subtract(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inlined
def scale(s: float, a: Vector) -> Vector:
    return (s * a[0], s * a[1], s * a[2])


@inlined
def plus(a: Vector, s: float, b: Vector) -> Vector:
    """a + s b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@inlined
def apply(m: Matrix, a: Vector) -> Vector:
    return (dot(m[0], a), dot(m[1], a), dot(m[2], a))


@inlined
def back(m: Matrix, a: Vector) -> Vector:
    """The transpose of m, applied: from world axes into a body's own, if m turns the other way."""
    return (
        m[0][0] * a[0] + m[1][0] * a[1] + m[2][0] * a[2],
        m[0][1] * a[0] + m[1][1] * a[1] + m[2][1] * a[2],
        m[0][2] * a[0] + m[1][2] * a[1] + m[2][2] * a[2],
    )


@inlined
def turned(m: Matrix, principal: Vector) -> Matrix:
    """m diag(principal) m^T: a tensor with these values along a body's own axes, in world axes."""
    i, j, k = principal
    x = (m[0][0] * i, m[0][1] * j, m[0][2] * k)
    y = (m[1][0] * i, m[1][1] * j, m[1][2] * k)
    z = (m[2][0] * i, m[2][1] * j, m[2][2] * k)
    return (apply(m, x), apply(m, y), apply(m, z))


@inlined
def matrix(q: Quaternion) -> Matrix:
    """Rotation of a unit quaternion (w, x, y, z), own to world axes."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@inlined
def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton's p q, of length 1: first q, then p, in world axes."""
    w = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    x = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    y = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    z = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / size, x / size, y / size, z / size)


@inlined
def exponential(rotation: Vector) -> Quaternion:
    """Unit quaternion of a rotation vector [rad]."""
    angle = length(rotation)
    if angle == 0:
        return (1.0, 0.0, 0.0, 0.0)
    s = math.sin(angle / 2) / angle
    return (math.cos(angle / 2), s * rotation[0], s * rotation[1], s * rotation[2])
