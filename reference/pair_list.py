"""Lists of pairs: put in order, made with their coefficients, and made anew without losing the memory of contacts."""

from __future__ import annotations

import numpy as np
from impactbench.reference.coefficients import Coefficients, coefficients_of, key_of
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import Bodies, Indices, Pairs


def no_pairs() -> Pairs:
    """An empty list."""
    numbers, values, flags = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.bool_)
    return Pairs(
        first=numbers,
        second=numbers,
        bounciness=values,
        friction=values,
        viscosity=values,
        gap=values,
        normal=np.zeros((0, 3)),
        touching=flags,
        touched=flags,
        reach=values,
        slow=values,
        push=values,
        rub=np.zeros((0, 3)),
        parted=values,
        clear=values,
        odometer=np.zeros(1),
    )


@compiled
def in_order(keys: Indices, bodies: int) -> Indices:
    """The keys ascending, each once: sorted by their two digits of base `bodies`, at a cost linear in their number."""
    for digit in range(2):
        start, sorted_keys = np.zeros(bodies + 1, dtype=np.int64), np.empty_like(keys)
        for key in keys:
            start[(key if digit == 0 else key // bodies) % bodies + 1] += 1
        for k in range(bodies):
            start[k + 1] += start[k]
        for key in keys:
            at = (key if digit == 0 else key // bodies) % bodies
            sorted_keys[start[at]] = key
            start[at] += 1
        keys = sorted_keys
    new = np.ones(len(keys), dtype=np.bool_)
    for k in range(1, len(keys)):
        new[k] = keys[k] != keys[k - 1]
    return keys[new]


@compiled
def remembered(pairs: Pairs, rank: Indices) -> Indices:
    """Keys of the pairs whose contact is not over: they stay in any list."""
    keys, count = np.empty(len(pairs.first), dtype=np.int64), 0
    for p in range(len(keys)):
        if pairs.touching[p] or pairs.touched[p] or pairs.reach[p] > 0 or pairs.parted[p] > 0:
            keys[count] = key_of(rank, pairs.first[p], pairs.second[p])
            count += 1
    return keys[:count]


@compiled
def relisted(old: Pairs, keys: Indices, bodies: Bodies, coefficients: Coefficients) -> Pairs:
    """The list of the pairs `keys`, ascending. Those of the old list keep their memory, others are yet to be seen."""
    count, rank = len(keys), coefficients.rank
    by_rank = np.empty_like(rank)
    by_rank[rank] = np.arange(len(rank))
    new = Pairs(
        first=by_rank[keys // len(rank)],
        second=keys % len(rank),
        bounciness=np.zeros(count),
        friction=np.zeros(count),
        viscosity=np.zeros(count),
        gap=np.full(count, np.inf),
        normal=np.zeros((count, 3)),
        touching=np.zeros(count, dtype=np.bool_),
        touched=np.zeros(count, dtype=np.bool_),
        reach=np.zeros(count),
        slow=np.zeros(count),
        push=np.zeros(count),
        rub=np.zeros((count, 3)),
        parted=np.zeros(count),
        clear=np.full(count, -np.inf),
        odometer=old.odometer,
    )
    p = 0
    for q in range(count):
        while p < len(old.first) and key_of(rank, old.first[p], old.second[p]) < keys[q]:
            p += 1
        if p < len(old.first) and key_of(rank, old.first[p], old.second[p]) == keys[q]:
            copy_pair(old, p, new, q)
        else:
            a, b = new.first[q], new.second[q]
            found = coefficients_of(coefficients, bodies.inverse_mass, a, b)
            new.bounciness[q], new.friction[q], new.viscosity[q] = found
    return new


@compiled
def copy_pair(old: Pairs, p: int, new: Pairs, q: int) -> None:
    """Coefficients and memory of pair p of one list to pair q of another."""
    new.bounciness[q], new.friction[q], new.viscosity[q] = old.bounciness[p], old.friction[p], old.viscosity[p]
    new.touching[q], new.touched[q], new.reach[q] = old.touching[p], old.touched[p], old.reach[p]
    new.gap[q] = old.gap[p]
    new.slow[q], new.push[q], new.parted[q], new.clear[q] = old.slow[p], old.push[p], old.parted[p], old.clear[p]
    for k in range(3):
        new.normal[q, k] = old.normal[p, k]
