"""What every engine needs to know of a scene: who can meet, which recipe it calls for, what its surfaces must carry.

Scenes give coefficients per pair in contact. PyBullet and pymunk know them per surface only and multiply the two that
meet; `surface_factors` finds such surfaces or says that there are none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from itertools import combinations
from typing import Literal

from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Contact, HalfSpace, Law, Model, Scene

Pair = tuple[int, int]
Need = Literal["impacts", "sliding", "resting"]
ROUND_OFF = 1e-12
"""Relative, for products of coefficients around a cycle and for directions: a few hundred ulps."""


def moving_axes(scene: Scene, model: Model) -> tuple[int, ...]:
    """Axes along which the engine must let bodies move.

    Coulomb friction needs the normal force, and an engine knows normal forces only along axes that can move: where
    friction acts, the axes of gravity join the model's. The planar truth is unchanged, since they rest on something.
    """
    axes = set(model.axes)
    if model.gravity and model.friction:
        axes |= {k for k in range(3) if scene.gravity[k]}
    return tuple(sorted(axes))


def gravity_of(scene: Scene, model: Model) -> tuple[float, float, float]:
    return scene.gravity if model.gravity else (0.0, 0.0, 0.0)


def can_meet(scene: Scene, axes: tuple[int, ...]) -> list[Pair]:
    """Pairs (a < b) whose contact could change a motion along `axes`: never two statics or a plane along them all."""
    if not scene.collide:
        return []
    idle = {i for i in scene.statics if _aside(scene.bodies[i].shape, axes)}
    statics = set(scene.statics)
    active = [i for i in range(len(scene.bodies)) if i not in idle]
    return [(a, b) for a, b in combinations(active, 2) if not (a in statics and b in statics)]


def _aside(shape: object, axes: tuple[int, ...]) -> bool:
    return isinstance(shape, HalfSpace) and all(abs(shape.normal[k]) <= ROUND_OFF for k in axes)


def distinct_contacts(scene: Scene, pairs: Iterable[Pair]) -> set[Contact]:
    """The different coefficients that occur; cheap for many bodies that are all alike."""
    pairs = list(pairs)
    if not scene.pairs:
        return {scene.contact} if pairs else set()
    return {scene.contact_of(a, b) for a, b in pairs}


def need(scene: Scene, model: Model, contacts: set[Contact]) -> Need:
    """Which recipe a scene calls for.

    sliding: Coulomb friction in a contact that lasts from the start; resting: inelastic bodies under gravity (piles).
    A pile that starts at rest is resting even with friction; a single body at rest may be on an incline: sliding.
    """
    heavy = any(gravity_of(scene, model))
    rough = model.friction and any(c.friction > 0 for c in contacts)
    moving = any(any(scene.bodies[i].velocity) or any(scene.bodies[i].spin) for i in scene.movable)
    if heavy and rough and not scene.phase_free and (moving or len(scene.movable) == 1):
        return "sliding"
    if heavy and all(c.bounciness == 0 for c in contacts):
        return "resting"
    return "impacts"


def viscous_rates(scene: Scene, law: Law, profile: str) -> dict[int, float]:
    """Damping c [kg/s] of sliding bodies, empty under Newton-Coulomb; `Unsupported` where engines lack such a law."""
    if law == "nc":
        return {}
    pairs = can_meet(scene, (0, 1, 2))
    viscous = [(a, b, c) for a, b in pairs if (c := scene.contact_of(a, b).viscosity) > 0]
    if not viscous:
        raise Unsupported(
            "the engine's contacts realise Newton's restitution and Coulomb friction, not the documents' impact law"
        )
    if profile == "default":
        raise Unsupported("the engine's contacts know Coulomb friction only")
    if scene.phase_free:
        raise Unsupported(
            "native damping would act in flight too; only a body that touches from the start slides like this"
        )
    rates: dict[int, float] = {}
    for a, b, c in viscous:
        ends = [i for i in (a, b) if not scene.bodies[i].static]
        if len(ends) == 2:
            raise Unsupported(
                "viscous friction between two movable bodies: the engine can damp motion against the world only"
            )
        if ends[0] in rates:
            raise Unsupported(
                "a body in viscous friction with two statics: damping cannot tell which of them it touches"
            )
        rates[ends[0]] = c
    return rates


def surface_factors(
    scene: Scene, pairs: list[Pair], coefficient: Callable[[Contact], float], limit: float = math.inf
) -> list[float]:
    """Factors s_i in [0, limit] with s_i s_j = coefficient of every pair that can meet, else `Unsupported`."""
    if not scene.pairs:
        return [math.sqrt(coefficient(scene.contact))] * len(scene.bodies)
    factors = solve_products({pair: coefficient(scene.contact_of(*pair)) for pair in pairs}, limit)
    if factors is None:
        raise Unsupported("no per-surface coefficients have the scene's per-pair ones as their products")
    return [factors.get(i, 0.0) for i in range(len(scene.bodies))]


def solve_products(products: Mapping[Pair, float], limit: float = math.inf) -> dict[int, float] | None:
    """s_i in [0, limit] with s_i s_j = products[i, j] for every pair given, or None.

    A body in any pair with a product above 0 has s > 0. Within a component joined by such pairs, s is known up to one
    number t: s_i = k_i t or k_i / t, alternating along every edge; an odd cycle fixes t. All other bodies get 0.
    """
    neighbours: dict[int, dict[int, float]] = {}
    for (a, b), value in products.items():
        neighbours.setdefault(a, {})[b] = value
        neighbours.setdefault(b, {})[a] = value
    factors: dict[int, float] = {}
    for root in sorted(neighbours):
        if root in factors:
            continue
        factors |= _component(root, neighbours, limit)
    # One check covers cycles, zeros between positive bodies and limits that could not be kept.
    holds = all(math.isclose(factors[a] * factors[b], v, rel_tol=ROUND_OFF) for (a, b), v in products.items())
    return factors if holds and all(s <= limit * (1 + ROUND_OFF) for s in factors.values()) else None


def _component(root: int, neighbours: Mapping[int, Mapping[int, float]], limit: float) -> dict[int, float]:
    scale, power = {root: 1.0}, {root: 1}
    square = None
    queue = [root]
    for a in queue:  # grows while it is walked: breadth first
        for b, value in neighbours[a].items():
            if value == 0:
                continue
            if b not in scale:
                scale[b], power[b] = value / scale[a], -power[a]
                queue.append(b)
            elif power[a] == power[b]:  # odd cycle: k_a k_b t^(+-2) = value
                square = (value / (scale[a] * scale[b])) ** power[a]
    if len(queue) == 1:
        return {root: 0.0}
    up = max(k for i, k in scale.items() if power[i] > 0)
    down = max(k for i, k in scale.items() if power[i] < 0)
    # Without a cycle, the middle of the range that keeps all s small; two bodies then get a square root each.
    t = math.sqrt(down / up if square is None else square)
    return {
        i: min(k * t ** power[i], limit) if k * t ** power[i] < limit * (1 + ROUND_OFF) else math.inf
        for i, k in scale.items()
    }
