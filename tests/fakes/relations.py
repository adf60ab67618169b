"""Engines that break one symmetry each: they prove that every metamorphic relation can fail."""

from __future__ import annotations

from itertools import count

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import HalfSpace, Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Fair:
    """Balls without spin among planes: bounce with e where they touch, all pairs after one another, then fly on.

    Nothing is added or lost but by e; the step's parabola is exact.
    """

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if model.rotation or any(model.friction and c.friction for c in (scene.contact,)):
            raise Unsupported("balls without friction only")
        self.settings: dict[str, object] = {}
        bodies = [scene.bodies[i] for i in scene.movable]
        self.step, self.e = step, scene.contact.bounciness
        self.gravity = np.array(scene.gravity)
        self.x = np.array([body.position for body in bodies])
        self.v = np.array([body.velocity for body in bodies])
        self.masses = np.array([body.mass for body in bodies])
        self.radii = np.array([body.shape.radius for body in bodies])
        self.planes = [b for b in scene.bodies if isinstance(b.shape, HalfSpace)]
        self.length, self.speed = scene.length, scene.speed

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.bounce()
            self.force()
            self.x = self.x + self.step * self.v + self.step**2 / 2 * self.gravity
            self.v = self.v + self.step * self.gravity

    def bounce(self) -> None:
        for i, ball in enumerate(self.x):
            for plane in self.planes:
                normal = np.array(plane.shape.normal)
                gap = (ball - np.array(plane.position)) @ normal - self.radii[i]
                if gap <= self.margin() and self.v[i] @ normal < 0:
                    self.v[i] = self.v[i] - (1 + self.rebound(gap)) * (self.v[i] @ normal) * normal
            for j in range(i):
                between = self.x[j] - ball
                distance = np.sqrt(between @ between)
                normal = between / distance
                closing = (self.v[j] - self.v[i]) @ normal
                if distance - self.radii[i] - self.radii[j] <= self.margin() and closing < 0:
                    blow = (1 + self.e) * closing / (1 / self.masses[i] + 1 / self.masses[j]) * normal
                    self.v[i] = self.v[i] + blow / self.masses[i]
                    self.v[j] = self.v[j] - blow / self.masses[j]

    def margin(self) -> float:
        return 0.0

    def rebound(self, gap: float) -> float:
        return self.e

    def force(self) -> None: ...

    def read(self) -> State:
        return State(self.x.copy(), self.v.copy())

    def close(self) -> None: ...


class Remembering(Fair):
    """A state that outlives the world."""

    built = count()

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.v = self.v * (1 + 1e-9 * next(self.built))


class Handed(Fair):
    """A wind that blows one way."""

    def force(self) -> None:
        self.v = self.v + 1e-3 * self.step * self.speed**2 / self.length * (self.v > 0)


class AlongAxes(Fair):
    """Drag that knows the axes: quarter turns of its plane keep it, other angles do not."""

    def force(self) -> None:
        self.v = self.v * (1 - 0.1 * self.step * np.abs(self.v) / self.length)


class Anisotropic(Fair):
    """Drag that differs from axis to axis."""

    def force(self) -> None:
        rates = np.array([0.1, 0.2, 0.3]) * self.speed / self.length
        self.v = self.v * (1 - self.step * rates)


class FirstComesFirst(Fair):
    """The first body listed weighs less."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.masses = self.masses * np.linspace(0.99, 1.0, len(self.masses))


class SinglePrecision(Fair):
    """Positions are held in single precision: coarse far away. Powers of two and signs pass through."""

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            super().advance(1)
            self.x = self.x.astype(np.float32).astype(np.float64)


class AbsoluteFrame(Fair):
    """Drag against a medium at rest."""

    def force(self) -> None:
        self.v = self.v * (1 - 0.1 * self.step * self.speed / self.length)


class SlopInMetres(Fair):
    def margin(self) -> float:
        return 0.005


class ClampedInMetresPerSecond(Fair):
    """Length and time alike are seen in a speed."""

    def force(self) -> None:
        self.v = np.clip(self.v, -5.0, 5.0)


class LightOnesVanish(Fair):
    def force(self) -> None:
        self.v = self.v * (1 - 0.1 * self.step * self.speed / self.length * (self.masses < 0.01))[:, None]


class TiresOnce(Fair):
    """What the world has been through is no part of its state."""

    done = 0

    def force(self) -> None:
        self.done += 1
        if self.done == 10:
            self.v = self.v * 0.99


class LossyBounce(Fair):
    """Loses some of every bounce off a wall, however small the step."""

    def rebound(self, gap: float) -> float:
        return 0.95 * self.e


class DeepIsSoft(Fair):
    """A bounce that depends on where in the step it falls."""

    def rebound(self, gap: float) -> float:
        return self.e * (1 - min(0.5, -gap / (self.speed * self.step)))
