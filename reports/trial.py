"""One world under test, built as often as a point of the contract needs, and how far two of its states are apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import step_count
from impactbench.reports.compare import law_of
from impactbench.scenarios.engine import Engine, Unavailable
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case

STEP = 1 / 60
STEPS = 60
PARTS = ("positions", "velocities", "orientations", "spins")


class Broken(Exception):
    """The point does not hold; the message is what was found."""


class NotBuilt(Exception):
    """The engine does not build this scene; whether it may refuse is a point of its own."""


@dataclass(frozen=True)
class Trial:
    """One case for one contestant, to be built as often as a point needs."""

    contestant: Contestant
    case: Case
    step: float = STEP

    @contextmanager
    def world(self) -> Iterator[Engine]:
        scene, law = self.case.scene, law_of(self.contestant, self.case, None)
        kind = kind_of(self.contestant)
        try:
            engine: Engine = kind(scene, law, self.contestant.profile, scene.model, self.step)
        except Unavailable:
            raise
        except Exception as why:
            raise NotBuilt from why
        try:
            yield engine
        finally:
            engine.close()

    def steps(self) -> int:
        return min(STEPS, step_count(self.case.scene, self.step))

    def end(self) -> State:
        """The state after all steps, taken one by one."""
        with self.world() as engine:
            for _ in range(self.steps()):
                engine.advance(1)
            return engine.read()


@cache
def kind_of(contestant: Contestant) -> type[Engine]:
    """Loaded once: a user's own file would be executed again, and worlds would no longer share its globals."""
    return contestant.load()


def opening(trial: Trial, turning: bool) -> State:
    bodies = [trial.case.scene.bodies[i] for i in trial.case.scene.movable]
    places, speeds = (np.array(list(rows)) for rows in zip(*((b.position, b.velocity) for b in bodies), strict=True))
    if not turning:
        return State(places, speeds)
    return State(places, speeds, np.array([b.orientation for b in bodies]), np.array([b.spin for b in bodies]))


def reordered(state: State, order: list[int]) -> State:
    turns, spins = state.orientations, state.spins
    return State(
        state.positions[order],
        state.velocities[order],
        None if turns is None else turns[order],
        None if spins is None else spins[order],
    )


def distance(a: State, b: State, trial: Trial) -> float:
    """Largest difference of any part, next to the scene's own scales; infinite where they cannot be compared."""
    return max(part_distance(part, a, b, trial) for part in PARTS)


def part_distance(part: str, a: State, b: State, trial: Trial) -> float:
    mine, theirs = getattr(a, part), getattr(b, part)
    if mine is None or theirs is None:
        return 0.0
    if mine.shape != theirs.shape:
        return math.inf
    gaps = np.abs(mine - theirs)
    if part == "orientations":  # q and -q are one turn
        gaps = np.minimum(gaps.max(axis=1), np.abs(mine + theirs).max(axis=1))
    same = np.array_equal(mine, theirs, equal_nan=True)  # a run that diverges must diverge twice
    scene = trial.case.scene
    scale = {
        "positions": max(scene.length, float(np.abs(theirs).max(initial=0.0))),
        "velocities": scene.speed,
        "orientations": 1.0,
        "spins": scene.speed / scene.length + float(np.abs(theirs).max(initial=0.0)),
    }[part]
    largest = float(gaps.max(initial=0.0))
    return 0.0 if same else largest / scale if math.isfinite(largest) else math.inf


def arrays_of(state: State) -> list[Floats]:
    return [array for name in PARTS if (array := getattr(state, name)) is not None]


def must_be_same(a: State, b: State, trial: Trial) -> None:
    away = distance(a, b, trial)
    if away:
        raise Broken(f"states {away:.2g} apart after {trial.steps()} steps")
