"""Balls with Coulomb friction: from sliding to rolling, down an incline, and an oblique bounce (law `nc` only)."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Contact, Model, Scene, Sphere, Vector
from impactbench.scenarios.truth import Case, Family, Truth

RADIUS, MASS, SPEED = 0.1, 1.0, 3.0
ROLLING = Model((0, 2), rotation=True, gravity=True, friction=True)
ACROSS = np.array([[0.0, 1.0, 0.0]])  # rolling along +x turns about +y: v = w R
ALONG = np.array([[1.0, 0.0, 0.0]])


def _on_floor(family: str, parameters: Parameters, speed: float, gravity: Vector, friction: float) -> Scene:
    """A ball that touches the floor at t = 0. Scales: what it would do in the time without friction."""
    duration = 1.0
    scale = speed or gravity[0] * duration
    return Scene(
        name=case_name(family, parameters),
        bodies=(FLOOR, Body("ball", Sphere(RADIUS), MASS, (0.0, 0.0, RADIUS), (speed, 0.0, 0.0))),
        duration=duration,
        model=ROLLING,
        length=scale * duration if speed else scale * duration / 2,
        speed=scale,
        energy=MASS * scale**2 / 2,
        gravity=gravity,
        contact=Contact(0.0, friction),
        laws=("nc",),
        phase_free=False,
        parameters=parameters,
    )


def rolling_onset(friction: float) -> Case:
    """Sliding: dv/dt = -mu g, R dw/dt = 5/2 mu g, until v = w R = 5/7 v0 at t = 2 v0/(7 mu g); then rolling."""
    scene = _on_floor("rolling_onset", {"friction": friction}, SPEED, DOWN, friction)
    onset, speed, nothing = 2 * SPEED / (7 * friction * G), 5 / 7 * SPEED, np.zeros((1, 3))
    pull = friction * G
    sliding = opening(scene).then(0.0, accelerations=-pull * ALONG, spin_rates=2.5 * pull / RADIUS * ACROSS)
    rolling = sliding.then(
        onset, velocities=speed * ALONG, accelerations=nothing, spins=speed / RADIUS * ACROSS, spin_rates=nothing
    )
    return Case(scene, {"nc": Truth("trajectory", motion([sliding, rolling]))})


def rolling_incline(angle: int, friction: float) -> Case:
    """From rest, gravity tilted by th = `angle` [deg]: rolls at a = 5/7 g sin th if mu >= 2/7 tan th.

    Else it slips at a = g (sin th - mu cos th) and R dw/dt = 5/2 mu g cos th.
    """
    along, across = G * math.sin(math.radians(angle)), G * math.cos(math.radians(angle))
    parameters: Parameters = {"angle": angle, "friction": friction}
    scene = _on_floor("rolling_incline", parameters, 0.0, (along, 0.0, -across), friction)
    rolls = friction * across >= 2 / 7 * along
    pull = 5 / 7 * along if rolls else along - friction * across
    twist = pull if rolls else 2.5 * friction * across
    piece = opening(scene).then(0.0, accelerations=pull * ALONG, spin_rates=twist / RADIUS * ACROSS)
    return Case(scene, {"nc": Truth("trajectory", motion([piece]))})


def oblique_friction_impact(angle: int, bounciness: float) -> Case:
    """A ball without spin meets the floor at `angle` [deg] from the normal, without gravity; v_n' = e v_n.

    The tangential impulse is mu times the normal one while the contact slides throughout, v_t >= 7/2 mu (1 + e) v_n:
    v_t falls by mu (1 + e) v_n and w' = 5/2 mu (1 + e) v_n/R. Otherwise it stops the contact: v_t' = 5/7 v_t = w' R.
    """
    friction, duration = 0.2, 1.0
    parameters: Parameters = {"angle": angle, "bounciness": bounciness}
    down, along = SPEED * math.cos(math.radians(angle)), SPEED * math.sin(math.radians(angle))
    start = Body("ball", Sphere(RADIUS), MASS, (0.0, 0.0, 0.86), (along, 0.0, -down))
    scene = Scene(
        name=case_name("oblique_friction_impact", parameters),
        bodies=(FLOOR, start),
        duration=duration,
        model=Model((0, 2), rotation=True, friction=True),
        length=SPEED * duration,  # what it would travel, were the floor not there
        speed=SPEED,
        energy=MASS * SPEED**2 / 2,
        contact=Contact(bounciness, friction),
        laws=("nc",),
        parameters=parameters,
    )
    time = (start.position[2] - RADIUS) / down
    loss = min(friction * (1 + bounciness) * down, 2 / 7 * along)
    after = np.array([[along - loss, 0.0, bounciness * down]])
    first = opening(scene)
    bounced = first.then(time, velocities=after, spins=2.5 * loss / RADIUS * ACROSS)
    return Case(scene, {"nc": Truth("trajectory", motion([first, bounced]), (time,))})


FAMILIES = (
    Family(
        "rolling_onset",
        "Does a sliding ball begin to roll when and as fast as it must?",
        "2 dimensions and rotation, Coulomb friction",
        lambda: [rolling_onset(mu) for mu in (0.1, 0.3)],
    ),
    Family(
        "rolling_incline",
        "Does a ball roll down an incline at 5/7 g sin th, or slip where friction is too weak?",
        "2 dimensions and rotation, Coulomb friction",
        lambda: [rolling_incline(10, 0.5), rolling_incline(30, 0.5), rolling_incline(60, 0.3)],
    ),
    Family(
        "oblique_friction_impact",
        "What spin does a bounce give, sliding or sticking?",
        "2 dimensions and rotation, Coulomb friction in an impact",
        lambda: [oblique_friction_impact(angle, e) for angle in (30, 60) for e in (1.0, 0.5)],
    ),
)
