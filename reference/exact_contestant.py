"""The exact runner as a contestant. Its step is only the interval at which it can be read."""

from __future__ import annotations

import math
from collections.abc import Mapping

from impactbench.reference.exact import AT_EDGE, CROWDED, REACHED, begin, run
from impactbench.reference.exact_checks import check_scene
from impactbench.reference.exact_world import SPEED, TIME, World, build_world
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State

PROFILE = "exact"
MOST_EVENTS = 20_000_000
"""Events that one call may take."""


class Exact:
    """Spheres among walls under either law, from event to event."""

    settings: Mapping[str, object]

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if not (math.isfinite(step) and step > 0):
            raise ValueError(f"{scene.name}: step {step} must be positive and finite")
        if not all(math.isfinite(value) for value in scene.gravity):
            raise ValueError(f"{scene.name}: gravity {scene.gravity} must be finite")
        if profile != PROFILE:
            raise ValueError(f"unknown profile {profile!r}: the exact runner has only {PROFILE!r}")
        check_scene(scene, law, model)
        self._name, self._step, self._done = scene.name, float(step), 0
        self._world = build_world(scene, law, model)
        rules = self._world.rules
        if may_stop(self._world):
            self._try(scene, law, model)
        self.settings = {
            "law": law,
            "method": "event-driven, closed-form contact times",
            "axes": model.axes,
            "speed that comes to rest on a wall [m/s]": rules.rest,
            "one instant [s]": rules.instant,
            "cells": tuple(int(n) for n in self._world.cells.number),
            "events at most": MOST_EVENTS,
        }
        begin(self._world)

    @property
    def impacts(self) -> tuple[int, int]:
        """Impacts so far: between spheres, with walls."""
        return int(self._world.tally[0]), int(self._world.tally[1])

    def advance(self, steps: int) -> None:
        self._done += steps
        self._run(self._world, self._done * self._step)

    def _try(self, scene: Scene, law: Law, model: Model) -> None:
        """Run ahead to the scene's end, so that a scene that cannot be done is refused before it begins."""
        trial = build_world(scene, law, model)
        begin(trial)
        self._run(trial, scene.duration)

    def _run(self, world: World, until: float) -> None:
        outcome, time = run(world, until, MOST_EVENTS)
        if outcome == REACHED:
            return
        where = f"{self._name}: t = {time:.9g} s"
        if outcome == CROWDED:
            raise Unsupported(f"{where}: impacts accumulate; the exact runner does not stack spheres at rest")
        if outcome == AT_EDGE:
            raise Unsupported(f"{where}: a sphere comes to a box's edge; the exact runner handles faces only")
        raise RuntimeError(f"{where}: more than {MOST_EVENTS} events")

    def read(self) -> State:
        """Positions and velocities now; each body has a time of its own, so reading changes nothing."""
        s, count = self._world.spheres, self._world.rules.movable
        m, pull = s.motion[:count], s.acceleration[:count]
        span, velocity = self._done * self._step - m[:, TIME, None], m[:, SPEED : SPEED + 3]
        return State(m[:, :3] + span * (velocity + span / 2 * pull), velocity + span * pull)

    def close(self) -> None:
        """Nothing is held outside Python's memory."""


def may_stop(world: World) -> bool:
    """Whether spheres could come to lie on one another or to an edge, where this runner ends."""
    many, elastic = len(world.spheres.motion) > 1, bool((world.rules.bounciness == 1.0).all())
    return bool(world.walls.bounded.any()) or (many and (world.rules.pulled or not elastic))
