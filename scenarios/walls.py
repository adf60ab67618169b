"""One sphere and immovable walls: head-on, oblique, and the billiard in a rectangular box.
One-way impacts (R13), no gravity.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.laws import impact
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Contact, HalfSpace, Law, Model, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Floats, State
from impactbench.scenarios.truth import Case, Family, Truth

RADIUS, SPEED, MASS = 0.1, 3.0, 1.0
ENERGY = MASS * SPEED**2 / 2  # kinetic, at the start: the energy scale of every case here
BOUNCINESS = (0.0, 0.25, 0.5, 0.8, 0.9, 1.0)
AXES = {1: (2,), 2: (0, 2), 3: (0, 1, 2)}


def wall_truth(scene: Scene, law: Law) -> Truth:
    """Straight on until the sphere touches the plane, one impact, straight on."""
    first, wall = opening(scene), scene.bodies[1]
    assert isinstance(wall.shape, HalfSpace)
    normal, velocity = np.array(wall.shape.normal), first.velocities[0]
    time = ((first.positions[0] - np.array(wall.position)) @ normal - RADIUS) / -(velocity @ normal)
    _, after = impact(law, (math.inf, MASS), (np.zeros(3), velocity), normal, scene.contact.bounciness)
    return Truth("trajectory", motion([first, first.then(time, velocities=after[None])]), (float(time),))


def _wall_case(family: str, parameters: Parameters, dimension: int, velocity: Vector, normal: Vector) -> Case:
    """The sphere starts .86 m off the plane's foot point along the normal."""
    duration = 1.0
    start = (0.86 * normal[0], 0.86 * normal[1], 0.86 * normal[2])
    scene = Scene(
        name=case_name(family, parameters),
        bodies=(Body("ball", Sphere(RADIUS), MASS, start, velocity), Body("wall", HalfSpace(normal), None, (0.0,) * 3)),
        duration=duration,
        model=Model(AXES[dimension]),
        length=SPEED * duration,  # what the ball would travel, were the wall not there
        speed=SPEED,
        energy=ENERGY,
        contact=Contact(float(parameters["bounciness"])),
        parameters=parameters,
    )
    return Case(scene, {law: wall_truth(scene, law) for law in scene.laws})


def static_wall(bounciness: float) -> Case:
    """v' = -b v (R13), at the time (distance - R)/v."""
    return _wall_case("static_wall", {"bounciness": bounciness}, 1, (0.0, 0.0, -SPEED), (0.0, 0.0, 1.0))


def oblique_wall(angle: int, bounciness: float, dimension: int = 2) -> Case:
    """`angle` [deg] between the velocity and the normal. Law `doc`: v' = b (v - 2 (v.n) n).
    Law `nc`: v' = v - (1 + e) (v.n) n.

    In three dimensions the wall's normal is (1, 2, 2)/3, so that no axis is special.
    """
    parameters: Parameters = {"angle": angle, "bounciness": bounciness, "dimension": dimension}
    normal, tangent = (
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)) if dimension == 2 else ((1 / 3, 2 / 3, 2 / 3), (2 / 3, -2 / 3, 1 / 3))
    )
    down, along = SPEED * math.cos(math.radians(angle)), SPEED * math.sin(math.radians(angle))
    x, y, z = (along * t - down * n for t, n in zip(tangent, normal, strict=True))
    return _wall_case("oblique_wall", parameters, dimension, (x, y, z), normal)


def unfold(start: Floats, velocity: Floats, room: Floats, time: float) -> State:
    """Elastic billiard of a point in the box 0..room [m] by mirror images: the straight line, folded back.

    Along each axis the reflected motion has period 2 room; its second half is the first, mirrored (velocity with it).
    """
    phase = np.mod(start + velocity * time, 2 * room)
    mirrored = phase > room
    return State(np.where(mirrored, 2 * room - phase, phase)[None], np.where(mirrored, -velocity, velocity)[None])


def unfolding_times(start: Floats, velocity: Floats, room: Floats, duration: float) -> tuple[float, ...]:
    """Instants [s] at which the straight line passes a mirror image of a wall, x = k room; corner hits count once."""
    times: set[float] = set()
    for x, v, length in zip(start, velocity, room, strict=True):
        if v != 0:
            ends = sorted((x, x + v * duration))
            walls = range(math.ceil(ends[0] / length), math.floor(ends[1] / length) + 1)
            # Rounded, so that both parts of a corner hit agree.
            times |= {round(float((k * length - x) / v), 12) for k in walls}
    return tuple(sorted(t for t in times if 0 < t <= duration))


def box_of_walls(dimension: int, hit: str = "faces") -> Case:
    """A sphere in a box of half-spaces, b = 1: exact for all time by `unfold`.
    A corner hit reverses both components at once.
    """
    parameters: Parameters = {"dimension": dimension, "hit": hit}
    axes = AXES[dimension]
    # Directions are irrational enough to meet no corner within the duration, or else aim at a corner from the middle.
    direction = np.array([1.0, 1.0, 1.0] if hit == "corner" else [0.62, 0.37, 0.69])
    direction[[axis for axis in range(3) if axis not in axes]] = 0
    velocity = SPEED * direction / np.linalg.norm(direction)
    inner = np.array([0.8, 0.8, 0.8] if hit == "corner" else [1.0, 0.8, 0.9])  # room of the centre, size less 2 R
    duration = 2.0
    x, y, z = (float(s) for s in velocity)
    bodies = [Body("ball", Sphere(RADIUS), MASS, (0.0, 0.0, 0.0), (x, y, z))]
    for axis in axes:
        for side in (-1.0, 1.0):
            place = tuple(side * (inner[axis] / 2 + RADIUS) if i == axis else 0.0 for i in range(3))
            normal = tuple(-side if i == axis else 0.0 for i in range(3))
            name = f"{'xyz'[axis]}{'-+'[side > 0]}"
            bodies.append(
                Body(name, HalfSpace((normal[0], normal[1], normal[2])), None, (place[0], place[1], place[2]))
            )
    scene = Scene(
        name=case_name("box_of_walls", parameters),
        bodies=tuple(bodies),
        duration=duration,
        model=Model(axes),
        length=float(inner.max()),  # the box: no error can exceed it by much
        speed=SPEED,
        energy=ENERGY,
        contact=Contact(1.0),
        parameters=parameters,
    )

    def state(time: float) -> State:
        folded = unfold(inner / 2, velocity, inner, time)
        return State(folded.positions - inner / 2, folded.velocities)

    truth = Truth("trajectory", state, unfolding_times(inner / 2, velocity, inner, duration))
    return Case(scene, dict.fromkeys(scene.laws, truth))


FAMILIES = (
    Family(
        "static_wall",
        "Does a ball leave a wall with b times its speed?",
        "1 dimension, one-way impact",
        lambda: [static_wall(b) for b in BOUNCINESS],
    ),
    Family(
        "oblique_wall",
        "Does an oblique bounce keep the tangential speed (nc) or scale it by b (doc)?",
        "2 or 3 dimensions, one-way impact",
        lambda: [
            *(oblique_wall(angle, b) for angle in (30, 60) for b in (1.0, 0.5, 0.0)),
            *(oblique_wall(45, b, dimension=3) for b in (1.0, 0.5)),
        ],
    ),
    Family(
        "box_of_walls",
        "Does a billiard ball stay on its mirror-image path, corners included?",
        "2 or 3 dimensions, one-way impacts only",
        lambda: [box_of_walls(2), box_of_walls(3), box_of_walls(2, "corner")],
    ),
)
