"""Falling along the vertical onto a floor: one ball bouncing to rest, columns, and the Galilean cannon."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.chain import chain_truth
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import Body, Box, Contact, HalfSpace, Model, Scene, Shape, Sphere
from impactbench.scenarios.trajectory import State
from impactbench.scenarios.truth import Case, Family, Truth

FLOOR = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
BOUNCINESS = (0.0, 0.5, 0.8, 0.9, 1.0)
SLOWEST = 1e-9  # m/s; the bounces below it are left out: they last less than 1e-7 s and reach less than 1e-19 m


def _drop(
    family: str,
    parameters: Parameters,
    shapes: list[Shape],
    masses: list[float],
    gaps: list[float],
    bounciness: float,
    duration: float,
) -> Scene:
    """Bodies above each other from rest, bottom first, each `gaps[i]` [m] above what lies below it."""
    bodies, z = [FLOOR], 0.0
    for i, (shape, mass, gap) in enumerate(zip(shapes, masses, gaps, strict=True)):
        half = shape.radius if isinstance(shape, Sphere) else shape.half_extents[2] if isinstance(shape, Box) else 0.0
        bodies.append(Body(f"body {i}", shape, mass, (0.0, 0.0, z + gap + half)))
        z += gap + 2 * half
    return Scene(
        name=case_name(family, parameters),
        bodies=tuple(bodies),
        duration=duration,
        model=Model((2,), gravity=True),
        length=sum(gaps),  # how far the top falls
        speed=math.sqrt(2 * G * sum(gaps)),  # and how fast it then is
        energy=G * float(np.dot(masses, np.cumsum(gaps))),  # what all falls release, m g h
        gravity=DOWN,
        contact=Contact(bounciness),
        parameters=parameters,
    )


def bouncing_ball(bounciness: float) -> Case:
    """First contact t_1 = sqrt(2 h/g), then arcs of speed e^n v_1 and length 2 e^n v_1/g, apex e^(2n) h.

    The arcs form a geometric series: all of them end at t_1 (1 + e)/(1 - e) (Zeno), after which the ball rests.
    """
    height, radius, duration = 1.0, 0.1, 3.0
    scene = _drop("bouncing_ball", {"bounciness": bounciness}, [Sphere(radius)], [1.0], [height], bounciness, duration)
    first_time, first_speed = math.sqrt(2 * height / G), math.sqrt(2 * height * G)
    floor_height, up = np.array([[0.0, 0.0, radius]]), np.array([[0.0, 0.0, 1.0]])
    piece = opening(scene)
    pieces, times, time, speed = [piece], [], first_time, bounciness * first_speed
    while speed > SLOWEST and time <= duration:
        pieces.append(piece.then(time, positions=floor_height, velocities=speed * up))
        times.append(time)
        time += 2 * speed / G
        speed *= bounciness
    if speed <= SLOWEST:
        pieces.append(piece.then(time, positions=floor_height, velocities=0 * up, accelerations=0 * up))
    truth = Truth("trajectory", motion(pieces), tuple(times) or (time,))
    return Case(scene, dict.fromkeys(scene.laws, truth))


def stacked_drop(shape: str, count: int) -> Case:
    """b = 0: every body stops where it arrives, what lies below being at rest; the top is last, after sqrt(2 h/g).

    Between a falling body and one resting on the floor, inelastic impacts of the pair and with the floor alternate at
    one instant and leave both at rest. Known: the heights, from there on.
    """
    half, gap = 0.1, 0.05
    parameters: Parameters = {"shape": shape, "count": count}
    solid: Shape = Sphere(half) if shape == "sphere" else Box((half, half, half))
    scene = _drop("stacked_drop", parameters, [solid] * count, [1.0] * count, [gap] * count, 0.0, 1.5)
    arrivals = tuple(math.sqrt(2 * gap * (i + 1) / G) for i in range(count))
    rest = State(np.array([[0.0, 0.0, half * (2 * i + 1)] for i in range(count)]), np.zeros((count, 3)))
    truth = Truth("end state", lambda time: rest if time >= arrivals[-1] else None, arrivals)
    return Case(scene, dict.fromkeys(scene.laws, truth))


def galilean_cannon(count: int) -> Case:
    """Each ball has a tenth of the mass below it; elastic impacts in sequence.

    As the gaps vanish, the top of two balls leaves at (3 M - m)/(M + m) v; of N balls, as the mass ratio grows, at
    (2^N - 1) v.
    """
    masses = [10.0 ** (count - 1 - i) for i in range(count)]
    radii: list[Shape] = [Sphere(0.1 * 0.6**i) for i in range(count)]
    scene = _drop("galilean_cannon", {"count": count}, radii, masses, [0.3] + [0.01] * (count - 1), 1.0, 1.0)
    return Case(scene, dict.fromkeys(scene.laws, chain_truth(scene)))


FAMILIES = (
    Family(
        "bouncing_ball",
        "Does a ball reach e^2 of its height at every bounce, and come to rest in time?",
        "1 dimension, gravity, one-way impacts",
        lambda: [bouncing_ball(b) for b in BOUNCINESS],
    ),
    Family(
        "stacked_drop",
        "Does a column dropped without bounce come to rest at exact heights?",
        "1 dimension, gravity, many bodies",
        lambda: [stacked_drop(shape, n) for shape in ("sphere", "box") for n in (3, 10)],
    ),
    Family(
        "galilean_cannon",
        "Are nearly simultaneous impacts of falling balls taken in sequence?",
        "1 dimension, gravity, one-way and two-way impacts",
        lambda: [galilean_cannon(2), galilean_cannon(3)],
    ),
)
