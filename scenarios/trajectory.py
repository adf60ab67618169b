"""What a run leaves behind: times and the movable bodies' states at them. All figures are computed from this."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class State:
    """The movable bodies at one instant, in scene order.

    positions [m] and velocities [m/s] of the centres of mass, shape [n, 3]; orientations as unit quaternions
    (w, x, y, z), shape [n, 4], and spins [rad/s] in world axes, shape [n, 3], both None where rotation is not modelled.
    """

    positions: Floats
    velocities: Floats
    orientations: Floats | None = None
    spins: Floats | None = None


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States at `times` [s], shape [T], strictly ascending, the first at 0.

    positions and velocities have shape [T, n, 3]; orientations [T, n, 4] and spins [T, n, 3] or None.
    """

    times: Floats
    positions: Floats
    velocities: Floats
    orientations: Floats | None = None
    spins: Floats | None = None

    def state(self, index: int) -> State:
        return State(
            self.positions[index],
            self.velocities[index],
            None if self.orientations is None else self.orientations[index],
            None if self.spins is None else self.spins[index],
        )

    def finite(self) -> bool:
        arrays = (self.positions, self.velocities, self.orientations, self.spins)
        return all(a is None or bool(np.isfinite(a).all()) for a in arrays)
