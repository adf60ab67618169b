"""Metamorphic relations of one case under one contestant: what must map along when the scene is told differently.

No truth is needed. Runs inside a child process. A deviation is the largest distance of any body at any step [scene
lengths] or, at the end, of its velocity [scene speeds] or spin [scene speeds / lengths].

What is allowed is derived, never tuned:
- `exact`: 0. Signs and powers of two pass through every floating-point operation, and a repeat has no excuse.
- `round-off`: each of N steps rounds positions and velocities, some 8 operations for every body, whose impulses pass
  through all others in a pile; a perturbed copy of the case tells how much what is off early grows (`growth`).
- `step`: impacts are placed to within a step, so that the deviation is of first order. At a quarter of the step a
  quarter is left; half is allowed, since the impacts fall elsewhere in their steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import record, stack, step_count
from impactbench.scenarios import transforms
from impactbench.scenarios.engine import Engine, Unavailable, Unsupported
from impactbench.scenarios.records import Contact, Law, Model, Scene, shifted
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.transforms import Similarity

Kind = Literal["exact", "round-off", "step"]
RELATIONS = (
    *("repeat", "mirror", "turn", "rotate", "order", "shift", "boost", "length", "time", "mass"),
    *("restart", "reversal", "phase"),
)
MEANING = {
    "repeat": "the same scene again, in the same process",
    "mirror": "x to -x, along each axis that moves",
    "turn": "quarter turns and a swap of all axes",
    "rotate": "by 30 and 45 degrees about y and z",
    "order": "bodies listed the other way round",
    "shift": "by 1, 1e3 and 1e6 m",
    "boost": "a common velocity, where nothing is static",
    "length": "in units 1024 times larger and smaller",
    "time": "in units 1024 times larger and smaller",
    "mass": "in units 1024 times larger and smaller",
    "restart": "a new world from the state at half time",
    "reversal": "back to the start with all velocities reversed, where nothing is lost",
    "phase": "begun 1/4, 1/2 and 3/4 of a step earlier",
}
SEED = 2.0**-30
"""Size of the perturbation that measures `growth`: far above round-off, far below a step."""
SENSITIVE = 1e6
"""Growth from which on a case says nothing of round-off: chaos, or a contact that the perturbation opens."""
OPERATIONS = 8
FINER = 4
FACTOR = 1024.0


@dataclass(frozen=True)
class Variant:
    """One way of telling a scene; `back` tells its outcome as that of the original."""

    relation: str
    label: str
    kind: Kind
    scene: Scene
    back: Callable[[Trajectory], Trajectory]
    model: Model
    """What the original must be run with to compare: one that moves along as many axes."""
    time: float = 1.0
    extent: float = 0.0
    """Largest position [m] that the telling adds, in units of the original."""


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


def similar(scene: Scene, relation: str, label: str, kind: Kind, to: Similarity) -> Variant:
    extent = math.hypot(*to.shift) + math.hypot(*to.boost) * scene.duration
    changed = transforms.transformed(scene, to)
    found = np.abs(to.redirect(np.eye(3)[list(changed.model.axes)])).max(axis=0) > 1e-9
    model = replace(scene.model, axes=tuple(int(k) for k in np.flatnonzero(found)))
    return Variant(relation, label, kind, changed, lambda run: transforms.returned(run, to), model, to.time, extent)


def variants(scene: Scene) -> Iterator[Variant]:
    """Every relation that has a meaning in the scene, save those that need the original's own run."""
    yield Variant("repeat", "again", "exact", scene, lambda run: run, scene.model)
    for relation, label, kind, to in similarities(scene):
        try:
            variant = similar(scene, relation, label, kind, to)
        except Unsupported:
            continue
        if variant.scene != scene:
            yield variant
    backwards = tuple(reversed(range(len(scene.bodies))))
    if len(scene.bodies) > 1:
        rows = transforms.original_rows(scene, backwards)
        other = transforms.reordered(scene, backwards)
        yield Variant("order", "reversed", "round-off", other, lambda run: transforms.picked(run, rows), scene.model)


def similarities(scene: Scene) -> Iterator[tuple[str, str, Kind, Similarity]]:
    for axis in scene.model.axes:
        signs = tuple(-1.0 if k == axis else 1.0 for k in range(3))
        yield "mirror", f"{'xyz'[axis]} reversed", "exact", Similarity(signs=(signs[0], signs[1], signs[2]))
    yield "turn", "x to y to z to x", "round-off", Similarity(order=(2, 0, 1))
    yield "turn", "90 deg about y", "round-off", Similarity(order=(2, 1, 0), signs=(1.0, 1.0, -1.0))
    yield "turn", "90 deg about z", "round-off", Similarity(order=(1, 0, 2), signs=(-1.0, 1.0, 1.0))
    for degrees in (30, 45):
        c, s = math.cos(math.radians(degrees) / 2), math.sin(math.radians(degrees) / 2)
        yield "rotate", f"{degrees} deg about y", "round-off", Similarity(turn=(c, 0.0, s, 0.0))
        yield "rotate", f"{degrees} deg about z", "round-off", Similarity(turn=(c, 0.0, 0.0, s))
    for distance in (1.0, 1e3, 1e6):
        along = [distance if k in scene.model.axes else 0.0 for k in range(3)]
        yield "shift", f"{distance:g} m", "round-off", Similarity(shift=(along[0], along[1], along[2]))
    speed = [scene.speed * part if k in scene.model.axes else 0.0 for k, part in enumerate((0.7, -0.9, 1.3))]
    yield "boost", f"{math.hypot(*speed):.3g} m/s", "round-off", Similarity(boost=(speed[0], speed[1], speed[2]))
    for factor, label in ((FACTOR, "x 1024"), (1 / FACTOR, "x 1/1024")):
        yield "length", label, "exact", Similarity(length=factor)
        yield "time", label, "exact", Similarity(time=factor)
        yield "mass", label, "exact", Similarity(mass=factor)


def try_case(argument: tuple[Contestant, Law, Scene, float]) -> dict[str, Any]:
    """All relations of one case. `rows`: relation, label, kind, state, deviation, allowed and a note."""
    contestant, law, scene, step = argument
    try:
        trial = Trial(contestant.load(), contestant.profile, law, scene, step)
        base = trial.run(scene)
    except Unsupported as why:
        return {"state": "unsupported", "reason": str(why), "rows": []}
    except Unavailable as why:
        return {"state": "unavailable", "reason": str(why), "rows": []}
    if not base.finite():
        return {"state": "diverged", "reason": "the original is not finite", "rows": []}
    grown = growth(trial, base)
    originals = {scene.model: (trial, base, grown)}
    rows = [_row(originals, trial, variant) for variant in variants(scene)]
    rows += [_settle("restart", "at half time", "round-off", lambda: _restart(trial, base, grown))]
    if all(_lossless(c, law) for c in (scene.contact, *(c for _, _, c in scene.pairs))):
        rows += [_settle("reversal", "back to the start", "step", lambda: _refined(trial, _reversal))]
    if scene.phase_free:
        rows += [_settle("phase", "worst of 3", "step", lambda: _refined(trial, _phase))]
    again = Variant("repeat", "after all others", "exact", scene, lambda run: run, scene.model)
    rows += [_row(originals, trial, again)]
    return {"state": "ok", "reason": "", "growth": grown, "rows": rows}


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
    """How much larger a small difference of all positions and of all velocities is at its largest."""
    scene = trial.scene
    signs = np.where(np.arange(len(scene.movable)) % 2 == 0, 1.0, -1.0)[:, None]
    change = SEED * signs * np.isin(np.arange(3), scene.model.axes) * np.array([1.0, -0.6, 0.8])
    start, found = base.state(0), 1.0
    for x, v in ((scene.length * change, 0.0), (0.0, scene.speed * change)):
        perturbed = replace(start, positions=start.positions + x, velocities=start.velocities + v)
        try:
            run = trial.run(transforms.restarted(scene, perturbed))
        except Unsupported:
            continue
        found = max(found, deviation(scene, base, run) / SEED)
    return found


def rounding(trial: Trial, base: Trajectory, extent: float) -> float:
    """What all rounded operations may add up to, in the scene's scales, where nothing grows."""
    scene = trial.scene
    reach = float(np.abs(base.positions).max()) + extent + max(_size(scene), scene.length)
    operations = OPERATIONS * len(base.times) * max(1, len(scene.movable))
    return operations * 2.0**-52 * max(reach, scene.speed * scene.duration) / scene.length


def _size(scene: Scene) -> float:
    return max(max(map(abs, body.position)) for body in scene.bodies)


Original = tuple[Trial, Trajectory, float]


def _row(originals: dict[Model, Original], trial: Trial, variant: Variant) -> dict[str, Any]:
    def once() -> Found:
        if variant.model not in originals:
            wide = replace(trial, scene=replace(trial.scene, model=variant.model))
            base = wide.run(wide.scene)
            originals[variant.model] = (wide, base, growth(wide, base))
        wide, base, grown = originals[variant.model]
        run = variant.back(trial.run(variant.scene, variant.time))
        return Found(deviation(trial.scene, base, run), rounding(wide, base, variant.extent), grown)

    return _settle(variant.relation, variant.label, variant.kind, once)


@dataclass(frozen=True)
class Found:
    """A deviation and what rounding may add to it; `kept` where it is judged by how it falls with the step."""

    deviation: float
    rounding: float
    growth: float = 1.0
    note: str = ""
    kept: bool | None = None
    memory: bool = False
    """Whether the engine may hold more than its state: what a contact remembers."""

    def state(self, kind: Kind) -> str:
        if self.deviation == 0:
            return "exact"
        if self.kept is not None:
            return "holds" if self.kept else "broken"
        within = "inexact" if kind == "exact" else "holds"
        if self.deviation <= self.rounding:
            return within
        if not self.growth <= SENSITIVE:
            return "broken" if kind == "exact" else "sensitive"
        return within if self.deviation <= self.rounding * self.growth else "memory" if self.memory else "broken"


def _settle(relation: str, label: str, kind: Kind, once: Callable[[], Found]) -> dict[str, Any]:
    row: dict[str, Any] = {"relation": relation, "label": label, "kind": kind, "deviation": None, "allowed": None}
    try:
        found = once()
    except Unsupported as why:
        return row | {"state": "unsupported", "note": str(why)}
    except Exception as why:
        return row | {"state": "error", "note": f"{type(why).__name__}: {why}"}
    if not math.isfinite(found.deviation):
        return row | {"state": "diverged", "note": "the state is not finite"}
    state, allowed = found.state(kind), 0.0 if kind == "exact" else found.rounding * found.growth
    note = f"small differences grow {found.growth:.2g}-fold" if state == "sensitive" else found.note
    allowed_here = None if kind == "step" or state == "sensitive" else allowed
    return row | {"state": state, "deviation": found.deviation, "allowed": allowed_here, "note": note}


def _restart(trial: Trial, base: Trajectory, grown: float) -> Found:
    half = (len(base.times) - 1) // 2
    later = trial.run(transforms.restarted(trial.scene, base.state(half)), steps=len(base.times) - 1 - half)
    spins = None if base.spins is None else base.spins[half:]
    rest = Trajectory(base.times[half:], base.positions[half:], base.velocities[half:], None, spins)
    touching = not _flies(trial, base, half)
    note = "in contact then: what a contact remembers is no part of a state" if touching else ""
    return Found(deviation(trial.scene, rest, later), rounding(trial, base, 0.0), grown, note, memory=touching)


def _flies(trial: Trial, base: Trajectory, index: int) -> bool:
    """Whether every body moves freely in the steps around `index`."""
    pull = np.array(trial.scene.gravity) * trial.step if trial.scene.model.gravity else np.zeros(3)
    near = np.diff(base.velocities[max(index - 1, 0) : index + 2], axis=0) - pull
    return bool(np.abs(near).max(initial=0.0) <= 1e-9 * trial.scene.speed)


def _refined(trial: Trial, measure: Callable[[Trial], float]) -> Found:
    """The deviation, and whether a quarter of the step at least halves it."""
    finer = measure(replace(trial, step=trial.step / FINER))
    found = measure(trial)
    floor = rounding(trial, trial.run(trial.scene, steps=1), 0.0)
    if found <= floor:
        return Found(found, floor)
    return Found(found, floor, 1.0, f"{finer:.2g} at a quarter of the step", 2 * finer <= found)


def _reversal(trial: Trial) -> float:
    base = trial.run(trial.scene)
    run = trial.run(transforms.restarted(trial.scene, transforms.backwards(base.state(len(base.times) - 1))))
    back = transforms.backwards(run.state(len(run.times) - 1))
    return deviation(trial.scene, stack(base.times[:1], [base.state(0)]), stack(base.times[:1], [back]))


def _lossless(contact: Contact, law: Law) -> bool:
    return contact.bounciness == 1 and (contact.friction if law == "nc" else contact.viscosity) == 0


def _phase(trial: Trial) -> float:
    scene, base, found = trial.scene, trial.run(trial.scene), 0.0
    for part in (0.25, 0.5, 0.75):
        run = trial.run(shifted(scene, part * trial.step), steps=len(base.times))
        found = max(found, deviation(scene, base, between(run, part)))
    return found


def between(run: Trajectory, part: float) -> Trajectory:
    """The run read `part` of a step after each sample but the last, by the cubic through both states."""
    h, s = float(run.times[1] - run.times[0]), part
    x0, x1, v0, v1 = run.positions[:-1], run.positions[1:], run.velocities[:-1], run.velocities[1:]
    rise = s * s * (3 - 2 * s)
    x = x0 + rise * (x1 - x0) + h * s * (1 - s) * ((1 - s) * v0 - s * v1)
    spins = None if run.spins is None else run.spins[:-1] + s * (run.spins[1:] - run.spins[:-1])
    return Trajectory(run.times[:-1], x, v0 + s * (v1 - v0), None, spins)
