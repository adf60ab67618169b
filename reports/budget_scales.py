"""What a case's own truth says of the sizes that budgets are made of: speeds at impacts, weight, lasting contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from impactbench.reports.impacts import PairHistory, pair_histories
from impactbench.scenarios.records import Law, Scene, Sphere
from impactbench.scenarios.trajectory import Floats, State, Trajectory
from impactbench.scenarios.truth import Case, Truth

JUST_BEFORE = 1e-9
"""An impact is looked at this part of the duration before and after its instant."""
SAMPLES = 24
TOUCHING = 1e-6
"""Gap, next to the scene's length, up to which a pair that the truth puts in contact counts as the one that meets."""


@dataclass(frozen=True)
class Scales:
    """Sizes of a case under one law, from its truth; where it gives no states, from the scene's own scales.

    impacts:  how many impacts the truth holds before the end; 0 where none is known.
    closing:  fastest approach along the normal of any impact [m/s].
    jumps:    sum over the impacts of the largest change of a body's velocity [m/s].
    fastest:  fastest body at any time [m/s].
    sheared:  largest mu_r |u_n| |u_t| of an impact between movable bodies [kg m^2/s^2].
    angular:  sum of m |r| |v| about the common centre at the start [kg m^2/s], the least that drift is relative to.
    weight:   sum of m |g| [N].
    falling:  largest speed along gravity at an impact [m/s].
    power:    largest |sum of m g . v| at any time [W].
    turned:   sum over the impacts of movable balls of the velocity [m/s] that a normal found late changes, per second
              late, times the seconds that are left: (1 + e) mu_r/m |u| |u_t| (T - t)/(R_A + R_B) [m/s].
    lossy:    sum over the same of the energy that it changes, (1 - e^2) mu_r |u_n| u_t^2/(R_A + R_B) [J/s].
    lasting:  bodies touch at the start, or end at rest upon one another: contact lasts.
    """

    impacts: int
    closing: float
    jumps: float
    fastest: float
    sheared: float
    angular: float
    weight: float
    falling: float
    power: float
    turned: float
    lossy: float
    lasting: bool


@cache
def scales_of(case: Case, law: Law) -> Scales:
    truth = case.truths[law]
    return _from_truth(case.scene, truth) if truth.kind == "trajectory" else _from_scene(case.scene, truth)


def _from_scene(scene: Scene, truth: Truth) -> Scales:
    """An end state, an invariant or a scene file: nothing is known but the scene's own scales."""
    mass, weight = _masses(scene), _weight(scene)
    return Scales(
        impacts=0,
        closing=scene.speed,
        jumps=2 * scene.speed,
        fastest=scene.speed,
        sheared=_reduced(mass) * scene.speed**2 / 2 if scene.model.dimension > 1 else 0.0,
        angular=_angular(mass, _opening(scene)),
        weight=weight,
        falling=scene.speed if weight else 0.0,
        power=weight * scene.speed,
        turned=0.0,
        lossy=0.0,
        lasting=not scene.phase_free or truth.kind == "end state",
    )


def _from_truth(scene: Scene, truth: Truth) -> Scales:
    mass, weight, gravity = _masses(scene), _weight(scene), np.array(scene.gravity)
    start, tiny = _opening(scene), JUST_BEFORE * scene.duration
    times = [t for t in truth.impact_times if 0 < t < scene.duration]
    before = _known(truth, [max(t - tiny, 0.0) for t in times])
    after = _known(truth, [t + tiny for t in times])
    samples = [start, *before, *after, *_known(truth, np.linspace(0.0, scene.duration, SAMPLES + 1).tolist())]
    speeds = np.array([state.velocities for state in samples])
    jumped = [np.linalg.norm(b.velocities - a.velocities, axis=1).max() for a, b in zip(before, after, strict=True)]
    falls = [np.abs(state.velocities @ gravity).max() * mass.sum() / weight for state in before] if weight else []
    meetings = _meetings(scene, before, times)
    return Scales(
        impacts=len(times),
        closing=max((m.closing for m in meetings), default=0.0),
        jumps=float(sum(jumped)),
        fastest=float(np.linalg.norm(speeds, axis=2).max()),
        sheared=max((m.reduced * m.closing * m.across for m in meetings), default=0.0),
        angular=_angular(mass, start),
        weight=weight,
        falling=float(max(falls, default=0.0)),
        power=float(np.abs(np.einsum("n,tni,i->t", mass, speeds, gravity)).max()),
        turned=sum(m.turned for m in meetings),
        lossy=sum(m.lossy for m in meetings),
        lasting=not scene.phase_free,
    )


def _masses(scene: Scene) -> Floats:
    return np.array([scene.bodies[i].mass for i in scene.movable], dtype=float)


def _weight(scene: Scene) -> float:
    return float(_masses(scene).sum() * np.linalg.norm(scene.gravity))


def _opening(scene: Scene) -> State:
    bodies = [scene.bodies[i] for i in scene.movable]
    return State(np.array([b.position for b in bodies], float), np.array([b.velocity for b in bodies], float))


def _known(truth: Truth, times: Sequence[float]) -> list[State]:
    return [state for t in times if (state := truth.state(t)) is not None]


@dataclass(frozen=True)
class Meeting:
    """One pair at one impact: |u_n| and |u_t| [m/s], mu_r [kg] (0 with a static) and what a late normal changes."""

    closing: float
    across: float
    reduced: float
    turned: float
    lossy: float


def _meetings(scene: Scene, before: list[State], times: Sequence[float]) -> list[Meeting]:
    if not before:
        return []
    pairs = pair_histories(scene, _stacked(before))
    return [
        meeting
        for pair in pairs
        for k, time in enumerate(times)
        if (meeting := _meeting(scene, pair, k, scene.duration - time))
    ]


def _meeting(scene: Scene, pair: PairHistory, k: int, left: float) -> Meeting | None:
    along = float(pair.relative[k] @ pair.normal[k])
    reach = TOUCHING * scene.length + 2 * JUST_BEFORE * scene.duration * abs(along)
    if along >= 0 or pair.gap[k] > reach:
        return None
    a, b = scene.bodies[pair.a], scene.bodies[pair.b]
    across = float(np.linalg.norm(pair.relative[k] - along * pair.normal[k]))
    if a.mass is None or b.mass is None:
        return Meeting(-along, across, 0.0, 0.0, 0.0)
    reduced = a.mass * b.mass / (a.mass + b.mass)
    radii = [body.shape.radius for body in (a, b) if isinstance(body.shape, Sphere)]
    rate = across / sum(radii) if len(radii) == 2 else 0.0  # rad/s: a line of centres turns, a face's normal does not
    e = scene.contact_of(pair.a, pair.b).bounciness
    speed = float(np.linalg.norm(pair.relative[k]))
    turned = (1 + e) * reduced / min(a.mass, b.mass) * speed * rate * left
    return Meeting(-along, across, reduced, turned, (1 - e**2) * reduced * -along * across * rate)


def _stacked(states: list[State]) -> Trajectory:
    turning = all(state.orientations is not None and state.spins is not None for state in states)
    return Trajectory(
        np.arange(len(states), dtype=float),
        np.array([state.positions for state in states]),
        np.array([state.velocities for state in states]),
        np.array([state.orientations for state in states]) if turning else None,
        np.array([state.spins for state in states]) if turning else None,
    )


def _reduced(mass: Floats) -> float:
    """Largest reduced mass of two of the bodies [kg]."""
    heavy = np.sort(mass)[-2:]
    return float(heavy.prod() / heavy.sum()) if len(heavy) == 2 else 0.0


def _angular(mass: Floats, state: State) -> float:
    arms = state.positions - mass @ state.positions / mass.sum()
    speeds = state.velocities - mass @ state.velocities / mass.sum()
    return float(mass @ (np.linalg.norm(arms, axis=1) * np.linalg.norm(speeds, axis=1)))
