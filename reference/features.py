"""The buffer into which a pair of shapes writes its features."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Indices
from impactbench.reference.triples import put
from impactbench.scenarios.records import Vector
from impactbench.scenarios.trajectory import Floats

MOST = 16
"""Features of one pair."""
NUMBERS = 1024
"""Numbers of the features of one pair lie below."""


class Features(NamedTuple):
    """Number, gap [m], unit normal from A to B, point [m], midway between the surfaces. Shapes [16] and [16, 3]."""

    number: Indices
    gap: Floats
    normal: Floats
    point: Floats


@compiled
def room() -> Features:
    """For the features of one pair."""
    return Features(np.zeros(MOST, dtype=np.int64), np.zeros(MOST), np.zeros((MOST, 3)), np.zeros((MOST, 3)))


@inlined
def note(found: Features, f: int, number: int, gap: float, normal: Vector, point: Vector) -> None:
    """Write feature f."""
    found.number[f] = number
    found.gap[f] = gap
    put(found.normal, f, normal)
    put(found.point, f, point)
