"""The reference as a contestant: the stepped runner behind the harness' engine contract."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from impactbench.reference.callback import Callback, asked_to_leave, without
from impactbench.reference.coefficients import build_coefficients, refuse_reversal
from impactbench.reference.interlocked import refuse_interlocked
from impactbench.reference.nearby import Nearby, build_nearby, list_all, list_anew
from impactbench.reference.pair_list import no_pairs
from impactbench.reference.pairs import pair_counts
from impactbench.reference.particles import build_bodies, check_supported
from impactbench.reference.progress import build_progress
from impactbench.reference.rigid_run import RigidBodies
from impactbench.reference.stepped import SWEEPS, Rules, run, start
from impactbench.reference.swarm_run import Gas, why_not
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State

PROFILES = {
    "stepped": "project, viscous friction as damping",
    "revert": "revert, viscous friction as damping",
    "force": "project, viscous friction as an explicit force",
    "positions": "project with velocities from positions, viscous friction as damping",
}
"""Which strategy of R4 and which friction of R5 each profile takes."""

TOUCH, STILL = 1e-10, 1e-13
"""Gap that counts as touching and speed that counts as none, next to the scene's length and speed."""

FEW = 2000
"""Up to so many pairs, all are looked at."""
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
        self._runner: Gas | Particles | RigidBodies
        if scene.model.rotation:
            if profile != "stepped":
                raise Unsupported(f"the profile {profile} is the particles'; this scene needs rotation")
            self._runner = RigidBodies(scene, law, model, float(step))
            refuse_interlocked(scene)
            self.settings = {"law": law, "strategy": strategy, "axes": model.axes, **self._runner.settings}
            return
        check_supported(scene, law, model)
        if profile == "stepped" and len(scene.movable) > LARGE and not why_not(scene, law, model):
            self._runner = Gas(scene, model, step)
        else:
            self._runner = Particles(scene, law, profile, model, step)
        self.settings = {"law": law, "strategy": strategy, "axes": model.axes, **self._runner.settings}

    def advance(self, steps: int) -> None:
        self._runner.advance(steps)

    def read(self) -> State:
        return self._runner.read()

    def on_contact(self, callback: Callback) -> None:
        """Call `callback` after every step for each pair that touched in it (documents, rule R3); never needed by the
        physics. The bodies it names leave then; `read` gives the others, in the scene's order. Particles only.
        """
        if not isinstance(self._runner, Particles):
            raise Unsupported(
                "contacts are reported by the runner of particles only, not of elastic gases or rigid bodies"
            )
        self._runner.on_contact(callback)

    def figures(self) -> Mapping[str, float]:
        """What the fast runner counts inside its steps; empty for the other."""
        return self._runner.figures() if isinstance(self._runner, Gas) else {}

    def close(self) -> None:
        """Nothing is held outside Python's memory."""


class Particles:
    """Any scene of particles. Of few bodies every handled pair is looked at in every step, of many those that are near.

    few: so many pairs are few.
    """

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float, few: int = FEW) -> None:
        strategy = strategy_of(profile)
        self._scene, self._done = scene, 0
        self._bodies = build_bodies(scene)
        refuse_interlocked(scene)
        self._callback: Callback | None = None
        self._movable = np.array(scene.movable, dtype=np.int64)
        self._rules = Rules(
            step=float(step),
            gravity=np.array(scene.gravity, dtype=np.float64),
            carried=np.array([1.0 if axis in model.axes else 0.0 for axis in range(3)]),
            doc=law == "doc",
            revert=strategy == "revert",
            positions=profile == "positions",
            touch=TOUCH * scene.length,
            still=STILL * scene.speed,
        )
        self._force_step = float(step) if profile == "force" and law == "doc" else 0.0
        self._nearby = self._build_nearby()
        if self._force_step > 0:
            refuse_reversal(scene, self._nearby.coefficients, self._bodies.inverse_mass)
        _, one_way, two_way = pair_counts(len(scene.statics), len(scene.movable))
        every = one_way + two_way <= few
        if every:
            self._pairs = list_all(scene, self._bodies, self._nearby)
        else:
            self._pairs = list_anew(self._bodies, no_pairs(), self._nearby, self._rules.touch)
        self._progress = build_progress(len(scene.bodies))
        self.settings: Mapping[str, object] = {
            "order": "detect, impacts, gravity, lasting contacts and friction, move, " + strategy,
            "options": PROFILES[profile],
            "pairs": "all" if every else "those near, from cells",
            "touching gap [m]": self._rules.touch,
            "negligible speed [m/s]": self._rules.still,
            "sweeps at most": SWEEPS,
        }
        start(self._bodies, self._pairs, self._rules)

    def on_contact(self, callback: Callback) -> None:
        self._callback = callback

    def advance(self, steps: int) -> None:
        if self._callback is None:
            self._run(steps)
            return
        for _ in range(steps):
            self._run(1)
            time = self._done * self._rules.step
            leaving = asked_to_leave(self._callback, time, [body.name for body in self._scene.bodies], self._pairs)
            if leaving:
                self._leave(leaving)

    def _leave(self, leaving: set[int]) -> None:
        self._bodies, self._pairs, kept = without(self._bodies, self._pairs, leaving)
        self._scene = replace(self._scene, bodies=tuple(self._scene.bodies[i] for i in kept))
        self._movable = np.array(self._scene.movable, dtype=np.int64)
        self._progress = build_progress(len(kept))
        rooms, self._nearby = self._nearby.rooms, self._build_nearby()
        self._nearby.rooms.centre[:], self._nearby.rooms.size[:] = rooms.centre[kept], rooms.size[kept]

    def _build_nearby(self) -> Nearby:
        coefficients = build_coefficients(self._scene, self._force_step)
        return build_nearby(self._scene, self._bodies, coefficients, self._rules.carried, self._rules.step)

    def _run(self, steps: int) -> None:
        end = self._done + steps
        while self._done < end:
            self._done += run(
                self._bodies, self._pairs, self._nearby.rooms, self._progress, self._rules, end - self._done
            )
            if (reach := self._progress.wanted[0]) >= 0:
                self._pairs = list_anew(self._bodies, self._pairs, self._nearby, reach)
                self._progress.wanted[0] = -1.0
            elif self._done < end:
                time, name = self._done * self._rules.step, self._scene.name
                raise RuntimeError(f"{name}: contacts did not settle within {SWEEPS} sweeps at t = {time:.6g} s")

    def read(self) -> State:
        return State(self._bodies.position[self._movable], self._bodies.velocity[self._movable])


def strategy_of(profile: str) -> str:
    """The strategy of R4 a profile stands for."""
    if profile not in PROFILES:
        near = difflib.get_close_matches(profile, PROFILES, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"unknown profile {profile!r}: one of {', '.join(PROFILES)}{hint}")
    return "revert" if profile == "revert" else "project"
