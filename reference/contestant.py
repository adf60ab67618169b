"""The reference as a contestant: the stepped runner behind the harness' engine contract."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping

import numpy as np
from impactbench.reference.particles import build_bodies, build_pairs, check_supported
from impactbench.reference.rigid_run import RigidBodies
from impactbench.reference.stepped import SWEEPS, Rules, run, start
from impactbench.reference.swarm_run import Gas, why_not
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State

STRATEGIES = {"stepped": "project", "revert": "revert"}
"""Profile -> strategy of R4."""

TOUCH, STILL = 1e-10, 1e-13
"""Gap that counts as touching and speed that counts as none, next to the scene's length and speed."""


LARGE = 64
"""More movable bodies than this go to the fast runner, where it models all that they need."""


class Stepped:
    """Particles under either law, stepped as the documents describe (rules R3 and R4)."""

    settings: Mapping[str, object]

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        if not (math.isfinite(step) and step > 0):
            raise ValueError(f"{scene.name}: step {step} must be positive and finite")
        if not all(math.isfinite(value) for value in scene.gravity):
            raise ValueError(f"{scene.name}: gravity {scene.gravity} must be finite")
        strategy = strategy_of(profile)
        self._runner: Gas | AllPairs | RigidBodies
        if scene.model.rotation:
            if strategy == "revert":
                raise Unsupported("the strategy revert is the particles'; this scene needs rotation")
            self._runner = RigidBodies(scene, law, model, float(step))
            self.settings = {"law": law, "strategy": strategy, "axes": model.axes, **self._runner.settings}
            return
        check_supported(scene, law, model)
        if strategy == "project" and len(scene.movable) > LARGE and not why_not(scene, law, model):
            self._runner = Gas(scene, model, step)
        else:
            self._runner = AllPairs(scene, law, strategy, model, step)
        self.settings = {"law": law, "strategy": strategy, "axes": model.axes, **self._runner.settings}

    def advance(self, steps: int) -> None:
        self._runner.advance(steps)

    def read(self) -> State:
        return self._runner.read()

    def figures(self) -> Mapping[str, float]:
        """What the fast runner counts inside its steps; empty for the other."""
        return self._runner.figures() if isinstance(self._runner, Gas) else {}

    def close(self) -> None:
        """Nothing is held outside Python's memory."""


class AllPairs:
    """Every handled pair is looked at in every step: any scene of particles, a few bodies."""

    def __init__(self, scene: Scene, law: Law, strategy: str, model: Model, step: float) -> None:
        self._name, self._done = scene.name, 0
        self._bodies, self._pairs = build_bodies(scene), build_pairs(scene)
        self._movable = np.array(scene.movable, dtype=np.int64)
        self._rules = Rules(
            step=float(step),
            gravity=np.array(scene.gravity, dtype=np.float64),
            carried=np.array([1.0 if axis in model.axes else 0.0 for axis in range(3)]),
            doc=law == "doc",
            revert=strategy == "revert",
            touch=TOUCH * scene.length,
            still=STILL * scene.speed,
        )
        self.settings: Mapping[str, object] = {
            "order": "detect, impacts, gravity, lasting contacts and friction, move, " + strategy,
            "touching gap [m]": self._rules.touch,
            "negligible speed [m/s]": self._rules.still,
            "sweeps at most": SWEEPS,
        }
        start(self._bodies, self._pairs, self._rules)

    def advance(self, steps: int) -> None:
        done = run(self._bodies, self._pairs, self._rules, steps)
        self._done += done
        if done < steps:
            time = self._done * self._rules.step
            raise RuntimeError(f"{self._name}: contacts did not settle within {SWEEPS} sweeps at t = {time:.6g} s")

    def read(self) -> State:
        return State(self._bodies.position[self._movable], self._bodies.velocity[self._movable])


def strategy_of(profile: str) -> str:
    """The strategy a profile stands for."""
    if profile not in STRATEGIES:
        near = difflib.get_close_matches(profile, STRATEGIES, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"unknown profile {profile!r}: one of {', '.join(STRATEGIES)}{hint}")
    return STRATEGIES[profile]
