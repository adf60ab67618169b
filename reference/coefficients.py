"""Coefficients of a pair of bodies, looked up where it is met: a table of all pairs would grow with their square."""

from __future__ import annotations

from collections import defaultdict
from itertools import islice, product
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Indices, check_contact
from impactbench.reference.viscous import as_damping
from impactbench.scenarios.records import Contact, Scene
from impactbench.scenarios.trajectory import Floats


class Coefficients(NamedTuple):
    """Bounciness, friction and viscosity [kg/s] of pairs: `own` [k, 3] of those whose keys stand in `key`, ascending,
    `usual` [3] of all others.

    rank [n]: statics first, then the movable bodies, each in the scene's order. force_step [s]: viscous friction acts
    as the explicit force over such a step; 0: as damping.
    """

    usual: Floats
    key: Indices
    own: Floats
    rank: Indices
    force_step: float


def build_coefficients(scene: Scene, force_step: float = 0.0) -> Coefficients:
    """The scene's coefficients, checked. Of several entries for one pair the first counts."""
    for contact in {scene.contact, *(contact for _, _, contact in scene.pairs)}:
        check_contact(scene.name, contact)
    rank = np.argsort(np.array([*scene.statics, *scene.movable], dtype=np.int64))
    numbers: defaultdict[str, list[int]] = defaultdict(list)
    for i, body in enumerate(scene.bodies):
        numbers[body.name].append(i)
    own: dict[int, tuple[float, float, float]] = {}
    for left, right, contact in reversed(scene.pairs):
        own |= {pair_key(rank, a, b): _values(contact) for a, b in product(numbers[left], numbers[right]) if a != b}
    key = sorted(own)
    return Coefficients(
        usual=np.array(_values(scene.contact)),
        key=np.array(key, dtype=np.int64),
        own=np.array([own[k] for k in key], dtype=np.float64).reshape(-1, 3),
        rank=rank,
        force_step=force_step,
    )


def _values(contact: Contact) -> tuple[float, float, float]:
    return float(contact.bounciness), float(contact.friction), float(contact.viscosity)


def pair_key(rank: Indices, a: int, b: int) -> int:
    """A number for a pair, by which pairs are in order: one-way pairs first, then by first and second body."""
    if rank[a] > rank[b]:
        a, b = b, a
    key: int = rank[a] * len(rank) + b
    return key


key_of = inlined(pair_key)


@compiled
def coefficients_of(coefficients: Coefficients, inverse_mass: Floats, a: int, b: int) -> tuple[float, float, float]:
    """Bounciness, friction and the viscosity [kg/s] whose damping is the friction asked for."""
    key = key_of(coefficients.rank, a, b)
    place = np.searchsorted(coefficients.key, key)
    found = coefficients.usual
    if place < len(coefficients.key) and coefficients.key[place] == key:
        found = coefficients.own[place]
    viscosity = found[2]
    if viscosity > 0 and coefficients.force_step > 0:
        viscosity = as_damping(viscosity, viscosity * coefficients.force_step * (inverse_mass[a] + inverse_mass[b]))
    return found[0], found[1], viscosity


def refuse_reversal(scene: Scene, coefficients: Coefficients, inverse_mass: Floats) -> None:
    """Raise ValueError for a pair whose sliding an explicit force would reverse, c h/mu_r > 1 (see `force_step`).

    Of the pairs without own coefficients the lightest decide: with each body, the lightest that it makes such a pair
    with.
    """
    own = coefficients.key.tolist()
    lightest = np.argsort(-inverse_mass, kind="stable").tolist()
    n, by_rank = len(inverse_mass), np.argsort(coefficients.rank)
    if not scene.collide:
        return
    pairs = [(int(by_rank[key // n]), key % n, c) for key, c in zip(own, coefficients.own[:, 2], strict=True)]
    listed = set(own)
    for place, a in enumerate(lightest):
        others = (lightest[k] for k in range(place + 1, n))
        usual = (b for b in others if pair_key(coefficients.rank, a, b) not in listed)
        pairs += [(a, b, coefficients.usual[2]) for b in islice(usual, 1)]
    for a, b, c in pairs:
        ratio = c * coefficients.force_step * (inverse_mass[a] + inverse_mass[b])
        if ratio > 1:
            raise ValueError(
                f"{scene.name}: c h/m = {ratio:.3g} > 1: as a force, viscosity {c:g} would reverse the sliding"
            )
