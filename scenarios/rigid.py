"""Rigid bodies in impact and in free rotation: a ball hits a box off centre, a rod falls on its end, a body spins."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import exponential, motion, multiply, opening
from impactbench.scenarios.records import (
    ZERO,
    Body,
    Box,
    Capsule,
    Contact,
    HalfSpace,
    Law,
    Model,
    Scene,
    Sphere,
    Vector,
)
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case, Family, Truth

SPEED = 3.0


def rigid_offset_hit(offset: float, bounciness: float) -> Case:
    """A ball hits the flat face of a resting box `offset` [m] off its centre, without friction.

    Elastic (R14) and law `nc`, k = 1/m_A + 1/m_B + offset^2/I_B: J = (1 + e) v/k along the normal.
    Law `doc` interpolates between J at e = 1 and the two bodies momentarily joined.
    """
    radius, half, masses, duration = 0.1, (0.1, 0.5, 0.1), (1.0, 4.0), 1.0
    parameters: Parameters = {"offset": offset, "bounciness": bounciness}
    scene = Scene(
        name=case_name("rigid_offset_hit", parameters),
        bodies=(
            Body("ball", Sphere(radius), masses[0], (-1.03, offset, 0.0), (SPEED, 0.0, 0.0)),
            Body("box", Box(half), masses[1], ZERO),
        ),
        duration=duration,
        model=Model((0, 1), rotation=True),
        length=SPEED * duration,  # what the ball would travel, were the box not there
        speed=SPEED,
        energy=masses[0] * SPEED**2 / 2,  # kinetic, at the start
        contact=Contact(bounciness),
        parameters=parameters,
    )
    time = (1.03 - radius - half[0]) / SPEED

    def truth(law: Law) -> Truth:
        first = opening(scene)
        if law == "nc":
            after = _struck(scene, offset, bounciness)
        else:
            elastic, glued = _struck(scene, offset, 1.0), _joined(scene, first.at(time).positions)
            b = bounciness
            after = b * elastic[0] + (1 - b) * glued[0], b * elastic[1] + (1 - b) * glued[1]
        return Truth("trajectory", motion([first, first.then(time, velocities=after[0], spins=after[1])]), (time,))

    return Case(scene, {law: truth(law) for law in scene.laws})


def _struck(scene: Scene, offset: float, bounciness: float) -> tuple[Floats, Floats]:
    """Velocities and spins after the impulse J x at the face: only the box feels a moment, r x J with r_y = offset."""
    ball, box = scene.bodies
    assert ball.mass is not None
    assert box.mass is not None
    inertia = box.principal_inertia()[2]
    impulse = (1 + bounciness) * SPEED / (1 / ball.mass + 1 / box.mass + offset**2 / inertia)
    velocities = np.array([[SPEED - impulse / ball.mass, 0.0, 0.0], [impulse / box.mass, 0.0, 0.0]])
    return velocities, np.array([ZERO, (0.0, 0.0, -offset * impulse / inertia)])


def _joined(scene: Scene, positions: Floats) -> tuple[Floats, Floats]:
    """Both as one rigid body (R14): V and w from momentum and angular momentum, v_i = V + w x r_i about the centre."""
    masses = np.array([[body.mass] for body in scene.bodies], dtype=float)
    before = np.array([body.velocity for body in scene.bodies])
    common = (masses * before).sum(axis=0) / masses.sum()
    arms = positions - (masses * positions).sum(axis=0) / masses.sum()
    momentum = np.cross(arms, masses * before).sum(axis=0)[2]
    inertia = sum(body.principal_inertia()[2] for body in scene.bodies) + float((masses * arms**2).sum())
    spin = np.array([0.0, 0.0, momentum / inertia])
    return common + np.cross(spin, arms), np.tile(spin, (2, 1))


def rod_drop(angle: int, bounciness: float) -> Case:
    """A thin rod, th = `angle` [deg] from level, meets a frictionless floor; it ends before the other end lands.

    Law `nc`: J = (1 + e) m v/(1 + 3 cos^2 th), v' = J/m - v, w' = 6 J cos th/(m L): the effective mass (R14) is
    1/(1/m + (L/2 cos th)^2/I) with I = m L^2/12. No gravity.
    Law `doc`: joined with the floor it would rest, so both v' and w' are b times the elastic ones (R14).
    """
    length, radius, mass, speed, clearance, duration = 1.0, 0.02, 1.0, 0.5, 0.056, 0.5
    tilt = math.radians(angle)
    height = clearance + radius + length / 2 * math.sin(tilt)
    turned = exponential(np.array([0.0, math.pi / 2 - tilt, 0.0]))  # own z to (cos th, 0, sin th)
    across = mass * length**2 / 12
    rod = Body(
        "rod",
        Capsule(radius, length / 2),
        mass,
        (0.0, 0.0, height),
        (0.0, 0.0, -speed),
        (float(turned[0]), float(turned[1]), float(turned[2]), float(turned[3])),
        inertia=(across, across, mass * radius**2 / 2),
    )
    parameters: Parameters = {"angle": angle, "bounciness": bounciness}
    scene = Scene(
        name=case_name("rod_drop", parameters),
        bodies=(Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, ZERO), rod),
        duration=duration,
        model=Model((0, 2), rotation=True),
        length=length,
        speed=speed,
        energy=mass * speed**2 / 2,  # kinetic, at the start
        contact=Contact(bounciness),
        parameters=parameters,
    )
    time = clearance / speed

    def truth(law: Law) -> Truth:
        scale, e = (1.0, bounciness) if law == "nc" else (bounciness, 1.0)
        impulse = (1 + e) * mass * speed / (1 + 3 * math.cos(tilt) ** 2)
        velocity, spin = impulse / mass - speed, 6 * impulse * math.cos(tilt) / (mass * length)
        after = {"velocities": scale * np.array([[0.0, 0.0, velocity]]), "spins": scale * np.array([[0.0, spin, 0.0]])}
        first = opening(scene)
        return Truth("trajectory", motion([first, first.then(time, **after)]), (time,))

    return Case(scene, {law: truth(law) for law in scene.laws})


def torque_free_spin(body: str) -> Case:
    """Free rotation. A prism with I_1 = I_2 != I_3 (Kane, Likins and Levinson, Spacecraft Dynamics, 1983):

    w = L/I_1 + W e_3 with W = (1 - I_3/I_1) w_3: the body turns about e_3 by W t, that frame about L by |L| t/I_1.
    Three different moments: only energy and the vector L are given, no state.
    """
    half: Vector = (0.1, 0.1, 0.3) if body == "prism" else (0.1, 0.2, 0.3)
    mass, spin, duration = 1.0, (1.0, 0.0, 5.0), 2.0
    solid = Body("solid", Box(half), mass, ZERO, spin=spin)
    moments = np.array(solid.principal_inertia())
    size = float(np.linalg.norm(half))
    scene = Scene(
        name=case_name("torque_free_spin", {"body": body}),
        bodies=(solid,),
        duration=duration,
        model=Model((0, 1, 2), rotation=True),
        length=size,
        speed=size * float(np.linalg.norm(spin)),  # of a corner, at most
        energy=float(moments @ np.square(spin)) / 2,
        collide=False,
        phase_free=False,  # a shifted start would have to turn the body back
        parameters={"body": body},
    )
    if body != "prism":
        return Case(scene, dict.fromkeys(scene.laws, Truth("invariant", lambda _: None)), "angular_momentum_drift")
    steady = moments * np.array(spin) / moments[0]  # L/I_1; own and world axes agree at t = 0
    own = np.array([0.0, 0.0, (1 - moments[2] / moments[0]) * spin[2]])
    start = opening(scene)

    def state(time: float) -> State:
        frame = exponential(steady * time)
        axis = _rotated(frame, own)  # e_3 is fixed in the frame that turns about L
        return State(
            start.positions, start.velocities, multiply(frame, exponential(own * time))[None], (steady + axis)[None]
        )

    return Case(scene, dict.fromkeys(scene.laws, Truth("trajectory", state)), "spin_error")


def _rotated(quaternion: Floats, vector: Floats) -> Floats:
    conjugate = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    return multiply(multiply(quaternion, np.concatenate(([0.0], vector))), conjugate)[1:]


FAMILIES = (
    Family(
        "rigid_offset_hit",
        "Does an impact off centre share motion between velocity and spin as it must?",
        "2 dimensions and rotation, two-way impact",
        lambda: [rigid_offset_hit(0.25, b) for b in (1.0, 0.5)] + [rigid_offset_hit(0.4, 1.0)],
    ),
    Family(
        "rod_drop",
        "How fast does a rod turn after one end has hit the floor?",
        "2 dimensions and rotation, one-way impact",
        lambda: [rod_drop(angle, b) for angle in (30, 60) for b in (1.0, 0.5)],
    ),
    Family(
        "torque_free_spin",
        "Is free rotation right: the closed form, and the angular momentum?",
        "3 dimensions and rotation, no contact",
        lambda: [torque_free_spin("prism"), torque_free_spin("brick")],
    ),
)
