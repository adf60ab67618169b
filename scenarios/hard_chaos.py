"""A ball between two fixed balls: the smallest chaotic scene, with a truth in closed form and a known growth."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Body, Contact, Model, Scene, Sphere
from impactbench.scenarios.survival import HardFamily, energy_kept, hard_family
from impactbench.scenarios.trajectory import State
from impactbench.scenarios.truth import Case, Truth
from impactbench.scenarios.walls import unfold

RADIUS, REACH, SPEED = 0.1, 1.1, 2.9  # m, m, m/s; no step of the ladder divides the time between bounces
LINE = np.array([0.6, 0.0, 0.8])
"""Along no axis: on one, symmetry would hide what round-off does."""
KNOWN, ROUNDING = 0.01, 2.0**-50
"""A truth is known while it is off by less than 1 % of the scene; it starts with a few rounded operations."""


def stretching(ratio: float) -> float:
    """Factor by which a small sideways displacement grows from one bounce to the next.

    Between bounces a displacement x of direction s becomes x + s L; at a sphere of curvature 1/R the direction gains
    2 x/R. Their product has determinant 1 and trace 2 + 2 q with q = L/R, so that the larger eigenvalue is
    1 + q + sqrt((1 + q)^2 - 1) (ray optics of two convex mirrors; Chernov & Markarian, Chaotic Billiards, 2006, ch. 4).
    """
    half_trace = 1 + ratio
    return half_trace + math.sqrt(half_trace**2 - 1)


def known_until(ratio: float) -> float:
    """Time [s] until which the orbit is known: L/v for every factor of `stretching` from round-off to 1 %."""
    return ratio * REACH / SPEED * math.log(KNOWN / ROUNDING) / math.log(stretching(ratio))


def dispersing_billiard(ratio: float) -> Case:
    """A ball to and fro between two fixed ones, b = 1; the centre's free path is `ratio` times R = R_A + R_B.

    Truth: to and fro on the line of centres for ever, by mirror images. The orbit is unstable.
    """
    parameters: Parameters = {"ratio": ratio}
    path, known = ratio * REACH, known_until(ratio)
    bodies = [Body("ball", Sphere(RADIUS), 1.0, (0.0, 0.0, 0.0), _along(SPEED))]
    bodies += [
        Body(name, Sphere(REACH - RADIUS), None, _along(side * (path / 2 + REACH)))
        for name, side in (("far", 1.0), ("near", -1.0))
    ]
    scene = Scene(
        name=case_name("dispersing_billiard", parameters),
        bodies=tuple(bodies),
        duration=1.5 * known,
        model=Model((0, 2)),
        length=path,
        speed=SPEED,
        energy=SPEED**2 / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )

    def state(time: float) -> State:
        folded = unfold(np.array([path / 2]), np.array([SPEED]), np.array([path]), time)
        return State((folded.positions - path / 2) * LINE, folded.velocities * LINE)

    times = tuple((k + 0.5) * path / SPEED for k in range(int(1.5 * known * SPEED / path)))
    truth = Truth("trajectory", state, times, known)
    return Case(scene, dict.fromkeys(scene.laws, truth), headline="trajectory_error")


def _along(distance: float) -> tuple[float, float, float]:
    x, y, z = (float(part) for part in distance * LINE)
    return (x, y, z)


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "dispersing_billiard",
        "How long can any run follow an unstable orbit, and is energy kept beyond?",
        "2 dimensions, one-way impacts",
        dispersing_billiard,
        lambda _: (energy_kept(),),
        [{"ratio": ratio} for ratio in (0.1, 1.0)],
    ),
)
