"""All measures of one run, from its trajectory, its scene and the truth of its own law: one code path for every
contestant.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from impactbench.reports import conservation
from impactbench.reports.impacts import Impact, PairHistory, find_impacts, impact_error, pair_histories, restitution
from impactbench.reports.split import split
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Floats, State, Trajectory
from impactbench.scenarios.truth import Case, Truth

COMPARED_TIMES = 60
"""Trajectory errors are taken at about this many steps, spread evenly over the run, the last one included."""

EXPLAINED = 1e-3
"""A tenth of the error that reports ask for by default: from here on a figure says when it was reached."""
TIMES = ("wall_time", "wall_time_min", "wall_time_low", "wall_time_high", "wall_harness")
UNITS = {"impact_time_error": "s", "wall_read": "s"} | dict.fromkeys(TIMES, "s/s")
"""Units of the measures that are not dimensionless."""


@dataclass(frozen=True)
class Figure:
    """One measured number. Errors are fractions of the scene's own length, speed or energy scale."""

    measure: str
    value: float
    time: float | None = None
    """When it was reached [s], where one instant can be named."""
    bodies: tuple[str, ...] = ()

    def row(self) -> dict[str, object]:
        """As results hold it; time and bodies only where there is more than round-off to explain."""
        found: dict[str, object] = {"measure": self.measure, "value": self.value, "unit": self.unit}
        if self.time is not None and abs(self.value) > EXPLAINED:
            found |= {"time": self.time, "bodies": list(self.bodies)} if self.bodies else {"time": self.time}
        return found

    @property
    def unit(self) -> str:
        return UNITS.get(self.measure, "1")


def measure(case: Case, law: Law, trajectory: Trajectory, delay: float = 0.0) -> list[Figure]:
    """Every figure this run can give; `delay` [s] is how much later than in the truth everything happens (see
    `shifted`).

    The trajectory must be finite; a measure without meaning in the scene is absent.
    """
    scene = case.scene
    pairs = pair_histories(scene, trajectory)
    impacts = [] if scene.model.rotation else find_impacts(scene, trajectory, pairs)
    found = [
        *_against_truth(scene, case.truths[law], trajectory, delay),
        *_conserved(scene, law, case.truths[law], trajectory, pairs, impacts, delay),
        *_at_impacts(scene, law, case.truths[law], trajectory, impacts, delay),
        *_penetration(scene, pairs, trajectory),
    ]
    known = {figure.measure: (figure.measure, figure.value, figure.time, figure.bodies) for figure in found}
    momenta = conservation.spin_momenta(scene, trajectory) if trajectory.spins is not None else None
    return [*found, *(Figure(*part) for part in split(scene, trajectory, pairs, known, momenta))]


def _against_truth(scene: Scene, truth: Truth, trajectory: Trajectory, delay: float) -> Iterator[Figure]:
    last = int(np.searchsorted(trajectory.times - delay, truth.horizon, "right")) - 1
    end = truth.state(float(trajectory.times[last]) - delay)
    if end is not None:
        yield Figure("position_error", _distance(trajectory.positions[last], end) / scene.length)
        yield Figure("velocity_error", _largest(trajectory.velocities[last] - end.velocities) / scene.speed)
        if end.spins is not None and trajectory.spins is not None:
            yield Figure("spin_error", _largest(trajectory.spins[last] - end.spins) * scene.length / scene.speed)
    if truth.kind != "trajectory":
        return
    squares = []
    for k in np.unique(np.linspace(0, last, COMPARED_TIMES + 1).round().astype(int)):
        time = float(trajectory.times[k]) - delay
        state = truth.state(time) if time >= 0 else None
        if state is not None:
            squares.append(_distance(trajectory.positions[k], state) ** 2)
    if squares:
        yield Figure("trajectory_error", math.sqrt(sum(squares) / len(squares)) / scene.length)


def _distance(positions: Floats, state: State) -> float:
    return _largest(positions - state.positions)


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max())


def _conserved(
    scene: Scene,
    law: Law,
    truth: Truth,
    trajectory: Trajectory,
    pairs: list[PairHistory],
    impacts: list[Impact],
    delay: float,
) -> Iterator[Figure]:
    yield largest("momentum_drift", conservation.momentum_drifts(scene, law, trajectory, pairs), trajectory)
    angular = conservation.angular_momentum_drifts(scene, law, trajectory, impacts)
    if angular is not None:
        yield largest("angular_momentum_drift", angular, trajectory)
    raw, offset = conservation.energies(scene, trajectory), conservation.matched_offset(scene, trajectory)
    matched = raw + offset
    yield Figure("offset_energy", float(np.abs(offset).max()) / scene.energy)
    yield largest("energy_gain", (matched - np.minimum.accumulate(matched)) / scene.energy, trajectory)
    expected = _expected_energy(scene, law, truth, trajectory, delay)
    if expected is not None:
        yield Figure("energy_drift", float(matched[-1] - expected) / scene.energy)
        yield Figure("energy_drift_raw", float(raw[-1] - expected) / scene.energy)


def largest(measure: str, series: Floats, trajectory: Trajectory) -> Figure:
    """The largest of a series over the run's times, shape [T], and when it was reached first."""
    index = int(series.argmax())
    return Figure(measure, float(series[index]), float(trajectory.times[index]))


def _expected_energy(scene: Scene, law: Law, truth: Truth, trajectory: Trajectory, delay: float) -> float | None:
    return expected_energy(scene, law, truth, float(trajectory.times[-1]) - delay, _at(trajectory, 0))


def expected_energy(scene: Scene, law: Law, truth: Truth, time: float, start: Trajectory) -> float | None:
    """Energy the law leaves at `time` [J]: the truth's, or that of the run's `start` where nothing dissipates."""
    end = truth.state(time)
    if end is None:
        contacts = [scene.contact, *(contact for _, _, contact in scene.pairs)]
        lossless = all(c.bounciness == 1 and (c.friction if law == "nc" else c.viscosity) == 0 for c in contacts)
        return float(conservation.energies(scene, start)[0]) if lossless else None
    turning = start.spins is not None and end.spins is not None and end.orientations is not None
    snapshot = Trajectory(
        np.array([time]),
        end.positions[None],
        end.velocities[None],
        end.orientations[None] if turning and end.orientations is not None else None,
        end.spins[None] if turning and end.spins is not None else None,
    )
    return float(conservation.energies(scene, snapshot)[0])


def _at(trajectory: Trajectory, index: int) -> Trajectory:
    pick = slice(index, index + 1)
    return replace(
        trajectory,
        times=trajectory.times[pick],
        positions=trajectory.positions[pick],
        velocities=trajectory.velocities[pick],
        orientations=None if trajectory.orientations is None else trajectory.orientations[pick],
        spins=None if trajectory.spins is None else trajectory.spins[pick],
    )


def _at_impacts(
    scene: Scene, law: Law, truth: Truth, trajectory: Trajectory, impacts: list[Impact], delay: float
) -> Iterator[Figure]:
    if not impacts:
        return
    step = float(trajectory.times[1] - trajectory.times[0])
    yield Figure("impact_velocity_error", max(impact_error(scene, law, impact, step) for impact in impacts))
    if not any(scene.gravity):
        # Under gravity the samples straddle a step's worth of it: e is measured without (METHOD).
        first = impacts[0]
        measured = restitution(first)
        yield Figure("restitution_measured", measured)
        yield Figure("restitution_error", measured - scene.contact_of(first.a, first.b).bounciness)
    if truth.impact_times and impacts[0].earliest:
        yield Figure("impact_time_error", impacts[0].time - delay - truth.impact_times[0])


def _penetration(scene: Scene, pairs: list[PairHistory], trajectory: Trajectory) -> Iterator[Figure]:
    """Deepest overlap of any pair over all steps, its root mean square over time, and the overlap left at the end."""
    if not pairs:
        return
    gaps = np.array([pair.gap for pair in pairs])
    depth = np.maximum(-gaps.min(axis=0), 0.0) / scene.length
    deepest = int(depth.argmax())
    pair = pairs[int(gaps[:, deepest].argmin())]
    bodies = (scene.bodies[pair.a].name, scene.bodies[pair.b].name)
    yield Figure("penetration_max", float(depth[deepest]), float(trajectory.times[deepest]), bodies)
    yield Figure("penetration_rms", float(np.sqrt(np.mean(depth**2))))
    yield Figure("penetration_final", float(depth[-1]))


AGREEMENT = 0.01
"""Two runs agree while they differ by less than this part of the scene's length."""


def self_consistency(scene: Scene, run: Trajectory, finer: Trajectory) -> list[Figure]:
    """How far a run is from the same engine's at half the step, and the part of the duration up to which they agree.

    It needs no truth, and cannot see a model that is wrong at every step alike.
    """
    if not finer.finite():
        return [Figure("self_error", math.inf)]
    distances = np.linalg.norm(run.positions - finer.positions, axis=2).max(axis=1) / scene.length
    apart = np.flatnonzero(distances > AGREEMENT)
    horizon = float(run.times[apart[0]] / run.times[-1]) if len(apart) else 1.0
    return [Figure("self_error", float(distances.max())), Figure("self_horizon", horizon)]


def law_difference(case: Case) -> list[Figure]:
    """Distance between the two truths at the end of the run: a property of the laws, no contestant's error."""
    if not {"doc", "nc"} <= set(case.truths):
        return []
    scene = case.scene
    doc, newton = case.truths["doc"].state(scene.duration), case.truths["nc"].state(scene.duration)
    if doc is None or newton is None:
        return []
    return [
        Figure("position_difference", _largest(doc.positions - newton.positions) / scene.length),
        Figure("velocity_difference", _largest(doc.velocities - newton.velocities) / scene.speed),
    ]
