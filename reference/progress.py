"""A step under way: it may stop where a new list of pairs is wanted, and goes on from there with the new one.

So the kernels of a step hold nothing of how lists are made, and scenes of few bodies never compile that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats

BEGIN, MOVED = range(2)


class Progress(NamedTuple):
    """last [m], before [m/s] [n, 3]: places at the step's begin, velocities there before gravity acted.

    stage [2]: `BEGIN` or `MOVED`, and how often overlaps were taken back since. rest [m/s] [1]: change of velocity at
    which lasting contacts stopped. wanted [m] [1]: the list of pairs must reach so far; negative where it does.
    """

    last: Floats
    before: Floats
    stage: Indices
    rest: Floats
    wanted: Floats


def build_progress(bodies: int) -> Progress:
    """At the beginning of a step."""
    return Progress(
        last=np.zeros((bodies, 3)),
        before=np.zeros((bodies, 3)),
        stage=np.zeros(2, dtype=np.int64),
        rest=np.zeros(1),
        wanted=np.full(1, -1.0),
    )
