"""Engines that hold two blocks on each other up to a known ratio of their masses, and then do not."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State

LIMIT = 1234.5


class Holds:
    """Stands still; where `gives` says so, everything falls a metre."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        bodies = [scene.bodies[i] for i in scene.movable]
        self.settings: dict[str, object] = {}
        self.ratio = max(b.mass for b in bodies) / min(b.mass for b in bodies)
        self.x = np.array([b.position for b in bodies])
        self.done, self.half = 0, round(scene.duration / step / 2)

    def gives(self) -> bool:
        return False

    def advance(self, steps: int) -> None:
        self.done += steps

    def read(self) -> State:
        fall = [0.0, 0.0, -1.0] if self.gives() and self.done >= self.half else [0.0, 0.0, 0.0]
        return State(self.x + fall, np.zeros_like(self.x))

    def close(self) -> None: ...


class Gives(Holds):
    def gives(self) -> bool:
        return self.ratio > LIMIT


class GivesBetween(Holds):
    def gives(self) -> bool:
        return 50 < self.ratio < 2e4


class AlwaysGives(Holds):
    def gives(self) -> bool:
        return True


class Dies(Holds):
    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        if self.ratio > LIMIT:
            os._exit(7)


class Hangs(Holds):
    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        if self.ratio > 2e7:
            time.sleep(60)


class Refuses(Holds):
    def __init__(self, *arguments: object) -> None:
        raise Unsupported("no blocks here")


class Explodes(Gives):
    def read(self) -> State:
        state = super().read()
        return State(state.positions / (0.0 if self.gives() else 1.0), state.velocities)


class Logged(Gives):
    """Takes its time, and writes down every run."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        with Path(os.environ["RUNS"]).open("a") as stream:
            stream.write(f"{self.ratio!r}\n")
        time.sleep(0.05)
