"""The ad-hoc callback of rule R3: told of contacts, it may mark bodies, which leave at the end of the step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from impactbench.reference.particles import Bodies, Indices, Pairs

Callback = Callable[[float, str, str], Iterable[str]]
"""(time [s] at the step's end, name of one body, name of the other) -> names of the bodies that leave."""


def asked_to_leave(callback: Callback, time: float, names: Sequence[str], pairs: Pairs) -> set[int]:
    """Numbers of the bodies marked by any contact of this step; every contact is told before any body leaves."""
    marked: set[str] = set()
    for p in np.nonzero(pairs.touching)[0]:
        marked.update(callback(time, names[pairs.first[p]], names[pairs.second[p]]))
    if unknown := marked - set(names):
        raise ValueError(f"the callback names {sorted(unknown)}: no such body; there are {', '.join(names)}")
    return {i for i, name in enumerate(names) if name in marked}


def without(bodies: Bodies, pairs: Pairs, leaving: set[int]) -> tuple[Bodies, Pairs, Indices]:
    """What is left, and the former numbers of the bodies that stay."""
    kept = np.array([i for i in range(len(bodies.inverse_mass)) if i not in leaving], dtype=np.int64)
    stays = np.isin(pairs.first, kept) & np.isin(pairs.second, kept)
    number = np.searchsorted(kept, np.arange(len(bodies.inverse_mass)))
    fewer = Bodies(**{name: getattr(bodies, name)[kept] for name in Bodies._fields})
    each = {name: getattr(pairs, name) for name in Pairs._fields}
    left = {
        name: array[stays] if len(array) == len(stays) and name != "odometer" else array for name, array in each.items()
    }
    left["first"], left["second"] = number[left["first"]], number[left["second"]]
    return fewer, Pairs(**left), kept
