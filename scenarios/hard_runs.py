"""The same impact at every phase of a step, or for very long, and a spin that is not stable."""

from __future__ import annotations

import numpy as np
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.pieces import motion, opening
from impactbench.scenarios.records import ZERO, Body, Box, Contact, HalfSpace, Model, Scene, Sphere
from impactbench.scenarios.survival import (
    PART,
    Criterion,
    HardFamily,
    at_end,
    energy_kept,
    hard_family,
    invariant,
    kinetic,
    step_of,
    to_body,
)
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case, Truth

STEP = 1 / 240
RADIUS, SPEED = 0.1, 1.5


def impact_phase(pairs: int) -> Case:
    """Pairs of balls side by side meet head-on, e = .5, each pair a fraction of a step later than the one before."""
    parameters: Parameters = {"pairs": pairs}
    bodies = []
    for k in range(pairs):
        away, z = 0.5 + RADIUS + k / pairs * SPEED * STEP, k - (pairs - 1) / 2
        bodies += [
            Body(f"ball {k} {side}", Sphere(RADIUS), 1.0, (s * away, 0.0, z), (-s * SPEED, 0.0, 0.0))
            for side, s in (("left", -1.0), ("right", 1.0))
        ]
    scene = Scene(
        name=case_name("impact_phase", parameters),
        bodies=tuple(bodies),
        duration=0.6,
        model=Model((0,)),
        length=2 * SPEED,
        speed=2 * SPEED,
        energy=pairs * SPEED**2,
        contact=Contact(0.5),
        parameters=parameters,
    )
    pieces, times = [opening(scene)], []
    for k in range(pairs):
        times.append((0.5 + k / pairs * SPEED * STEP) / SPEED)
        turned = pieces[-1].velocities.copy()
        turned[2 * k : 2 * k + 2] *= -0.5
        pieces.append(pieces[-1].then(times[-1], velocities=turned))
    return Case(scene, dict.fromkeys(scene.laws, Truth("trajectory", motion(pieces), tuple(times))))


def rebounds(scene: Scene, trajectory: Trajectory) -> Floats:
    """Separation speed of every pair at the end, next to its approach."""
    x = trajectory.velocities[-1, :, 0]
    return np.asarray((x[1::2] - x[::2]) / scene.speed)


def spread(scene: Scene, trajectory: Trajectory) -> Floats:
    return at_end(trajectory, float(np.ptp(rebounds(scene, trajectory))))


def phase_outcome(scene: Scene, trajectory: Trajectory) -> str:
    found = rebounds(scene, trajectory)
    return f"e {found.min():.4g} to {found.max():.4g}"


LONG_ROOM, LONG_SPEED = 0.3137, 24.07  # m, m/s: three steps and a bit a bounce, so that phases do not repeat


def long_run(bounces: int) -> Case:
    """A ball between two fixed walls, b = 1: its speed never changes."""
    parameters: Parameters = {"bounces": bounces}
    half = LONG_ROOM / 2 + RADIUS
    walls = [Body(f"wall {s:+g}", HalfSpace((-s, 0.0, 0.0)), None, (s * half, 0.0, 0.0)) for s in (-1.0, 1.0)]
    scene = Scene(
        name=case_name("long_run", parameters),
        bodies=(*walls, Body("ball", Sphere(RADIUS), 1.0, (0.0, 0.0, 0.0), (LONG_SPEED, 0.0, 0.0))),
        duration=bounces * LONG_ROOM / LONG_SPEED,
        model=Model((0,)),
        length=LONG_ROOM,
        speed=LONG_SPEED,
        energy=LONG_SPEED**2 / 2,
        contact=Contact(1.0),
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def outside(scene: Scene, trajectory: Trajectory) -> Floats:
    """How far the centre lies beyond its room, next to the travel of one step."""
    return np.asarray((np.abs(trajectory.positions[:, 0, 0]) - LONG_ROOM / 2) / (scene.speed * step_of(trajectory)))


def hits(trajectory: Trajectory) -> int:
    return int((np.diff(np.sign(trajectory.velocities[:, 0, 0])) != 0).sum())


def too_few(scene: Scene, trajectory: Trajectory) -> Floats:
    """Bounces due at the slowest next to those made: each may cost the way through a step's overlap and back."""
    due = trajectory.times[-1] * scene.speed / (LONG_ROOM + 2 * scene.speed * step_of(trajectory)) - 1
    return at_end(trajectory, due / max(hits(trajectory), 1))


LONG = (
    energy_kept("b = 1 against fixed walls: the speed never changes"),
    Criterion("inside", "the ball stays between the walls", 1.0, "found out a step late, it overlaps by v h", outside),
    Criterion(
        "bounces",
        "it bounces as often as it must",
        1.0,
        "one way of the room and twice a step's overlap per bounce",
        too_few,
    ),
)


def drift_outcome(scene: Scene, trajectory: Trajectory) -> str:
    energies, count = kinetic(scene, trajectory), hits(trajectory)
    return f"{count} bounces, energy {(energies[-1] - energies[0]) / scene.energy / max(count, 1):+.2g} a bounce"


def tumbling_box(offset: float) -> Case:
    """A free box spins about its middle axis, `offset` of the spin about the others: it turns over again and again.

    Energy and the angular momentum vector are constant (Euler); the axis is not.
    """
    parameters: Parameters = {"offset": offset}
    spin, half = 5.0, (0.05, 0.2, 0.45)
    box = Body("box", Box(half), 10.0, ZERO, spin=(spin * offset, spin, spin * offset))
    scene = Scene(
        name=case_name("tumbling_box", parameters),
        bodies=(box,),
        duration=20.0,
        model=Model((0, 1, 2), rotation=True),
        length=2 * half[2],
        speed=spin * half[2],
        energy=box.principal_inertia()[1] * spin**2 / 2,
        collide=False,
        parameters=parameters,
    )
    return Case(scene, invariant(scene))


def spin_drift(scene: Scene, trajectory: Trajectory) -> Floats:
    """|L - L0|/|L0| of the angular momentum in world axes."""
    assert trajectory.orientations is not None
    assert trajectory.spins is not None
    q = trajectory.orientations[:, 0]
    inertia = np.array(scene.bodies[scene.movable[0]].principal_inertia())
    own = inertia * to_body(q, trajectory.spins[:, 0])
    world = to_body(q * np.array([1.0, -1.0, -1.0, -1.0]), own)
    return np.asarray(np.linalg.norm(world - world[0], axis=1) / np.linalg.norm(world[0]))


TUMBLE = (
    energy_kept("no forces: energy is constant, wherever the axis goes"),
    Criterion("spin", "the angular momentum vector stays within 1 %", PART, "no torques: L is constant", spin_drift),
)

FAMILIES: tuple[HardFamily, ...] = (
    hard_family(
        "impact_phase",
        "Does the rebound depend on where in its step an impact falls?",
        "1 dimension, two-way impacts",
        impact_phase,
        lambda _: (
            Criterion("spread", "every phase rebounds alike", PART, "a step is not in the scene: e is e", spread),
        ),
        [{"pairs": 32}],
        outcome=phase_outcome,
    ),
    hard_family(
        "long_run",
        "Does the speed drift over many bounces?",
        "1 dimension, one-way impacts",
        long_run,
        lambda _: LONG,
        [{"bounces": 10**k} for k in (3, 5)],
        full=({"bounces": 10**6},),
        outcome=drift_outcome,
        seconds=900.0,
    ),
    hard_family(
        "tumbling_box",
        "What do energy and angular momentum do where the axis of spin is not stable?",
        "3 dimensions with rotation, no contact",
        tumbling_box,
        lambda _: TUMBLE,
        [{"offset": offset} for offset in (1e-3, 0.02)],
    ),
)
