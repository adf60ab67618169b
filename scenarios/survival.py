"""Survival of a hard case: criteria that follow from its truth, evaluated over the whole trajectory.

A criterion is a signal over time and the largest value the truth allows. It is failed at the first time its signal lies
above the limit: that is the time to failure. Signals are dimensionless wherever the limit is 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import opening
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Family, Truth

Signal = Callable[[Scene, Trajectory], Floats]
"""Scene and trajectory of T times -> [T]."""

PART = 0.01
"""Where the truth is a number, an engine may miss it by one part in a hundred: the harness's target elsewhere too."""


@dataclass(frozen=True, eq=False)
class Criterion:
    """What must hold all the time. `limit` follows from the truth as `derivation` says, never from a contestant."""

    name: str
    description: str
    limit: float
    derivation: str
    signal: Signal


@dataclass(frozen=True)
class Verdict:
    """One criterion on one run: the largest value of its signal, and the time [s] it first lay above the limit."""

    criterion: str
    survived: bool
    worst: float
    limit: float
    time: float | None


@dataclass(frozen=True, eq=False)
class Knob:
    """The one parameter whose breaking point is asked for.

    low, high:  bounds of the search; kind: how values are spaced.
    breaks:     whether survival is lost above or below the breaking point.
    criteria:   names of the criteria that count, empty for all.
    fixed:      the family's other parameters.
    truth:      the value at which a rigid body gives way, where there is one; else survival is right at every value.
    step:       the parameter is the step [s] itself: the case stays the same.
    """

    parameter: str
    low: float
    high: float
    kind: Literal["int", "log", "linear"]
    breaks: Literal["above", "below"] = "above"
    criteria: tuple[str, ...] = ()
    fixed: Parameters | None = None
    truth: float | None = None

    @property
    def step(self) -> bool:
        return self.parameter == "step"


@dataclass(frozen=True, eq=False)
class HardFamily(Family):
    """A family with survival criteria. `make` builds the case of any parameters.

    values, full: parameters of the default cases and of those behind `--full`.
    steps:        the steps a case is run at, as text.
    policies:     contestants beyond the listed ones whose settings are meant to mend what breaks here.
    outcome:      names what came out where the truth allows more than one thing.
    seconds:      what the cases of `full` may take on one core with all contestants, said beforehand.
    """

    make: Callable[..., Case]
    criteria: Callable[[Scene], tuple[Criterion, ...]]
    values: tuple[Parameters, ...]
    full: tuple[Parameters, ...] = ()
    knob: Knob | None = None
    steps: Callable[[Scene], tuple[str, ...]] = lambda _: ("1/240",)
    policies: tuple[str, ...] = ()
    outcome: Callable[[Scene, Trajectory], str] | None = None
    seconds: float = 0.0

    def names(self, full: bool = True) -> list[str]:
        """Names of the cases, without building them."""
        return [case_name(self.name, values) for values in (*self.values, *(self.full if full else ()))]


def hard_family(
    name: str,
    question: str,
    needs: str,
    make: Callable[..., Case],
    criteria: Callable[[Scene], tuple[Criterion, ...]],
    values: Sequence[Parameters],
    **others: object,
) -> HardFamily:
    """The family whose default cases are those of `values`."""
    cases = tuple(values)
    return HardFamily(
        name,
        question,
        needs,
        lambda: [make(**v) for v in cases],
        make,
        criteria,
        cases,
        **others,  # type: ignore[arg-type]
    )


def judge(scene: Scene, criteria: Sequence[Criterion], trajectory: Trajectory) -> list[Verdict]:
    """Every criterion's verdict on a finite trajectory. Raises OverflowError where a signal is not finite."""
    verdicts = []
    for criterion in criteria:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            signal = np.asarray(criterion.signal(scene, trajectory), dtype=np.float64)
        if not np.isfinite(signal).all():
            raise OverflowError(f"{criterion.name} is not finite")
        above = np.flatnonzero(signal > criterion.limit)
        time = float(trajectory.times[above[0]]) if len(above) else None
        verdicts.append(Verdict(criterion.name, time is None, float(signal.max()), criterion.limit, time))
    return verdicts


def step_of(trajectory: Trajectory) -> float:
    """The step [s] at which the trajectory was read."""
    return float(trajectory.times[1] - trajectory.times[0])


def from_time(trajectory: Trajectory, start: float, signal: Floats) -> Floats:
    """The signal from `start` [s] on, 0 before: what must hold only once a thing has happened."""
    return np.asarray(np.where(trajectory.times >= start, signal, 0.0))


def at_end(trajectory: Trajectory, value: float) -> Floats:
    """A signal that is known at the last time only."""
    signal = np.zeros(len(trajectory.times))
    signal[-1] = value
    return signal


def masses(scene: Scene) -> Floats:
    return np.array([scene.bodies[i].mass for i in scene.movable], dtype=np.float64)


def kinetic(scene: Scene, trajectory: Trajectory) -> Floats:
    """Kinetic energy [J] at every time, spin included where it is modelled."""
    energy: Floats = (masses(scene) * (trajectory.velocities**2).sum(axis=2)).sum(axis=1) / 2
    if trajectory.spins is None or trajectory.orientations is None:
        return energy
    inertia = np.array([scene.bodies[i].principal_inertia() for i in scene.movable])
    own = to_body(trajectory.orientations, trajectory.spins)
    return np.asarray(energy + (inertia * own**2).sum(axis=(1, 2)) / 2)


def energy(scene: Scene, trajectory: Trajectory) -> Floats:
    """Kinetic and potential energy [J] at every time."""
    work: Floats = (trajectory.positions @ np.array(scene.gravity) * masses(scene)).sum(axis=1)
    return np.asarray(kinetic(scene, trajectory) - work)


def momentum(scene: Scene, trajectory: Trajectory) -> Floats:
    """Total momentum [kg m/s], shape [T, 3]."""
    return np.asarray((trajectory.velocities * masses(scene)[:, None]).sum(axis=1))


def to_body(q: Floats, v: Floats) -> Floats:
    """Vectors [..., 3] in the own axes of bodies turned by unit quaternions (w, x, y, z) [..., 4]."""
    axis = -q[..., 1:]
    cross = 2 * np.cross(axis, v)
    return np.asarray(v + q[..., :1] * cross + np.cross(axis, cross))


def energy_kept(why: str = "elastic impacts and no friction: energy is constant") -> Criterion:
    """|E - E0| next to the scene's energy scale."""

    def signal(scene: Scene, trajectory: Trajectory) -> Floats:
        total = energy(scene, trajectory)
        return np.asarray(np.abs(total - total[0]) / scene.energy)

    return Criterion("energy", "energy stays within 1 % of the scale", PART, why, signal)


def at_rest(scene: Scene) -> Truth:
    """Statics: every body stays where it starts."""
    rest = opening(scene)
    return Truth("trajectory", replace(rest, accelerations=rest.accelerations * 0).at)


def invariant(scene: Scene) -> Mapping[Law, Truth]:
    """No state is known: conservation only."""
    return dict.fromkeys(scene.laws, Truth("invariant", lambda _: None))
