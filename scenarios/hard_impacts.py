"""Impacts that come too deep, without end, or on two walls at once."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.flight import DOWN, G
from impactbench.scenarios.gravity_drops import FLOOR
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import ZERO, Body, Contact, HalfSpace, Model, Scene, Sphere
from impactbench.scenarios.survival import (
    PART,
    Criterion,
    HardFamily,
    Knob,
    at_end,
    energy,
    hard_family,
    invariant,
    step_of,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Truth

RADIUS = 0.1


def deep_overlap(overlap: float) -> Case:
    """Two balls at rest, their centres (1 - overlap) of a diameter apart; inelastic, no forces."""
    radius = 0.5
    parameters: Parameters = {"overlap": overlap}
    half = radius * (1 - overlap)
    scene = Scene(
        name=case_name("deep_overlap", parameters),
        bodies=tuple(
            Body(f"ball {s}", Sphere(radius), 1.0, (x, 0.0, 0.0)) for s, x in (("left", -half), ("right", half))
        ),
        duration=2.0,
        model=Model((0, 2)),
        length=2 * radius,
        speed=1.0,
        energy=1.0,
        contact=Contact(0.0),
        phase_free=False,
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def thrown(scene: Scene, trajectory: Trajectory) -> Floats:
    """Fastest ball over the last tenth of the run, next to the speed that takes the whole run to undo the overlap."""
    fair = float(scene.parameters["overlap"]) * scene.length / 2 / scene.duration
    speed = np.linalg.norm(trajectory.velocities, axis=2).max(axis=1) / fair
    return np.asarray(np.where(trajectory.times >= 0.9 * scene.duration, speed, 0.0))


def left_over(scene: Scene, trajectory: Trajectory) -> Floats:
    apart = float(np.linalg.norm(trajectory.positions[-1, 1] - trajectory.positions[-1, 0]))
    return at_end(trajectory, 1 - apart / scene.length)


OVERLAP = (
    Criterion(
        "calm",
        "the balls are not thrown apart",
        1.0,
        "the truth creates no kinetic energy; to undo the overlap within the run takes this speed, more is thrown",
        thrown,
    ),
    Criterion(
        "resolved", "no overlap is left", PART, "solids do not overlap: a hundredth of a diameter at most", left_over
    ),
)


def overlap_outcome(_: Scene, trajectory: Trajectory) -> str:
    relative = trajectory.velocities[:, 1] - trajectory.velocities[:, 0]
    return f"apart at {np.linalg.norm(relative, axis=1).max():.3g} m/s"


def zeno(bounciness: float) -> Case:
    """A ball dropped from 1 m bounces to rest at sqrt(2 h/g)(1 + e)/(1 - e), after endlessly many bounces."""
    first = math.sqrt(2 / G)
    rest = first * (1 + bounciness) / (1 - bounciness)
    parameters: Parameters = {"bounciness": bounciness}
    scene = Scene(
        name=case_name("zeno", parameters),
        bodies=(FLOOR, Body("ball", Sphere(RADIUS), 1.0, (0.0, 0.0, 1.0 + RADIUS))),
        duration=1.3 * rest + 0.5,
        model=Model((2,), gravity=True),
        length=1.0,
        speed=math.sqrt(2 * G),
        energy=G,
        gravity=DOWN,
        contact=Contact(bounciness),
        parameters=parameters,
    )
    piece, time, speed = opening(scene), first, bounciness * math.sqrt(2 * G)
    ground, up = np.array([[0.0, 0.0, RADIUS]]), np.array([[0.0, 0.0, 1.0]])
    pieces, times = [piece], []
    while speed > 1e-9:
        pieces.append(piece.then(time, positions=ground, velocities=speed * up))
        times.append(time)
        time += 2 * speed / G
        speed *= bounciness
    pieces.append(piece.then(time, positions=ground, velocities=0 * up, accelerations=0 * up))
    return Case(scene, dict.fromkeys(scene.laws, Truth("trajectory", motion(pieces), tuple(times))))


def slack(scene: Scene, step: float) -> float:
    """How far [s] a stepped engine's time of rest may be off: a step a bounce while bounces are resolved, and the rest.

    Bounces slower than 2 g h last less than 4 steps: n of them are faster, e^n v = 2 g h, and those after last
    4 h/(1 - e).
    """
    e = scene.contact.bounciness
    resolved = math.log(max(scene.speed / (2 * G * step), 1.0)) / -math.log(e)
    return (resolved + 1) * step + 4 * step / (1 - e)


def rest_time(scene: Scene) -> float:
    e = scene.contact.bounciness
    return math.sqrt(2 / G) * (1 + e) / (1 - e)


def too_long(scene: Scene, trajectory: Trajectory) -> Floats:
    h = step_of(trajectory)
    speed = np.abs(trajectory.velocities[:, 0, 2]) / (2 * G * h)
    return np.asarray(np.where(trajectory.times > rest_time(scene) + slack(scene, h), speed, 0.0))


def too_short(scene: Scene, trajectory: Trajectory) -> Floats:
    """2 g h next to the fastest speed still to come, up to the time of rest less the slack."""
    h = step_of(trajectory)
    coming = np.maximum.accumulate(np.abs(trajectory.velocities[::-1, 0, 2]))[::-1] / (2 * G * h)
    early = trajectory.times < rest_time(scene) - slack(scene, h)
    return np.asarray(np.where(early, 1 / np.maximum(coming, 1e-300), 0.0).clip(max=1e6))


ZENO = (
    Criterion(
        "settles",
        "at rest once the bounces have summed up, without jitter",
        1.0,
        "the times of the bounces are a geometric series; then nothing moves faster than two steps' worth of gravity",
        too_long,
    ),
    Criterion(
        "bounces",
        "bounces until then",
        1.0,
        "before the sum of the series the ball still bounces faster than two steps' worth of gravity",
        too_short,
    ),
)


def wedge(angle: int) -> Case:
    """A ball falls off centre into a groove of two smooth planes that rise by `angle` [deg] each; e = .5.

    It comes to rest touching both: at the middle, R/cos(angle) above the edge. In a shallow groove that takes long: the
    first impacts leave at most 3 v sin(angle) along the slope (v, and g sin(angle) for the 2 v/g of bouncing), and each
    crossing of the edge keeps cos(2 angle) of it, 6 v/(g (1 - cos(2 angle))) in all: 7.4 s at 21 degrees.
    """
    slope = math.radians(angle)
    parameters: Parameters = {"angle": angle}
    sine, cosine = math.sin(slope), math.cos(slope)
    scene = Scene(
        name=case_name("wedge", parameters),
        bodies=(
            Body("left", HalfSpace((sine, 0.0, cosine)), None, ZERO),
            Body("right", HalfSpace((-sine, 0.0, cosine)), None, ZERO),
            Body("ball", Sphere(RADIUS), 1.0, (0.15, 0.0, RADIUS / cosine + 0.15 * math.tan(slope) + 0.5)),
        ),
        duration=8.0,
        model=Model((0, 2), gravity=True),
        length=0.5,
        speed=math.sqrt(2 * G * 0.5),
        energy=G * 0.5,
        gravity=DOWN,
        contact=Contact(0.5),
        laws=("nc",),
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def grown(scene: Scene, trajectory: Trajectory) -> Floats:
    """Energy above the start's, next to what a step's lateness can account for: m g h times the speed scale."""
    total = energy(scene, trajectory)
    return np.asarray((total - total[0]) / (G * step_of(trajectory) * scene.speed))


def off_rest(scene: Scene, trajectory: Trajectory) -> Floats:
    slope = math.radians(float(scene.parameters["angle"]))
    due = np.array([0.0, 0.0, RADIUS / math.cos(slope)])
    return at_end(trajectory, float(np.linalg.norm(trajectory.positions[-1, 0] - due)) / RADIUS)


WEDGE = (
    Criterion(
        "energy",
        "energy never grows",
        1.0,
        "e < 1, smooth planes: impacts only take; a late one is off by g h v",
        grown,
    ),
    Criterion(
        "place", "at rest touching both planes", PART, "the only equilibrium: R/cos(angle) above the edge", off_rest
    ),
)


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "deep_overlap",
        "Is an overlap undone without throwing the balls apart?",
        "2 dimensions, two-way contact",
        deep_overlap,
        lambda _: OVERLAP,
        [{"overlap": x} for x in (0.05, 0.1, 0.25, 0.5, 0.9, 1.0)],
        knob=Knob("overlap", 0.001, 1.0, "log", criteria=("calm",)),
        outcome=overlap_outcome,
    ),
    hard_family(
        "zeno",
        "Does endless bouncing end, and in time?",
        "1 dimension, gravity, one-way impacts",
        zeno,
        lambda _: ZENO,
        [{"bounciness": e} for e in (0.5, 0.8, 0.95)],
        knob=Knob("bounciness", 0.1, 0.99, "linear"),
    ),
    hard_family(
        "wedge",
        "Does a ball come to rest in a groove?",
        "2 dimensions, gravity, two one-way contacts at once",
        wedge,
        lambda _: WEDGE,
        [{"angle": angle} for angle in (30, 45, 60, 75)],
        knob=Knob("angle", 21, 85, "int"),
    ),
)
