"""Many balls: a gas in a box, and a rack of balls that is hit in the middle."""

from __future__ import annotations

import math

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Body, Contact, HalfSpace, Model, Scene, Sphere
from impactbench.scenarios.survival import (
    Criterion,
    HardFamily,
    at_end,
    energy_kept,
    hard_family,
    invariant,
    momentum,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

RADIUS, FILLED = 0.05, 0.2  # m; part of the area that balls cover
PLANE = (0, 2)


def billiard_gas(count: int, seed: int) -> Case:
    """`count` elastic smooth balls in a square box in the plane, of equal speed in random directions.

    They start on a jittered lattice. Some ten impacts a ball take place: 4 r n v 1.13 a second at this density n.
    """
    side = math.sqrt(count * math.pi * RADIUS**2 / FILLED)
    across = math.ceil(math.sqrt(count))
    pitch = side / across
    random = np.random.Generator(np.random.PCG64(seed))
    jitter = 0.9 * (pitch / 2 - RADIUS) * random.uniform(-1, 1, (count, 2))
    heading = random.uniform(0, 2 * math.pi, count)
    cells = np.array([divmod(i, across) for i in range(count)], dtype=np.float64)
    places = (cells + 0.5) * pitch - side / 2 + jitter
    parameters: Parameters = {"count": count, "seed": seed}
    walls = [
        Body(f"wall {axis}{s:+g}", HalfSpace(_along(axis, -s)), None, _along(axis, s * side / 2))
        for axis in PLANE
        for s in (-1.0, 1.0)
    ]
    balls = [
        Body(f"ball {i}", Sphere(RADIUS), 1.0, (float(x), 0.0, float(z)), (math.cos(a), 0.0, math.sin(a)))
        for i, ((x, z), a) in enumerate(zip(places, heading.tolist(), strict=True))
    ]
    scene = Scene(
        name=case_name("billiard_gas", parameters),
        bodies=(*walls, *balls),
        duration=2.0,
        model=Model(PLANE),
        length=2 * RADIUS,
        speed=1.0,
        energy=count / 2,
        contact=Contact(1.0),
        laws=("nc", "doc"),
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def _along(axis: int, value: float) -> tuple[float, float, float]:
    return (value if axis == 0 else 0.0, 0.0, value if axis == 2 else 0.0)


def escaped(scene: Scene, trajectory: Trajectory) -> Floats:
    """How far the furthest centre lies beyond a wall, in radii."""
    half = max(abs(x) for i in scene.statics for x in scene.bodies[i].position)
    return np.asarray((np.abs(trajectory.positions).max(axis=(1, 2)) - half) / RADIUS)


def deepest(_: Scene, trajectory: Trajectory) -> Floats:
    """Deepest overlap of two balls, in radii, at every time."""
    return np.array([2 - closest(x[:, PLANE], 2 * RADIUS) / RADIUS for x in trajectory.positions])


def closest(points: Floats, reach: float) -> float:
    """Least distance of two of the points [n, 2], or `reach` where none is nearer: neighbours in order of x only."""
    ordered = points[np.argsort(points[:, 0], kind="stable")]
    least = reach
    for shift in range(1, len(ordered)):
        apart = ordered[shift:] - ordered[:-shift]
        near = apart[:, 0] < reach
        if not near.any():
            break
        least = min(least, float(np.hypot(*apart[near].T).min()))
    return least


def not_normal(scene: Scene, trajectory: Trajectory) -> Floats:
    """|kurtosis - 3| of the velocity components at the end, next to three standard errors sqrt(24/2N)."""
    v = trajectory.velocities[-1][:, PLANE].ravel()
    kurtosis = float(np.mean(v**4) / max(float(np.mean(v**2)) ** 2, 1e-300))
    return at_end(trajectory, abs(kurtosis - 3) / (3 * math.sqrt(24 / (2 * len(scene.movable)))))


GAS = (
    energy_kept(),
    Criterion("inside", "no centre gets beyond a wall", 0.0, "walls are solid", escaped),
    Criterion("apart", "no centre gets into another ball", 1.0, "overlapped by a radius, a centre is inside", deepest),
    Criterion(
        "maxwell",
        "velocities become normal",
        1.0,
        "equal speeds have kurtosis 1.5, Maxwell's 3: ten impacts a ball mix; 2 N samples scatter by sqrt(24/2N)",
        not_normal,
    ),
)


def simultaneous_break(rows: int, face: str) -> Case:
    """A ball hits a triangle of touching balls, on its point or on its flat face, along the axis of symmetry; b = 1.

    No law of two-body impacts says what comes out (sequential or simultaneous); symmetry, momentum and energy are
    certain.
    """
    radius, speed = 0.1, 3.0
    parameters: Parameters = {"rows": rows, "face": face}
    triangle = [(math.sqrt(3) * radius * k, radius * (2 * i - k)) for k in range(rows) for i in range(k + 1)]
    if face == "flat":
        depth = max(x for x, _ in triangle)
        triangle = [(depth - x, z) for x, z in triangle]
    # The first contact is with the point's ball, or with the two of the face next to the axis.
    near = min(abs(z) for x, z in triangle if x == 0)
    contact = -math.sqrt((2 * radius) ** 2 - near**2)
    bodies = [
        Body("cue", Sphere(radius), 1.0, (contact - 0.513, 0.0, 0.0), (speed, 0.0, 0.0)),
        *(Body(f"ball {i}", Sphere(radius), 1.0, (x, 0.0, z)) for i, (x, z) in enumerate(triangle)),
    ]
    scene = Scene(
        name=case_name("simultaneous_break", parameters),
        bodies=tuple(bodies),
        duration=0.5,
        model=Model(PLANE),
        length=2 * radius,
        speed=speed,
        energy=speed**2 / 2,
        contact=Contact(1.0),
        phase_free=False,
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def lopsided(scene: Scene, trajectory: Trajectory) -> Floats:
    """Largest difference of velocities between a ball and its mirror image, next to the cue's speed."""
    starts = np.array([scene.bodies[i].position for i in scene.movable])
    mirror = starts * [1.0, 1.0, -1.0]
    partner = np.linalg.norm(starts[None] - mirror[:, None], axis=2).argmin(axis=1)
    off = trajectory.velocities - trajectory.velocities[:, partner] * [1.0, 1.0, -1.0]
    return np.asarray(np.abs(off).max(axis=(1, 2)) / scene.speed)


def momentum_lost(scene: Scene, trajectory: Trajectory) -> Floats:
    total = momentum(scene, trajectory)
    return np.asarray(np.linalg.norm(total - total[0], axis=1) / scene.speed)


def break_outcome(scene: Scene, trajectory: Trajectory) -> str:
    end = trajectory.velocities[-1]
    moving = int((np.linalg.norm(end, axis=1) > 1e-6 * scene.speed).sum())
    return f"cue {end[0, 0] / scene.speed:+.3g} v, {moving} of {len(end)} balls move"


ROUND = 1e-9
BREAK = (
    Criterion(
        "symmetric",
        "both halves move alike",
        ROUND,
        "the scene is its own mirror image; round-off of 1e-13, which impacts may amplify ten thousand times",
        lopsided,
    ),
    Criterion("momentum", "momentum is constant", ROUND, "only the balls act on one another", momentum_lost),
    energy_kept(),
)

FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "billiard_gas",
        "Does a gas keep its energy, and become Maxwell's?",
        "2 dimensions, many one-way and two-way impacts",
        billiard_gas,
        lambda _: GAS,
        [{"count": count, "seed": 1} for count in (100, 1000)],
        full=({"count": 3000, "seed": 1},),
        seconds=1500.0,
    ),
    hard_family(
        "simultaneous_break",
        "Is a symmetric hit answered symmetrically?",
        "2 dimensions, two-way impacts of touching balls",
        simultaneous_break,
        lambda _: BREAK,
        [{"rows": 2, "face": "flat"}, {"rows": 2, "face": "point"}, {"rows": 5, "face": "point"}],
        outcome=break_outcome,
    ),
)
