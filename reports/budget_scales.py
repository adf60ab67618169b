"""What a case's own truth says of the sizes that budgets are made of: speeds at impacts, weight, lasting contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from impactbench.reports.impacts import PairHistory, pair_histories
from impactbench.scenarios.records import Law, Scene
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
    lasting: bool


@cache
def scales_of(case: Case, law: Law) -> Scales:
    scene, truth = case.scene, case.truths[law]
    mass = np.array([scene.bodies[i].mass for i in scene.movable], dtype=float)
    gravity = np.array(scene.gravity)
    weight = float(mass.sum() * np.linalg.norm(gravity))
    start = _opening(scene)
    lasting = not scene.phase_free or truth.kind == "end state"
    known = truth.kind == "trajectory"
    hits = [t for t in truth.impact_times if 0 < t < scene.duration] if known else []
    tiny = JUST_BEFORE * scene.duration
    before = [state for t in hits if (state := truth.state(max(t - tiny, 0.0))) is not None]
    after = [state for t in hits if (state := truth.state(t + tiny)) is not None]
    samples = [start, *before, *after, *(_sampled(truth, scene.duration) if known else [])]
    speeds = np.array([state.velocities for state in samples])
    closing, sheared = _approaches(scene, before)
    if not known:  # an end state, an invariant or a scene file: nothing but the scene's own scales
        closing, sheared = scene.speed, _reduced(mass) * scene.speed**2 / 2
    downward = gravity / np.linalg.norm(gravity) if weight else gravity
    jumped = [
        float(np.linalg.norm(b.velocities - a.velocities, axis=1).max()) for a, b in zip(before, after, strict=True)
    ]
    falls = [float(np.abs(state.velocities @ downward).max()) for state in before]
    power = float(np.abs(np.einsum("n,tni,i->t", mass, speeds, gravity)).max())
    return Scales(
        impacts=len(hits),
        closing=closing,
        jumps=sum(jumped) if known else 2 * scene.speed,
        fastest=float(np.linalg.norm(speeds, axis=2).max()) if known else scene.speed,
        sheared=sheared,
        angular=_angular(mass, start),
        weight=weight,
        falling=max(falls, default=0.0) if known else scene.speed,
        power=power if known else weight * scene.speed,
        lasting=lasting,
    )


def _opening(scene: Scene) -> State:
    bodies = [scene.bodies[i] for i in scene.movable]
    return State(np.array([b.position for b in bodies], float), np.array([b.velocity for b in bodies], float))


def _sampled(truth: Truth, duration: float) -> list[State]:
    states = (truth.state(float(t)) for t in np.linspace(0.0, duration, SAMPLES + 1))
    return [state for state in states if state is not None]


def _approaches(scene: Scene, before: list[State]) -> tuple[float, float]:
    """Fastest |u_n| [m/s] and largest mu_r |u_n| |u_t| [kg m^2/s^2] of the pairs in contact at the impacts."""
    if not before:
        return 0.0, 0.0
    pairs = pair_histories(scene, _stacked(before))
    found = [_approach(scene, pair) for pair in pairs]
    return max((u for u, _ in found), default=0.0), max((s for _, s in found), default=0.0)


def _approach(scene: Scene, pair: PairHistory) -> tuple[float, float]:
    along = np.einsum("ti,ti->t", pair.relative, pair.normal)
    across = np.linalg.norm(pair.relative - along[:, None] * pair.normal, axis=1)
    meets = (pair.gap <= TOUCHING * scene.length + 2 * JUST_BEFORE * scene.duration * np.abs(along)) & (along < 0)
    masses = [scene.bodies[i].mass for i in (pair.a, pair.b)]
    reduced = 0.0 if None in masses else 1 / sum(1 / (m or math.inf) for m in masses)
    closing = np.where(meets, -along, 0.0)
    return float(closing.max()), float((reduced * closing * across).max())


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
