"""Impacts in sequence between very unequal balls, and at a glance."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.chain import chain_truth
from impactbench.scenarios.laws import impact
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import ZERO, Body, Contact, HalfSpace, Model, Scene, Sphere
from impactbench.scenarios.survival import (
    PART,
    Criterion,
    HardFamily,
    Knob,
    at_end,
    energy_kept,
    hard_family,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Truth

RADIUS = 0.1


def cascade(ratio: float) -> Case:
    """A slow ball hits a row of five, each `ratio` times lighter than the one before; elastic, gaps of 5 cm.

    v_(i+1) = 2 m_i/(m_i + m_(i+1)) v_i: each is up to twice as fast as the one that hit it.
    """
    count, speed, pitch = 6, 0.3, 2 * RADIUS + 0.05
    parameters: Parameters = {"ratio": ratio}
    weights = [ratio ** (count - 1 - i) for i in range(count)]
    scene = Scene(
        name=case_name("cascade", parameters),
        bodies=tuple(
            Body(f"ball {i}", Sphere(RADIUS), m, (i * pitch, 0.0, 0.0), ((0.0 if i else speed), 0.0, 0.0))
            for i, m in enumerate(weights)
        ),
        duration=1.0,
        model=Model((0,)),
        length=speed,
        speed=speed,
        energy=weights[0] * speed**2 / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )
    return Case(scene, dict.fromkeys(scene.laws, chain_truth(scene)))


def cascade_criteria(scene: Scene) -> tuple[Criterion, ...]:
    end = cascade(float(scene.parameters["ratio"])).truths["nc"].state(scene.duration)
    assert end is not None
    due = end.velocities[-1, 0]

    def lightest(_: Scene, trajectory: Trajectory) -> Floats:
        return at_end(trajectory, abs(float(trajectory.velocities[-1, -1, 0]) / due - 1))

    why = "five elastic impacts in sequence (R7-R9) give the last ball the product of 2 m_i/(m_i + m_(i+1)) v"
    return (energy_kept(), Criterion("last", "the last ball leaves with its speed", PART, why, lightest))


def pi_billiard(ratio: float) -> Case:
    """A heavy ball pushes a light one, at rest, against a wall; elastic: floor(pi/atan(1/sqrt(ratio))) collisions.

    G. Galperin, Playing pool with pi, Regular and Chaotic Dynamics 8 (2003): ratio 100^k gives the digits of pi.
    """
    parameters: Parameters = {"ratio": ratio}
    scene = Scene(
        name=case_name("pi_billiard", parameters),
        bodies=(
            Body("wall", HalfSpace((1.0, 0.0, 0.0)), None, ZERO),
            Body("light", Sphere(RADIUS), 1.0, (0.5 + RADIUS, 0.0, 0.0)),
            Body("heavy", Sphere(RADIUS), ratio, (1.0 + 3 * RADIUS, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        ),
        duration=5.0,
        model=Model((0,)),
        length=1.0,
        speed=1.0,
        energy=ratio / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )
    return Case(scene, dict.fromkeys(scene.laws, chain_truth(scene)))


def turns(velocities: Floats) -> int:
    """How often the light ball's direction (left, none, right) changes: at all collisions but perhaps the last."""
    signs = np.sign(np.where(np.abs(velocities) < 1e-9, 0.0, velocities))
    return int((np.diff(signs) != 0).sum())


def pi_criteria(scene: Scene) -> tuple[Criterion, ...]:
    truth = pi_billiard(float(scene.parameters["ratio"])).truths["nc"]
    last = truth.state(scene.duration)
    assert last is not None
    end = last.velocities[1, 0]

    def counted(_: Scene, trajectory: Trajectory) -> Floats:
        states = [s for t in trajectory.times if (s := truth.state(float(t))) is not None]
        due = turns(np.array([s.velocities[0, 0] for s in states]))
        return at_end(trajectory, abs(turns(trajectory.velocities[:, 0, 0]) - due))

    def heavy(_: Scene, trajectory: Trajectory) -> Floats:
        return at_end(trajectory, abs(float(trajectory.velocities[-1, 1, 0]) - end))

    return (
        energy_kept(),
        Criterion(
            "collisions",
            "the light ball turns as often as the exact one, seen at the same instants",
            0.0,
            "Galperin 2003: the number of collisions is exact; samples hide as many of the truth as of the run",
            counted,
        ),
        Criterion("leaves", "the heavy ball leaves with its velocity", PART, "the last of the exact impacts", heavy),
    )


def pi_outcome(_: Scene, trajectory: Trajectory) -> str:
    return f"{turns(trajectory.velocities[:, 0, 0])} turns"


def grazing(depth: float) -> Case:
    """A ball passes one at rest at (1 - depth) of the sum of their radii; elastic, smooth. depth < 0 misses.

    The normal makes cos = 1 - depth with the offset: the impact turns over v_n = v sqrt(1 - (1 - depth)^2).
    """
    speed, offset = 3.0, (1 - depth) * 2 * RADIUS
    parameters: Parameters = {"depth": depth}
    scene = Scene(
        name=case_name("grazing", parameters),
        bodies=(
            Body("ball", Sphere(RADIUS), 1.0, (-0.513, 0.0, offset), (speed, 0.0, 0.0)),
            Body("target", Sphere(RADIUS), 1.0, ZERO),
        ),
        duration=0.4,
        model=Model((0, 2)),
        length=speed * 0.4,
        speed=speed,
        energy=speed**2 / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )
    pieces, times = [opening(scene)], []
    if depth > 0:
        reach = math.sqrt((2 * RADIUS) ** 2 - offset**2)
        times = [(0.513 - reach) / speed]
        normal = np.array([reach, 0.0, -offset]) / (2 * RADIUS)
        before = pieces[0].velocities
        after = impact("nc", (1.0, 1.0), (before[0], before[1]), normal, 1.0)
        pieces.append(pieces[0].then(times[0], velocities=np.array(after)))
    return Case(scene, dict.fromkeys(scene.laws, Truth("trajectory", motion(pieces), tuple(times))))


def grazing_criteria(scene: Scene) -> tuple[Criterion, ...]:
    depth = float(scene.parameters["depth"])
    end = grazing(depth).truths["nc"].state(scene.duration)
    assert end is not None
    # What an impact at this depth, inside or out, changes: v_n = v sqrt(1 - (1 - |depth|)^2).
    change = scene.speed * math.sqrt(1 - (1 - abs(depth)) ** 2)

    def missed(_: Scene, trajectory: Trajectory) -> Floats:
        off = np.linalg.norm(trajectory.velocities[-1] - end.velocities, axis=1).max()
        return at_end(trajectory, float(off) / change)

    why = (
        "the impact changes each velocity by v_n: off by half of that, it is nearer to the other outcome (hit or miss)"
    )
    return (Criterion("hit", "hits where it must and misses where it must", 0.5, why, missed),)


FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "cascade",
        "Is an impact handed on through ever lighter balls?",
        "1 dimension, two-way impacts",
        cascade,
        cascade_criteria,
        [{"ratio": 10.0**k} for k in (0, 1, 2, 3)],
        knob=Knob("ratio", 1.0, 1e6, "log"),
    ),
    hard_family(
        "pi_billiard",
        "Does a stepped engine count the digits of pi?",
        "1 dimension, one-way and two-way impacts",
        pi_billiard,
        pi_criteria,
        [{"ratio": 100.0**k} for k in (0, 1, 2)],
        knob=Knob("ratio", 1.0, 1e5, "log", criteria=("collisions",)),
        outcome=pi_outcome,
    ),
    hard_family(
        "grazing",
        "Is a glancing impact missed, or one seen where there is none?",
        "2 dimensions, two-way impact",
        grazing,
        grazing_criteria,
        [{"depth": depth} for depth in (0.1, 1e-2, 1e-3, 1e-4, 1e-6, -1e-3, -1e-6)],
        knob=Knob("depth", 1e-8, 0.5, "log", breaks="below"),
    ),
)
