"""Impacts, found in a trajectory and judged by the law of the run with their own measured pre-impact velocity and
normal.

An impact is an episode of consecutive steps in which the relative velocity of one pair jumps, begun while the bodies
approach. Where it lies inside its step follows from the displacement: a body that moves with its old velocity for the
fraction `alpha` of the step and with its new one for the rest travels h (alpha v + (1 - alpha) v'). So alpha is 0
for an engine that turns velocities round and then moves, 1 for one that moves first, and the true fraction for an
event-driven run: one rule for all contestants.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from impactbench.reports.geometry import Placed, gap, placed_bodies
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Flags, Floats, Trajectory

# Ten thousand round-offs of the speed scale: below any impact that matters, above what sums of forces leave behind.
JUMP = 1e-12


@dataclass(frozen=True, eq=False)
class PairHistory:
    """One pair over time: scene indices, gap [T], normal from a to b [T, 3], relative velocity u = v_b - v_a [T,
    3].
    """

    a: int
    b: int
    gap: Floats
    normal: Floats
    relative: Floats


@dataclass(frozen=True, eq=False)
class Impact:
    """One isolated impact of a pair: time [s], unit normal, relative velocity before and after [m/s].

    alpha: its place in its step; earliest: nothing in the scene touched before.
    """

    a: int
    b: int
    time: float
    normal: Floats
    before: Floats
    after: Floats
    alpha: float
    last_step: int
    earliest: bool


def pair_histories(scene: Scene, trajectory: Trajectory) -> list[PairHistory]:
    """Every pair that can meet (never two statics, R2), with its gap from geometry."""
    if not scene.collide:
        return []
    bodies = placed_bodies(scene, trajectory)
    velocities = dict(zip(scene.movable, np.moveaxis(trajectory.velocities, 1, 0), strict=True))
    rest = np.zeros((len(trajectory.times), 3))

    def history(a: int, b: int) -> PairHistory:
        distance, normal = gap(bodies[a], bodies[b])
        return PairHistory(a, b, distance, normal, velocities.get(b, rest) - velocities.get(a, rest))

    pairs = [(a, b) for n, a in enumerate(scene.movable) for b in scene.movable[n + 1 :]]
    pairs += [(a, b) for a in scene.statics for b in scene.movable]
    return [history(a, b) for a, b in pairs]


def find_impacts(scene: Scene, trajectory: Trajectory, pairs: list[PairHistory]) -> list[Impact]:
    """Isolated impacts in order of time. One that shares a body with another active contact has no outcome of its
    own: left out.
    """
    if len(trajectory.times) < 2:
        return []
    steps = np.diff(trajectory.times)
    gravity = np.array(scene.gravity)
    weight = float(np.linalg.norm(gravity))
    active = [active_steps(scene, pair, steps, gravity) for pair in pairs]
    busy = {index: np.zeros(len(steps), dtype=np.int64) for index in range(len(scene.bodies))}
    for pair, flags in zip(pairs, active, strict=True):
        for index in (pair.a, pair.b):
            busy[index] += flags
    # Free flight first: the integrator's own share of a displacement must not be read as an impact's place in the step.
    flight = flight_fraction(scene, trajectory)
    first_touch = min((int(np.argmax(flags)) for flags in active if flags.any()), default=0)
    found = []
    for pair, flags in zip(pairs, active, strict=True):
        movable = [index for index in (pair.a, pair.b) if not scene.bodies[index].static]
        for first, last in episodes(flags):
            closing = -float(pair.relative[first] @ pair.normal[first])
            alone = all((busy[index][first : last + 1] == 1).all() for index in movable)
            settled = last + 1 < len(steps) or first == last
            if alone and settled and closing > 2 * weight * steps[first]:
                alpha = _fraction(scene, trajectory, pair, first, flight) if first == last else 0.0
                normal = _normal_at(scene, trajectory, pair, first, alpha)
                time = float(trajectory.times[first] + alpha * steps[first])
                before, after = pair.relative[first], pair.relative[last + 1]
                found.append(Impact(pair.a, pair.b, time, normal, before, after, alpha, last, first == first_touch))
    return sorted(found, key=lambda impact: impact.time)


def active_steps(scene: Scene, pair: PairHistory, steps: Floats, gravity: Floats) -> Flags:
    """Steps in which the relative velocity changes along the normal by more than gravity does, while the pair is
    near contact.
    """
    fall = np.zeros(3) if not (scene.bodies[pair.a].static or scene.bodies[pair.b].static) else gravity
    change = np.diff(pair.relative, axis=0) - fall * steps[:, None]
    kick = np.abs(np.einsum("ti,ti->t", change, pair.normal[:-1]))
    speeds = np.linalg.norm(pair.relative, axis=1)
    reach = 2 * np.maximum(speeds[:-1], speeds[1:]) * steps + 1e-3 * scene.length
    near = np.minimum(pair.gap[:-1], pair.gap[1:]) <= reach
    return np.asarray(near & (kick > JUMP * scene.speed + 1e-9 * np.abs(fall).sum() * steps))


def episodes(flags: Flags) -> Iterator[tuple[int, int]]:
    """First and last step of every run of set flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    yield from ((int(start), int(stop) - 1) for start, stop in edges.reshape(-1, 2))


def flight_fraction(scene: Scene, trajectory: Trajectory) -> float:
    """Fraction of a step that free flight spends with the old velocity: 0 velocity first, 1 position first.

    1/2 is a parabola. Measured from the steps in which a velocity changed by g h alone; 1/2 where there is none.
    """
    gravity = np.array(scene.gravity)
    weight2 = float(gravity @ gravity)
    steps = np.diff(trajectory.times)
    if weight2 == 0 or len(steps) == 0:
        return 0.5
    fall = gravity * steps[:, None]
    change = np.diff(trajectory.velocities, axis=0)
    free = np.linalg.norm(change - fall[:, None], axis=2) <= 1e-6 * np.linalg.norm(fall, axis=1)[:, None]
    lag = np.diff(trajectory.positions, axis=0) / steps[:, None, None] - trajectory.velocities[1:]
    late = lag @ gravity / (-weight2 * steps[:, None])
    return float(np.median(late[free])) if free.any() else 0.5


def _fraction(scene: Scene, trajectory: Trajectory, pair: PairHistory, k: int, flight: float) -> float:
    """Fraction of the step before the impact, from the displacement of the body whose velocity jumped most.

    With old and new velocity v and v', and the fraction f of free flight,
    x' - x = tau v + (h - tau) v' + (tau - f h) g h.
    """
    step = float(trajectory.times[k + 1] - trajectory.times[k])
    fall = np.array(scene.gravity) * step
    rows = [scene.movable.index(index) for index in (pair.a, pair.b) if not scene.bodies[index].static]
    jumps = [trajectory.velocities[k, row] - trajectory.velocities[k + 1, row] + fall for row in rows]
    row, jump = max(zip(rows, jumps, strict=True), key=lambda item: float(item[1] @ item[1]))
    moved = (trajectory.positions[k + 1, row] - trajectory.positions[k, row]) / step - trajectory.velocities[k + 1, row]
    return float(np.clip((moved + flight * fall) @ jump / (jump @ jump), 0.0, 1.0))


def _normal_at(scene: Scene, trajectory: Trajectory, pair: PairHistory, k: int, alpha: float) -> Floats:
    """Contact normal where the bodies were at the fraction alpha of the step, moving with their old velocities."""
    step = trajectory.times[k + 1] - trajectory.times[k]

    def placed(index: int) -> Placed:
        body = scene.bodies[index]
        turn = np.array([body.orientation])
        if body.static:
            return Placed(body.shape, np.array([body.position]), turn)
        row = scene.movable.index(index)
        if trajectory.orientations is not None:
            turn = trajectory.orientations[k : k + 1, row]
        return Placed(
            body.shape,
            trajectory.positions[k : k + 1, row] + alpha * step * trajectory.velocities[k : k + 1, row],
            turn,
        )

    normal: Floats = gap(placed(pair.a), placed(pair.b))[1][0]
    return normal


def expected_relative(law: Law, bounciness: float, normal: Floats, before: Floats) -> Floats:
    """Relative velocity [m/s] after an impact of particles.

    doc: u' = b (u - 2 (u . n) n)      (documents, rule R9, consequence 2)
    nc:  u' = u - (1 + e) (u . n) n    (Newton restitution on the normal, no friction)
    """
    closing = before @ normal
    if law == "doc":
        return np.asarray(bounciness * (before - 2 * closing * normal))
    return np.asarray(before - (1 + bounciness) * closing * normal)


def impact_error(scene: Scene, law: Law, impact: Impact, step: float) -> float:
    """Largest relative-velocity error just after the impact, as a fraction of the speed before it.

    With friction only the normal component is judged. Against a static, velocity samples straddle this step's
    gravity: of the readings (gravity before, at or after the impact) the kindest counts, so that what is left is the
    impact's own.
    """
    contact = scene.contact_of(impact.a, impact.b)
    alone = scene.bodies[impact.a].static or scene.bodies[impact.b].static
    drop = np.array(scene.gravity) * step if alone else np.zeros(3)
    scale = float(np.linalg.norm(impact.before))
    frictional = law == "nc" and contact.friction > 0

    def error(before_shift: float, after_shift: float) -> float:
        before, after = impact.before + before_shift * drop, impact.after - after_shift * drop
        miss = after - expected_relative(law, contact.bounciness, impact.normal, before)
        return abs(float(miss @ impact.normal)) if frictional else float(np.linalg.norm(miss))

    return min(error(x, y) for x, y in product((0.0, 1.0, impact.alpha), (0.0, 1.0, 1 - impact.alpha))) / scale


def restitution(impact: Impact) -> float:
    """Measured e = -(u' . n)/(u . n)."""
    return float(-(impact.after @ impact.normal) / (impact.before @ impact.normal))
