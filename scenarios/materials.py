"""Bounciness of a pair from the values of its two materials (documents, rule R10): the choice is exposed, all values
in [0, 1].

The documents name average, minimum and maximum; engines add product and geometric mean. Every mixing is symmetric,
and all but the product give b for two materials of the same b.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from itertools import chain, combinations, product

from impactbench.scenarios.records import Body, Contact

MIXINGS: dict[str, Callable[[float, float], float]] = {
    "average": lambda a, b: (a + b) / 2,
    "minimum": min,
    "maximum": max,
    "product": lambda a, b: a * b,
    "geometric mean": lambda a, b: math.sqrt(a * b),
}


def mix(mixing: str, a: float, b: float) -> float:
    """Bounciness [-] of the pair under the named mixing."""
    if mixing not in MIXINGS:
        near = difflib.get_close_matches(mixing, MIXINGS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"unknown mixing {mixing!r}: one of {', '.join(MIXINGS)}{hint}")
    return MIXINGS[mixing](a, b)


def mixed(
    bodies: tuple[Body, ...],
    materials: Mapping[str, float],
    mixing: str,
    base: Contact,
    listed: tuple[tuple[str, str, Contact], ...],
) -> tuple[tuple[str, str, Contact], ...]:
    """Coefficients of the pairs that have their own: those `listed`, and those of bodies with a material of their own.

    `materials` maps body names to bounciness [-]; a body without one has `base`'s. Static-static pairs are not formed.
    """
    if not materials:
        return listed
    known = {frozenset((a, b)) for a, b, _ in listed}
    movable, statics = [b.name for b in bodies if not b.static], [b.name for b in bodies if b.static]
    found = []
    for a, b in chain(combinations(movable, 2), product(statics, movable)):
        if (a in materials or b in materials) and frozenset((a, b)) not in known:
            own = mix(mixing, materials.get(a, base.bounciness), materials.get(b, base.bounciness))
            found.append((a, b, Contact(own, base.friction, base.viscosity)))
    return (*listed, *found)
