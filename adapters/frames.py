"""Quaternions (w, x, y, z) of many bodies, shape [n, 4]: what adapters need to read turns and spins in world axes."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.records import Quaternion
from impactbench.scenarios.trajectory import Floats


def multiply(p: Floats, q: Floats) -> Floats:
    """Turn by q, then by p."""
    pw, pv, qw, qv = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    vector = pw * qv + qw * pv + np.cross(pv, qv)
    return np.concatenate([pw * qw - (pv * qv).sum(-1, keepdims=True), vector], axis=-1)


def rotate(q: Floats, v: Floats) -> Floats:
    """Vectors v, shape [n, 3], turned by q."""
    t = 2 * np.cross(q[..., 1:], v)
    return np.asarray(v + q[..., :1] * t + np.cross(q[..., 1:], t))


def about(axis: int, angles: Floats) -> Floats:
    """Turns by `angles` [rad], shape [n], about a coordinate axis."""
    q = np.zeros((len(angles), 4))
    q[:, 0], q[:, 1 + axis] = np.cos(angles / 2), np.sin(angles / 2)
    return q


def matrix(q: Quaternion) -> Floats:
    """Columns are the body's own axes in world axes."""
    return rotate(np.tile(q, (3, 1)), np.eye(3)).T
