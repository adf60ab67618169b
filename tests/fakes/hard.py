"""Engines that break what a hard case demands, one property each: they prove that every criterion can fail."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.hard import case_named
from impactbench.scenarios.pieces import opening, turn
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Truthful:
    """Replays the scene's own truth; where there is none, the start."""

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
        return self.truth(self.time) or self.start()

    def start(self) -> State:
        return opening(self.scene).at(0.0)

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
    """Moves at three steps' worth of gravity without getting anywhere."""

    def read(self) -> State:
        state = super().read()
        return State(
            state.positions,
            state.velocities + np.array([0, 0, 3 * 9.81 * self.step]),
            state.orientations,
            state.spins,
        )


class Ghost(Truthful):
    """Nothing stops a ball: the start's straight line."""

    def read(self) -> State:
        start = self.start()
        return State(start.positions + start.velocities * self.time, start.velocities)


class Slow(Truthful):
    """Air that is not in the scene: speeds are 5 % low from the first step on."""

    def read(self) -> State:
        state = super().read()
        return State(state.positions, state.velocities * (0.95 if self.count else 1.0), state.orientations, state.spins)


class Dull(Truthful):
    """Rebounds lose 5 % of the speed."""

    def read(self) -> State:
        state, start = super().read(), self.start()
        turned = (state.velocities * start.velocities).sum(axis=1) < 0
        return State(state.positions, np.where(turned[:, None], 0.95, 1.0) * state.velocities)


class Frozen(Truthful):
    """Nothing moves."""

    def read(self) -> State:
        start = self.start()
        return State(start.positions, 0 * start.velocities, start.orientations, start.spins)


class Heating(Truthful):
    """Everything gets 5 % faster after the start and climbs."""

    def read(self) -> State:
        state, factor = super().read(), 1.05 if self.count else 1.0
        spins = None if state.spins is None else factor * state.spins
        climbed = state.positions + self.time * np.array([0, 0, 1])
        return State(climbed, factor * state.velocities, state.orientations, spins)


class Turning(Truthful):
    """Bodies turn about x at 1 rad/s, whatever their spins say."""

    def read(self) -> State:
        state = super().read()
        assert state.orientations is not None
        turned = turn(np.tile([self.time, 0.0, 0.0], (len(state.positions), 1)), state.orientations)
        return State(state.positions, state.velocities, turned, state.spins)


class Uneven(Truthful):
    """The later a body is listed, the faster it is, by up to 5 %; those at rest move as well."""

    def read(self) -> State:
        state = super().read()
        rows = np.arange(len(state.positions))[:, None] / len(state.positions)
        moved = state.velocities * (1 + 0.05 * rows) + 0.05 * rows * [0, 0, 1]
        return State(state.positions, moved if self.count else state.velocities)


class Late(Truthful):
    """Everything happens a quarter later than it should."""

    def advance(self, steps: int) -> None:
        super().advance(steps)
        self.time *= 0.8
