"""One contestant on one scene told in several ways: its runs, how far two lie apart, and what rounding may do."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from impactbench.reports.cell import record, step_count
from impactbench.scenarios import transforms
from impactbench.scenarios.engine import Engine, Unsupported
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Trajectory

SEED = 2.0**-30
"""Size of the perturbation that measures `growth`: far above round-off, far below a step."""
OPERATIONS = 8
FINER_SEED = 1024.0


@dataclass(frozen=True)
class Trial:
    """One contestant on one scene. It is loaded once: what a module remembers between runs must show."""

    engine: type[Engine]
    profile: str
    law: Law
    scene: Scene
    step: float

    def run(self, scene: Scene, time: float = 1.0, steps: int | None = None) -> Trajectory:
        count = step_count(self.scene, self.step) if steps is None else steps
        step = self.step * time
        engine = self.engine(scene, self.law, self.profile, scene.model, step)
        try:
            return record(engine, step, count)
        finally:
            engine.close()


def deviation(scene: Scene, base: Trajectory, other: Trajectory) -> float:
    """The largest difference of two runs, in the scene's scales; infinite where the other is not finite."""
    if not other.finite():
        return math.inf
    found = [
        float(np.linalg.norm(other.positions - base.positions, axis=2).max()) / scene.length,
        float(np.linalg.norm(other.velocities[-1] - base.velocities[-1], axis=1).max()) / scene.speed,
    ]
    if base.spins is not None and other.spins is not None:
        spin = np.linalg.norm(other.spins[-1] - base.spins[-1], axis=1).max()
        found.append(float(spin) * scene.length / scene.speed)
    return max(found)


def growth(trial: Trial, base: Trajectory) -> float:
    """How much larger a small difference of all positions or of all velocities is at its largest; infinite where one
    a thousand times smaller does as much: there the outcome jumps, as where a contact may be just missed.
    """
    scene = trial.scene
    signs = np.where(np.arange(len(scene.movable)) % 2 == 0, 1.0, -1.0)[:, None]
    change = signs * np.isin(np.arange(3), scene.model.axes) * np.array([1.0, -0.6, 0.8])

    def response(size: float, x: float, v: float) -> float:
        start = base.state(0)
        off = replace(start, positions=start.positions + x * change, velocities=start.velocities + v * change)
        try:
            return deviation(scene, base, trial.run(transforms.restarted(scene, off))) / size
        except Unsupported:
            return 1.0

    found = 1.0
    for x, v in ((scene.length, 0.0), (0.0, scene.speed)):
        grown, finer = (response(size, size * x, size * v) for size in (SEED, SEED / FINER_SEED))
        found = max(found, math.inf if finer > grown * math.sqrt(FINER_SEED) else grown)
    return found


def rounding(trial: Trial, base: Trajectory, extent: float) -> float:
    """What all rounded operations may add up to, in the scene's scales, where nothing grows."""
    scene = trial.scene
    reach = float(np.abs(base.positions).max()) + extent + max(_size(scene), scene.length)
    operations = OPERATIONS * len(base.times) * max(1, len(scene.movable))
    return operations * 2.0**-52 * max(reach, scene.speed * scene.duration) / scene.length


def _size(scene: Scene) -> float:
    return max(max(map(abs, body.position)) for body in scene.bodies)


def between(run: Trajectory, part: float) -> Trajectory:
    """The run read `part` of a step after each sample but the last, by the cubic through both states."""
    h, s = float(run.times[1] - run.times[0]), part
    x0, x1, v0, v1 = run.positions[:-1], run.positions[1:], run.velocities[:-1], run.velocities[1:]
    rise = s * s * (3 - 2 * s)
    x = x0 + rise * (x1 - x0) + h * s * (1 - s) * ((1 - s) * v0 - s * v1)
    spins = None if run.spins is None else run.spins[:-1] + s * (run.spins[1:] - run.spins[:-1])
    return Trajectory(run.times[:-1], x, v0 + s * (v1 - v0), None, spins)
