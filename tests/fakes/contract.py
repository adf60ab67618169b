"""Engines that keep every point of the contract but one each: they prove that every point can fail."""

from __future__ import annotations

import os
from itertools import count

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Faithful:
    """Free flight, v before x; bodies pass through one another."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if model.rotation:
            raise Unsupported("nothing turns here")
        bodies = [scene.bodies[i] for i in scene.movable]
        self.settings: dict[str, object] = {"step": step, "nested": {"axes": (0, 1)}}
        self.scene, self.step = scene, step
        self.gravity = np.array(scene.gravity)
        self.positions = np.array([body.position for body in bodies])
        self.velocities = np.array([body.velocity for body in bodies])

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.velocities = self.velocities + self.step * self.gravity
            self.positions = self.positions + self.step * self.velocities

    def read(self) -> State:
        return State(self.positions.copy(), self.velocities.copy())

    def close(self) -> None: ...


class FourArguments(Faithful):
    def __init__(self, scene: Scene, law: Law, model: Model, step: float) -> None:
        super().__init__(scene, law, "default", model, step)


class NoClose(Faithful):
    close = None


class NotImplementedForWalls(Faithful):
    def __init__(self, scene: Scene, *others: object) -> None:
        if scene.statics:
            raise NotImplementedError("walls")
        super().__init__(scene, *others)


class NoReason(Faithful):
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if model.rotation:
            raise Unsupported
        super().__init__(scene, law, profile, model, step)


class ArraySetting(Faithful):
    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.settings["gravity"] = self.gravity


class NanSetting(Faithful):
    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.settings["tolerance"] = float("nan")


class NoSettings(Faithful):
    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        del self.settings


class SinglePrecision(Faithful):
    def read(self) -> State:
        return State(self.positions.astype(np.float32), self.velocities.copy())


class Transposed(Faithful):
    def read(self) -> State:
        return State(self.positions.copy(), self.velocities.T.copy())


class WithStatics(Faithful):
    def read(self) -> State:
        places = [self.scene.bodies[i].position for i in self.scene.statics]
        still = np.zeros((len(places), 3))
        return State(np.vstack([self.positions, np.array(places).reshape(-1, 3)]), np.vstack([self.velocities, still]))


class Backwards(Faithful):
    def read(self) -> State:
        return State(self.positions[::-1].copy(), self.velocities[::-1].copy())


class HalfAStepAhead(Faithful):
    def read(self) -> State:
        return State(self.positions + self.velocities * self.step / 2, self.velocities.copy())


class Exposed(Faithful):
    def read(self) -> State:
        return State(self.positions, self.velocities)


class OneBuffer(Faithful):
    def read(self) -> State:
        if not hasattr(self, "buffer"):
            self.buffer = State(self.positions.copy(), self.velocities.copy())
        self.buffer.positions[:], self.buffer.velocities[:] = self.positions, self.velocities
        return self.buffer


class OneStepShort(Faithful):
    def advance(self, steps: int) -> None:
        super().advance(max(1, steps - 1))


class Damped(Faithful):
    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.velocities = self.velocities * (1 - 0.04 * self.step)
            super().advance(1)


class Drifting(Faithful):
    """No two worlds alike: a state that outlives them."""

    built = count()

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        self.velocities[0] += 1e-13 * (next(self.built) % 2)


class OneWorld(Faithful):
    """What was built last is what everybody steps."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        OneWorld.last = self

    def advance(self, steps: int) -> None:
        Faithful.advance(OneWorld.last, steps)


class AlwaysSpins(Faithful):
    def read(self) -> State:
        n = len(self.positions)
        return State(self.positions.copy(), self.velocities.copy(), np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3)))


class NeverSpins(Faithful):
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        super().__init__(scene, law, profile, Model(model.axes), step)


class Dying(Faithful):
    def advance(self, steps: int) -> None:
        if steps > 5:
            os.abort()
        super().advance(steps)


class Refusing(Faithful):
    def __init__(self, *arguments: object) -> None:
        raise Unsupported("nothing at all")
