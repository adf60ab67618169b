"""Metamorphic relations of one case under one contestant: what must map along when the scene is told differently.

No truth is needed. Runs inside a child process. A deviation is the largest distance of any body at any step [scene
lengths] or, at the end, of its velocity [scene speeds] or spin [scene speeds / lengths].

What is allowed is derived, never tuned:
- `exact`: 0. Signs and powers of two pass through every floating-point operation, and a repeat has no excuse.
- `round-off`: each of N steps rounds positions and velocities, some 8 operations for every body, whose impulses pass
  through all others in a pile; a perturbed copy of the case tells how much what is off early grows (`growth`).
- `step`: impacts are placed to within a step, so that the deviation is of first order. At a quarter of the step a
  quarter is left; half is allowed, since the impacts fall elsewhere in their steps. Where they fell luckily at the
  step itself, a sixteenth of it decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import stack
from impactbench.reports.retold import Trial, between, deviation, growth, rounding
from impactbench.scenarios import transforms
from impactbench.scenarios.engine import Unavailable, Unsupported
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
SENSITIVE = 1e6
"""Growth from which on a case says nothing of round-off: chaos, or a contact that the perturbation opens."""
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
    return {"state": "ok", "reason": "", "growth": grown if math.isfinite(grown) else None, "rows": rows}


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

    def allowed(self, kind: Kind) -> float | None:
        """None where it is judged by how it falls with the step."""
        if kind == "step":
            return None
        grown = self.rounding * (self.growth if self.growth <= SENSITIVE else 1.0)
        return 0.0 if kind == "exact" else grown

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
    state = found.state(kind)
    grown = f"grow {found.growth:.2g}-fold" if math.isfinite(found.growth) else "do as much as large ones"
    note = f"small differences {grown}" if state == "sensitive" else found.note
    return row | {"state": state, "deviation": found.deviation, "allowed": found.allowed(kind), "note": note}


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
    """The deviation, and whether a quarter of the step, or a sixteenth, at least halves it."""
    found, finer, part = measure(trial), math.inf, 1
    floor = rounding(trial, trial.run(trial.scene, steps=1), 0.0)
    if found <= floor:
        return Found(found, floor)
    while part < FINER**2 and 2 * finer > found:
        part *= FINER
        finer = measure(replace(trial, step=trial.step / part))
    return Found(found, floor, 1.0, f"{finer:.2g} at 1/{part} of the step", 2 * finer <= found)


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
