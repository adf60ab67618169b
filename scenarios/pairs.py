"""Two spheres that meet once in empty space: head-on with equal and unequal masses, and oblique."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.laws import impact, unit
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Contact, Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import Floats
from impactbench.scenarios.truth import Case, Family, Truth

RADIUS, SPEED, DURATION = 0.1, 3.0, 1.0
BOUNCINESS = (0.0, 0.25, 0.5, 0.8, 0.9, 1.0)
MASS_RATIOS = (1, 10, 100, 1000, 10_000, 1_000_000)
OFFSETS = (0.25, 0.5, 0.75)


def contact_time(separation: Floats, relative: Floats, reach: float) -> float:
    """First time [s] at which two spheres touch: the smaller root of |d + u t| = R_A + R_B, in the form that does
    not cancel.

    d [m] from A to B and u [m/s] of B relative to A; `math.inf` where they miss.
    """
    a, half_b, c = relative @ relative, separation @ relative, separation @ separation - reach**2
    discriminant = half_b**2 - a * c
    if half_b >= 0 or discriminant < 0:
        return math.inf
    return float(c / (-half_b + math.sqrt(discriminant)))


def pair_truth(scene: Scene, law: Law) -> Truth:
    """Two spheres without gravity: straight on until they touch, one impact with n along the centres, straight on."""
    first, (a, b) = opening(scene), scene.bodies
    assert isinstance(a.shape, Sphere)
    assert isinstance(b.shape, Sphere)
    assert a.mass is not None
    assert b.mass is not None
    x, v = first.positions, first.velocities
    time = contact_time(x[1] - x[0], v[1] - v[0], a.shape.radius + b.shape.radius)
    touching = first.at(time).positions
    normal = unit(touching[1] - touching[0])
    after = impact(law, (a.mass, b.mass), (v[0], v[1]), normal, scene.contact.bounciness)
    return Truth("trajectory", motion([first, first.then(time, velocities=np.array(after))]), (time,))


def _case(
    family: str, parameters: Parameters, masses: tuple[float, float], offset: float = 0.0, frame: float = 0.0
) -> Case:
    """A flies along x at B, which rests (in a frame that moves at `frame` [m/s]); `offset` [m] across, along y."""
    bodies = (
        Body("A", Sphere(RADIUS), masses[0], (-1.03, 0.0, 0.0), (SPEED + frame, 0.0, 0.0)),
        Body("B", Sphere(RADIUS), masses[1], (0.0, offset, 0.0), (frame, 0.0, 0.0)),
    )
    scene = Scene(
        name=case_name(family, parameters),
        bodies=bodies,
        duration=DURATION,
        model=Model((0, 1) if offset else (0,)),
        length=SPEED * DURATION,  # what A would travel, were B not there
        speed=SPEED,
        energy=masses[0] * SPEED**2 / 2,  # kinetic, before the impact, where B rests
        contact=Contact(float(parameters["bounciness"])),
        parameters=parameters,
    )
    return Case(scene, {law: pair_truth(scene, law) for law in scene.laws})


def equal_masses(bounciness: float, frame: float = 0.0) -> Case:
    """Head-on (R12): b = 1 swaps the velocities, b = 0 gives both the average, else v_A' = (1 - b) v/2 and v_B' = (1 +
    b) v/2.
    """
    parameters: Parameters = {"bounciness": bounciness}
    if frame:
        parameters["frame"] = frame
    return _case("equal_masses", parameters, (1.0, 1.0), frame=frame)


def unequal_masses(mass_ratio: int, bounciness: float) -> Case:
    """Head-on, A being r times as heavy (R7-R9): v_B' = (1 + b) r/(r + 1) v and v_A' = (r - b)/(r + 1) v."""
    parameters: Parameters = {"mass_ratio": mass_ratio, "bounciness": bounciness}
    return _case("unequal_masses", parameters, (float(mass_ratio), 1.0))


def oblique_pair(offset: float, bounciness: float) -> Case:
    """Impact parameter `offset` as a share of R_A + R_B = the sine of the angle between velocity and normal;
    m_B = 2 m_A.

    Law `doc`: u' = b (u - 2 (u.n) n). Law `nc`: u' = u - (1 + e) (u.n) n, the tangential part stays.
    """
    parameters: Parameters = {"offset": offset, "bounciness": bounciness}
    return _case("oblique_pair", parameters, (1.0, 2.0), offset=offset * 2 * RADIUS)


FAMILIES = (
    Family(
        "equal_masses",
        "Do two equal balls swap, share or split their velocity as bounciness says?",
        "1 dimension, two-way impact",
        lambda: [*(equal_masses(b) for b in BOUNCINESS), equal_masses(0.5, frame=-2.0)],
    ),
    Family(
        "unequal_masses",
        "Does a heavy ball drive a light one as it should, up to a million to one?",
        "1 dimension, two-way impact",
        lambda: [unequal_masses(ratio, b) for ratio in MASS_RATIOS for b in (1.0, 0.5)],
    ),
    Family(
        "oblique_pair",
        "What happens to the motion along the contact plane?",
        "2 dimensions, two-way impact",
        lambda: [oblique_pair(offset, b) for offset in OFFSETS for b in (1.0, 0.5, 0.0)],
    ),
)
