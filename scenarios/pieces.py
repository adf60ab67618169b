"""Motions made of pieces of constant acceleration: the form of nearly every truth here, exact at any time."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from impactbench.scenarios.records import Scene
from impactbench.scenarios.trajectory import Floats, State


@dataclass(frozen=True, eq=False)
class Piece:
    """All movable bodies from `start` [s] on: x + v s + a s^2/2 and v + a s, with s = t - start.
    Arrays have shape [n, 3].

    Spins turn likewise at constant `spin_rates` [rad/s^2], each about an axis that stays as it is within the piece.
    """

    start: float
    positions: Floats
    velocities: Floats
    accelerations: Floats
    orientations: Floats | None = None
    spins: Floats | None = None
    spin_rates: Floats | None = None

    def at(self, time: float) -> State:
        s = time - self.start
        x = self.positions + self.velocities * s + self.accelerations * (s * s / 2)
        v = self.velocities + self.accelerations * s
        if self.orientations is None or self.spins is None or self.spin_rates is None:
            return State(x, v)
        turned = turn(self.spins * s + self.spin_rates * (s * s / 2), self.orientations)
        return State(x, v, turned, self.spins + self.spin_rates * s)

    def then(self, time: float, **changes: Floats) -> Piece:
        """The piece that follows at `time`: continuous but for the arrays given."""
        now = self.at(time)
        following = replace(
            self,
            start=time,
            positions=now.positions,
            velocities=now.velocities,
            orientations=now.orientations,
            spins=now.spins,
        )
        return replace(following, **changes)  # type: ignore[arg-type]


def opening(scene: Scene) -> Piece:
    """The first piece: the scene's own start, under its gravity alone."""
    bodies = [scene.bodies[i] for i in scene.movable]
    x, v = np.array([b.position for b in bodies]), np.array([b.velocity for b in bodies])
    a = np.tile(np.array(scene.gravity), (len(bodies), 1))
    if not scene.model.rotation:
        return Piece(0.0, x, v, a)
    q, w = np.array([b.orientation for b in bodies]), np.array([b.spin for b in bodies])
    return Piece(0.0, x, v, a, q, w, np.zeros_like(w))


def motion(pieces: Sequence[Piece]) -> Callable[[float], State]:
    """The state at any time: that of the latest piece begun (at an impact: just after it).
    Before 0 the first piece holds.
    """
    starts = [piece.start for piece in pieces]
    return lambda time: pieces[max(bisect_right(starts, time) - 1, 0)].at(time)


def turn(rotation: Floats, orientation: Floats) -> Floats:
    """Quaternions (w, x, y, z) turned by rotation vectors [rad] in world axes, both of shape [n, .]."""
    return np.array([multiply(exponential(r), q) for r, q in zip(rotation, orientation, strict=True)])


def exponential(rotation: Floats) -> Floats:
    """Unit quaternion of a rotation vector [rad]: (cos(a/2), sin(a/2) axis)."""
    angle = float(np.linalg.norm(rotation))
    if angle == 0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.concatenate(([math.cos(angle / 2)], math.sin(angle / 2) / angle * rotation))


def multiply(p: Floats, q: Floats) -> Floats:
    """Hamilton product p q: first q, then p, in world axes."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate(([scalar], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])))
