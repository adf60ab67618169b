"""One run as a replay shows it: motion, contacts, what is conserved over time, and the instants worth jumping to.

Runs inside a child process. Everything is computed from the full-resolution trajectory by the report's own measures;
only what is drawn is thinned, each drawn value of a series being the largest of its interval, so that no extreme is
lost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports import conservation
from impactbench.reports.cell import Cell, build, case_of, record, step_count
from impactbench.reports.geometry import Placed, placed_bodies
from impactbench.reports.impacts import PairHistory, active_steps, episodes, find_impacts, pair_histories
from impactbench.reports.measures import expected_energy
from impactbench.scenarios.records import Box, Capsule, Law, Scene, Sphere
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Truth

LIMIT = 0.01
"""What "violation" means: 1 % of the scene's own scale, the report's default target."""
MOST_GAPS = 400_000
"""Gaps of pairs over all steps of a recorded run, a second's work; beyond it contacts and penetration are left out."""
MOST_CONTACTS = 300
LEVELS = (0.001, 0.01, 0.1)
"""Position errors, in the scene's lengths, at which a body's colour and hatching change."""
ABSURD = 1e60
"""Fourth powers of it are finite: lengths of products, as in angular momentum."""
SERIES = ("position_error", "energy", "momentum", "angular_momentum", "penetration")


@dataclass(frozen=True, eq=False)
class Timeline:
    """What is measured at every step, shape [T]; None where it has no meaning in the scene.

    distances: of each body from the truth, in lengths [T, n], not-a-number where nothing is known; energy: change since
    the start; gain: above the lowest so far; all as parts of the scene's own scales.
    """

    distances: Floats
    energy: Floats
    gain: Floats
    momentum: Floats
    angular_momentum: Floats | None
    penetration: Floats | None
    deepest: PairHistory | None

    def position_error(self) -> Floats:
        """Largest distance of any body, shape [T]."""
        return np.asarray(self.distances.max(axis=1))


def record_run(argument: tuple[Cell, Contestant, int]) -> dict[str, Any]:
    """Everything a replay holds of one run, drawn at every `every`-th step; arrays are still in metres."""
    cell, contestant, every = argument
    engine = build(cell, contestant)
    try:
        case = case_of(cell)
        trajectory = record(engine, cell.step_seconds, step_count(case.scene, cell.step_seconds))
    finally:
        engine.close()
    with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges overflows before it is not finite
        return described(case, cell.law, finite_part(trajectory), every)


def finite_part(trajectory: Trajectory) -> Trajectory:
    """The run up to its first value that is not finite, or so large that measures of it are not."""
    arrays = [trajectory.positions, trajectory.velocities, trajectory.orientations, trajectory.spins]
    fine = np.all([(np.abs(a) < ABSURD).all(axis=(1, 2)) for a in arrays if a is not None], axis=0)
    count = len(fine) if fine.all() else max(1, int(np.argmin(fine)))
    position, velocity, turn, spin = (None if a is None else a[:count] for a in arrays)
    assert position is not None
    assert velocity is not None
    return Trajectory(trajectory.times[:count], position, velocity, turn, spin)


def described(case: Case, law: Law, trajectory: Trajectory, every: int) -> dict[str, Any]:
    """The recorded run of a finite trajectory."""
    scene, truth = case.scene, case.truths[law]
    pairs = pair_histories(scene, trajectory) if affordable(scene, len(trajectory.times)) else []
    line = timeline(scene, law, truth, trajectory, pairs)
    touching = contacts(scene, trajectory, pairs)
    last = len(trajectory.times) - 1
    expected = expected_energy(scene, law, truth, float(trajectory.times[last]), start_of(scene))
    columns = {
        "position_error": line.position_error(),
        "energy": line.energy,
        "momentum": line.momentum,
        "angular_momentum": line.angular_momentum,
        "penetration": line.penetration,
    }
    unknown = np.full(last + 1, np.nan)
    return {
        "positions": trajectory.positions[::every],
        "orientations": None if trajectory.orientations is None else trajectory.orientations[::every],
        "levels": levels(line.distances[::every]),
        "series": {n: largest_of(unknown if c is None else c, every) for n, c in columns.items()},
        "contacts": touching[:MOST_CONTACTS],
        "contact_count": len(touching) if pairs or not scene.collide else None,
        "events": events(scene, trajectory, line, touching),
        "summary": {
            **{name: peak(column) for name, column in columns.items() if name != "energy"},
            "energy_gain": peak(line.gain),
            "energy_drift": None if expected is None else drift(scene, line, expected),
        },
    }


def affordable(scene: Scene, count: int) -> bool:
    """Whether the gaps of all pairs at all steps can be computed in about a second."""
    movable = len(scene.movable)
    return (movable * (movable - 1) // 2 + movable * len(scene.statics)) * count <= MOST_GAPS


def start_of(scene: Scene) -> Trajectory:
    """The scene's own start as a run of one instant."""
    bodies = [scene.bodies[i] for i in scene.movable]
    place, speed = np.array([[b.position for b in bodies]]), np.array([[b.velocity for b in bodies]])
    if not scene.model.rotation:
        return Trajectory(np.zeros(1), place, speed)
    turn, spin = np.array([[b.orientation for b in bodies]]), np.array([[b.spin for b in bodies]])
    return Trajectory(np.zeros(1), place, speed, turn, spin)


def timeline(scene: Scene, law: Law, truth: Truth, trajectory: Trajectory, pairs: list[PairHistory]) -> Timeline:
    """Measures over time, by the code that the tables' figures come from."""
    impacts = [] if scene.model.rotation else find_impacts(scene, trajectory, pairs)
    matched = conservation.energies(scene, trajectory) + conservation.matched_offset(scene, trajectory)
    depth, deepest = None, None
    if pairs:
        gaps = np.array([pair.gap for pair in pairs])
        depth = np.maximum(-gaps.min(axis=0), 0.0) / scene.length
        deepest = pairs[int(gaps.min(axis=1).argmin())]
    return Timeline(
        distances(scene, truth, trajectory),
        (matched - matched[0]) / scene.energy,
        (matched - np.minimum.accumulate(matched)) / scene.energy,
        conservation.momentum_drifts(scene, law, trajectory, pairs),
        conservation.angular_momentum_drifts(scene, law, trajectory, impacts),
        depth,
        deepest,
    )


def distances(scene: Scene, truth: Truth, trajectory: Trajectory) -> Floats:
    """Distance of each body from the truth, in the scene's lengths [T, n]."""
    found = np.full(trajectory.positions.shape[:2], np.nan)
    for k, time in enumerate(trajectory.times):
        state = truth.state(float(time))
        if state is not None:
            found[k] = np.linalg.norm(trajectory.positions[k] - state.positions, axis=1) / scene.length
    return found


def peak(column: Floats | None) -> float | None:
    """Largest value; None where nothing is known."""
    if column is None or np.isnan(column).all():
        return None
    return float(np.nanmax(column))


def drift(scene: Scene, line: Timeline, expected: float) -> float:
    """Energy at the end less what the law leaves, as a part of the scene's energy."""
    start = float(conservation.energies(scene, start_of(scene))[0])
    return float(line.energy[-1]) - (expected - start) / scene.energy


def levels(distance: Floats) -> Floats:
    """0 where no truth is known, else 1 ... 4 by `LEVELS`; shape as given."""
    return np.where(np.isnan(distance), 0, 1 + np.searchsorted(LEVELS, np.nan_to_num(distance)))


def largest_of(column: Floats, every: int) -> Floats:
    """At each drawn step the value of largest size since the one before."""
    size = np.where(np.isnan(column), -1.0, np.abs(column))
    starts = np.concatenate([[0], np.arange(every, len(column), every) - every + 1])
    stops = np.arange(0, len(column), every) + 1
    return np.array([column[a + int(size[a:b].argmax())] for a, b in zip(starts, stops, strict=True)])


def contacts(scene: Scene, trajectory: Trajectory, pairs: list[PairHistory]) -> list[list[float | int]]:
    """Contacts by start: [start s, end s, body a, body b, body the mark is on, offset of the mark from its centre m].

    The offset turns with the body, save on a ball: what a ball touches stays where it is while the ball rolls on.
    A pair touches where its gap is at most a thousandth of the scene's length, or where its relative velocity jumped
    in the step before: an impact may lie between two samples.
    """
    steps, gravity = np.diff(trajectory.times), np.array(scene.gravity)
    bodies = placed_bodies(scene, trajectory) if pairs else []
    found: list[list[float | int]] = []
    for pair in pairs:
        touching = pair.gap <= 1e-3 * scene.length
        if len(steps):
            touching[1:] |= active_steps(scene, pair, steps, gravity)
        for first, last in episodes(touching):
            on, sign = (pair.a, 1) if _rounder(scene, pair) else (pair.b, -1)
            offset = towards(bodies[on], first, sign * pair.normal[first])
            if not isinstance(scene.bodies[on].shape, Sphere):
                axes = bodies[on].axes
                offset = axes[first if len(axes) > 1 else 0].T @ offset
            ends = [round(float(trajectory.times[k]), 6) for k in (first, last)]
            found.append([*ends, pair.a, pair.b, on, *(float(f"{x:.4g}") for x in offset)])
    return sorted(found)


def _rounder(scene: Scene, pair: PairHistory) -> bool:
    """Whether the first body is a movable ball and the second is not: its surface point is where they touch."""
    a, b = scene.bodies[pair.a], scene.bodies[pair.b]
    return isinstance(a.shape, Sphere) and not a.static and not isinstance(b.shape, Sphere)


def towards(body: Placed, step: int, direction: Floats) -> Floats:
    """From the centre to the middle of what lies farthest in a direction [m]."""
    match body.shape:
        case Sphere(radius):
            return np.asarray(radius * direction)
        case Box(half):
            spread, radius = body.corners() - body.positions, min(half)
        case Capsule(radius, _):
            spread = body.core()[0] - body.positions
        case _:
            return np.zeros(3)
    points = spread[:, step]
    reach = points @ direction
    middle = points[reach >= reach.max() - 1e-2 * radius].mean(axis=0)
    return np.asarray(middle + radius * direction) if isinstance(body.shape, Capsule) else middle


def events(
    scene: Scene, trajectory: Trajectory, line: Timeline, touching: list[list[float | int]]
) -> dict[str, dict[str, Any] | None]:
    """The instants to jump to: first contact, first violation, largest error; each with what, how much and who."""
    columns = {
        "position_error": line.position_error(),
        "energy_gain": line.gain,
        "penetration": line.penetration,
        "momentum_drift": line.momentum,
        "angular_momentum_drift": line.angular_momentum,
    }
    known = {name: np.nan_to_num(c, nan=0.0) for name, c in columns.items() if c is not None}
    over = {name: int(np.argmax(c > LIMIT)) for name, c in known.items() if (c > LIMIT).any()}
    first = min(over, key=lambda name: over[name], default=None)
    judged = "position_error" if known["position_error"].any() else max(known, key=lambda name: known[name].max())
    worst = int(known[judged].argmax())

    def event(name: str, step: int) -> dict[str, Any]:
        value = float(known[name][step])
        who = bodies_of(scene, line, name, step)
        return {"time": round(float(trajectory.times[step]), 9), "what": name, "value": value, "bodies": who}

    contact = touching[0] if touching else None
    pair = [scene.bodies[int(contact[k])].name for k in (2, 3)] if contact else []
    return {
        "first_contact": {"time": contact[0], "what": "contact", "value": None, "bodies": pair} if contact else None,
        "first_violation": event(first, over[first]) | {"peak": float(known[first].max())} if first else None,
        "largest_error": event(judged, worst) if known[judged][worst] > 0 else None,
    }


def bodies_of(scene: Scene, line: Timeline, name: str, step: int) -> list[str]:
    """Names of the bodies a figure is about; none where it is about all."""
    if name == "position_error":
        return [scene.bodies[scene.movable[int(line.distances[step].argmax())]].name]
    if name == "penetration" and line.deepest:
        return [scene.bodies[line.deepest.a].name, scene.bodies[line.deepest.b].name]
    return []
