"""Contestants that fail in one known way each: they prove that a fault costs its own cell and is named."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Honest:
    """Free flight, exactly; bodies pass through one another."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        bodies = [body for body in scene.bodies if not body.static]
        self.settings: dict[str, object] = {"step": step}
        self.step = step
        self.gravity = np.array(scene.gravity)
        self.positions = np.array([body.position for body in bodies], dtype=float)
        self.velocities = np.array([body.velocity for body in bodies], dtype=float)

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.positions = self.positions + self.step * self.velocities + self.step**2 / 2 * self.gravity
            self.velocities = self.velocities + self.step * self.gravity

    def read(self) -> State:
        return State(self.positions.copy(), self.velocities.copy())

    def close(self) -> None: ...


class Crashing(Honest):
    def advance(self, steps: int) -> None:
        os.kill(os.getpid(), signal.SIGSEGV)


class Hanging(Honest):
    def advance(self, steps: int) -> None:
        time.sleep(3600)


class Diverging(Honest):
    def advance(self, steps: int) -> None:
        super().advance(steps)
        self.velocities[0, 0] = float("nan")


class Raising(Honest):
    def advance(self, steps: int) -> None:
        raise RuntimeError("no such luck")


class Missing(Honest):
    def __init__(self, *_: object) -> None:
        from impactbench.scenarios.engine import Unavailable

        raise Unavailable("its licence server is down")


class Clockless(Honest):
    """Takes single steps, as the accuracy lane asks for, and dies of many at once, as the timing lane does."""

    def advance(self, steps: int) -> None:
        if steps > 1:
            os.kill(os.getpid(), signal.SIGSEGV)
        super().advance(steps)


class Aborting(Honest):
    def advance(self, steps: int) -> None:
        os.abort()


class Greedy(Honest):
    """Asks for a GiB again and again; untouched pages cost nobody anything."""

    def advance(self, steps: int) -> None:
        self.hoard = [np.zeros(2**27) for _ in range(1000)]


class Leaving(Honest):
    def advance(self, steps: int) -> None:
        os._exit(0)


class Misshapen(Honest):
    def read(self) -> State:
        return State(np.zeros((7, 2)), np.zeros((7, 2)))


class Empty(Honest):
    def read(self) -> State:
        return None  # type: ignore[return-value]


class Infinite(Honest):
    def advance(self, steps: int) -> None:
        super().advance(steps)
        self.positions *= 1e200


class Refusing(Honest):
    def __init__(self, *_: object) -> None:
        from impactbench.scenarios.engine import Unsupported

        raise Unsupported("only Tuesdays")


class Interrupting(Honest):
    def advance(self, steps: int) -> None:
        raise KeyboardInterrupt


class Shouting(Honest):
    """Many lines of message, as some libraries write them."""

    def advance(self, steps: int) -> None:
        raise ValueError("first line\nsecond line\nlast line")
