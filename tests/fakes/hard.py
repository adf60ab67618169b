"""Engines that break what a hard case demands, one property each: they prove that every criterion can fail."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.hard import case_named
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Truthful:
    """Replays the scene's own truth; bodies of a scene without one stay where they are or fly on."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        self.settings: dict[str, object] = {}
        self.scene, self.step, self.time, self.count = scene, step, 0.0, 0
        case = case_named(scene.name)
        assert case is not None
        self.truth = case.truths[law].state

    def advance(self, steps: int) -> None:
        self.count += steps
        self.time = self.count * self.step

    def read(self) -> State:
        state = self.truth(self.time)
        assert state is not None
        return state

    def close(self) -> None: ...


class PutBack(Truthful):
    """Puts the whole world back to its start half way, without a word."""

    def advance(self, steps: int) -> None:
        super().advance(steps if self.count < 99 else -self.count)


class Sagging(Truthful):
    """Every body sinks into the one below, at 0.2 m/s."""

    def read(self) -> State:
        state = super().read()
        rows = np.arange(1, len(state.positions) + 1)[:, None]
        return State(
            state.positions - 0.2 * self.time * rows * [0, 0, 1], state.velocities, state.orientations, state.spins
        )


class Leaning(Truthful):
    """Each body slides over the one below, at 0.2 m/s."""

    def read(self) -> State:
        state = super().read()
        rows = np.arange(len(state.positions))[:, None]
        return State(
            state.positions + 0.2 * self.time * rows * [1, 0, 0], state.velocities, state.orientations, state.spins
        )


class Trembling(Truthful):
    """Moves at a step and a half's worth of gravity without getting anywhere."""

    def read(self) -> State:
        state = super().read()
        return State(
            state.positions,
            state.velocities + np.array([0, 0, 1.5 * 9.81 * self.step]),
            state.orientations,
            state.spins,
        )


class Ghost(Truthful):
    """Nothing stops a ball: the start's straight line."""

    def read(self) -> State:
        start = self.truth(0.0)
        assert start is not None
        return State(start.positions + start.velocities * self.time, start.velocities)


class Slow(Truthful):
    """Air that is not in the scene: speeds are 5 % low from the first step on."""

    def read(self) -> State:
        state = super().read()
        return State(state.positions, state.velocities * (0.95 if self.count else 1.0))


class Dull(Truthful):
    """Rebounds lose 5 % of the speed."""

    def read(self) -> State:
        state, start = super().read(), self.truth(0.0)
        assert start is not None
        turned = (state.velocities * start.velocities).sum(axis=1) < 0
        return State(state.positions, np.where(turned[:, None], 0.95, 1.0) * state.velocities)
