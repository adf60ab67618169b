"""Figures that others have published of engines, and the scenes they belong to: what `reproduce` compares with.

Both projects print six significant digits (trailing zeros left off), so that more can never be agreed with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from impactbench.scenarios.records import (
    FULL,
    ZERO,
    Body,
    Box,
    Contact,
    HalfSpace,
    Model,
    Scene,
    Sphere,
)

Measure = Literal["energy_square", "position", "angular_momentum", "energy"]
"""energy_square:    mean over steps of (E - E0)^2 [J^2], sampled before each step: the start counts, the end does not.
position:         largest distance from the exact parabola [m].
angular_momentum: largest |L - L0| / |L0|, of the vector.
energy:           largest |E - E0| / |E0|.
"""
UNITS: dict[Measure, str] = {"energy_square": "J^2", "position": "m", "angular_momentum": "1", "energy": "1"}
DIGITS = 6


@dataclass(frozen=True)
class Benchmark:
    """A published test. `copies`: identical bodies that never meet; the scene holds one, the figure counts all."""

    name: str
    project: str
    year: int
    table: str
    question: str
    scene: Scene
    copies: int = 1
    published: dict[str, dict[float, dict[Measure, float]]] = field(default_factory=dict, hash=False)
    """Engine, as the project names it -> step [s] -> figures."""


@dataclass(frozen=True)
class Cell:
    """One published figure; `value` is None where only ours is of interest."""

    benchmark: Benchmark
    engine: str
    step: float
    measure: Measure
    value: float | None


def bouncing_balls(count: int = 1) -> Scene:
    """Balls dropped from a height of 5 m (of their centres) onto a floor that gives all back; 2 m apart."""
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, ZERO)
    balls = [Body(f"ball{i}", Sphere(0.1), 10.0, (0.0, 2.0 * i, 5.0)) for i in range(count)]
    return Scene(
        "published_bouncing",
        (floor, *balls),
        duration=20.0,
        model=Model((2,), gravity=True),
        length=5.0,
        speed=math.sqrt(2 * 9.81 * 4.9),
        energy=count * 10.0 * 9.81 * 5.0,
        gravity=(0.0, 0.0, -9.81),
        contact=Contact(bounciness=1.0),
    )


def tumbling_box() -> Scene:
    """A box thrown up that spins about its middle axis, which is unstable: it tumbles. Nothing to hit."""
    box = Body("box", Box((0.05, 0.2, 0.45)), 10.0, ZERO, velocity=(-2.0, 2.0, 8.0), spin=(0.1, 5.0, 0.1))
    return Scene(
        "published_tumbling",
        (box,),
        duration=10.0,
        model=FULL,
        length=1.0,
        speed=math.sqrt(72.0),
        energy=368.54641666,
        gravity=(0.0, 0.0, -9.8),
    )


def half_step_square(mass: float, gravity: float, step: float, fall: float) -> float:
    """Mean square [J^2] of the half-step offset of semi-implicit Euler, for elastic bounces after a `fall` [m].

    v' = v - g h and z' = z + v' h change the energy by -m (g h)^2 / 2 a step. Velocity changes by -g h a step, so that
    E = E0 + (1/2) m g h v while falling. An impact that turns v = -V into V and then moves by V h raises z, hence E,
    by m g h V: just what keeps that equation true. v runs evenly through [-V, V], V^2 = 2 g fall, so its mean square
    is 2 g fall / 3.
    """
    return (0.5 * mass * gravity * step) ** 2 * 2 * gravity * fall / 3


def half_step_position(gravity: float, step: float, duration: float) -> float:
    """Distance [m] from the parabola after `duration` [s]: each velocity acts a half step early, g h T / 2."""
    return 0.5 * gravity * step * duration


def half_step_energy(mass: float, gravity: float, step: float, duration: float) -> float:
    """Energy [J] lost in free flight: m (g h)^2 / 2 a step (see `half_step_square`), m g^2 h T / 2 in all."""
    return 0.5 * mass * gravity**2 * step * duration


def half_step(benchmark: Benchmark, step: float, measure: Measure) -> float | None:
    """What a perfect solver of impacts and rotation would still score with semi-implicit Euler."""
    scene = benchmark.scene
    body, gravity = scene.bodies[scene.movable[0]], -scene.gravity[2]
    assert body.mass is not None
    mass = benchmark.copies * body.mass
    match measure:
        case "position":
            return half_step_position(gravity, step, scene.duration)
        case "energy":
            return half_step_energy(mass, gravity, step, scene.duration) / scene.energy
        case "energy_square":
            assert isinstance(body.shape, Sphere)
            return half_step_square(mass, gravity, step, body.position[2] - body.shape.radius)
        case "angular_momentum":
            return None


def _squares(figures: dict[float, float]) -> dict[float, dict[Measure, float]]:
    return {step: {"energy_square": value} for step, value in figures.items()}


def _errors(rows: dict[float, tuple[float, float, float]]) -> dict[float, dict[Measure, float]]:
    names: tuple[Measure, ...] = ("position", "angular_momentum", "energy")
    return {step: dict(zip(names, row, strict=True)) for step, row in rows.items()}


BENCHMARKS = (
    Benchmark(
        "bouncing",
        "leggedrobotics/SimBenchmark",
        2018,
        "data/bouncing/sample.csv, e = 1",
        "49 elastic balls fall 5 m and bounce for 20 s: mean square of the energy error",
        bouncing_balls(),
        49,
        {
            "ODE": _squares(
                {4e-4: 29.631, 1e-3: 185.027, 4e-3: 2982.68, 1e-2: 18808.3, 4e-2: 313419.0, 1e-1: 2.03326e6}
            ),
            "Bullet": _squares(
                {4e-4: 12038.5, 1e-3: 75245.4, 4e-3: 1.20178e6, 1e-2: 7.40664e6, 4e-2: 1.19223e8, 1e-1: 7.67704e8}
            ),
        },
    ),
    Benchmark(
        "tumbling",
        "scpeters/benchmark",
        2015,
        "test_results/BENCHMARK_boxes_dt.csv, EnginesDtComplex",
        "a box tumbles in free flight for 10 s: largest errors",
        tumbling_box(),
        1,
        {
            "ODE": _errors({5e-4: (0.0245, 0.00643471, 0.00623355), 1e-3: (0.049, 0.0130708, 0.012462)}),
            "Bullet": _errors({5e-4: (0.0245, 0.00626166, 0.00679101), 1e-3: (0.049, 0.0124501, 0.0135771)}),
        },
    ),
)


def cells() -> Iterator[Cell]:
    """Every published figure, benchmark by benchmark."""
    for benchmark in BENCHMARKS:
        for engine, steps in benchmark.published.items():
            for step, figures in steps.items():
                for measure, value in figures.items():
                    yield Cell(benchmark, engine, step, measure, value)
