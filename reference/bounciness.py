"""Bounciness of a pair from the values of its two materials (documents, rule R10): the choice is exposed, all values
in [0, 1].

The documents name average, minimum and maximum; engines add product and geometric mean. Every mixing is symmetric,
and all but the product give b for two materials of the same b.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable

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
