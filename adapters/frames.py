"""Quaternions (w, x, y, z) of many bodies, shape [n, 4]: what adapters need to read turns and spins in world axes."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.records import Quaternion
from impactbench.scenarios.trajectory import Floats


def multiply(p: Floats, q: Floats) -> Floats:
    """Turn by q, then by p."""
    pw, px, py, pz = p.T
    qw, qx, qy, qz = q.T
    turned = np.empty(q.shape)
    turned[..., 0] = pw * qw - (px * qx + py * qy + pz * qz)
    turned[..., 1] = pw * qx + qw * px + (py * qz - pz * qy)
    turned[..., 2] = pw * qy + qw * py + (pz * qx - px * qz)
    turned[..., 3] = pw * qz + qw * pz + (px * qy - py * qx)
    return turned


def rotate(q: Floats, v: Floats) -> Floats:
    """Vectors v, shape [n, 3], turned by q."""
    t = 2 * _cross(q[..., 1:], v)
    return np.asarray(v + q[..., :1] * t + _cross(q[..., 1:], t))


def _cross(a: Floats, b: Floats) -> Floats:
    """np.cross, whose checks of shapes cost more than all else of reading a state; same bits."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]).T


def about(axis: int, angles: Floats) -> Floats:
    """Turns by `angles` [rad], shape [n], about a coordinate axis."""
    q = np.zeros((len(angles), 4))
    q[:, 0], q[:, 1 + axis] = np.cos(angles / 2), np.sin(angles / 2)
    return q


def matrix(q: Quaternion) -> Floats:
    """Columns are the body's own axes in world axes."""
    return rotate(np.tile(q, (3, 1)), np.eye(3)).T
