"""Motions with one known fault each, and the figures that the measures must give: closed forms, worked out by hand.

Scales differ from 1 and from each other, masses, radii and axes are unlike, so that nothing cancels by chance. Times
are binary fractions: samples are exact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Law, Model, Scene, Shape, Sphere
from impactbench.scenarios.records import Vector as V
from impactbench.scenarios.trajectory import Floats, State, Trajectory
from impactbench.scenarios.truth import Case, Truth

STEP = 2.0**-8
COUNT = 32
"""Steps of a run [s]; every sample is one of those at which errors are taken."""
TIMES: Floats = np.arange(COUNT + 1, dtype=np.float64) * np.float64(STEP)
END = COUNT * STEP
HIT = 10.5 * STEP
"""Impacts lie in the middle of a step [s]."""
LENGTH, SPEED, ENERGY = 2.0, 5.0, 7.0
HEAVY, LIGHT = 3.0, 1.0
FAULT = 2.0**-10
LOSSLESS = Contact()
EXACT = dict.fromkeys(
    ("position_error", "velocity_error", "trajectory_error", "momentum_drift", "energy_gain", "energy_drift"), 0.0
)
Legs = Sequence[tuple[float, Floats, Floats]]
"""Free flights, each from a time [s], positions and velocities, shapes [n, 3]."""


@dataclass(frozen=True, eq=False)
class Probe:
    """A run of a case under a law, what is wrong with it, and figures that are known; others are not looked at."""

    what: str
    case: Case
    law: Law
    run: Trajectory
    known: dict[str, float]


def probes() -> list[Probe]:
    return [*_apart(), *_turning(), *_falling(), *_wall(), *_walls(), *_pair(), *_overlaps(), *_spinning(), *_sliding()]


def _scene(bodies: Sequence[Body], contact: Contact = LOSSLESS, gravity: V = (0.0, 0.0, 0.0)) -> Scene:
    model = Model((0, 1, 2), gravity=any(gravity), friction=contact.friction > 0)
    return Scene("calibration", tuple(bodies), END, model, LENGTH, SPEED, ENERGY, gravity, contact)


def _balls(positions: Sequence[V], velocities: Sequence[V]) -> list[Body]:
    radii, masses = (0.5, 0.25, 0.25), (LIGHT, HEAVY, HEAVY)
    rows = zip("abc", radii, masses, positions, velocities, strict=False)
    return [Body(name, Sphere(r), m, x, v) for name, r, m, x, v in rows]


def _tuples(rows: Floats) -> list[V]:
    return [(float(x), float(y), float(z)) for x, y, z in rows]


def _case(scene: Scene, truth: Trajectory, impacts: tuple[float, ...] = ()) -> Case:
    def state(time: float) -> State:
        return truth.state(round(time / STEP))

    known = Truth("trajectory", state, impacts)
    return Case(scene, {"doc": known, "nc": known})


def _flown(legs: Legs) -> Trajectory:
    last = [max(k for k, (start, _, _) in enumerate(legs) if start <= time) for time in TIMES]
    x = np.array([legs[k][1] + (time - legs[k][0]) * legs[k][2] for k, time in zip(last, TIMES, strict=True)])
    return Trajectory(TIMES, x, np.array([legs[k][2] for k in last]))


def _changed(run: Trajectory, at: int | slice, row: int, axis: int, dx: float = 0.0, dv: float = 0.0) -> Trajectory:
    x, v = run.positions.copy(), run.velocities.copy()
    x[at, row, axis] += dx
    v[at, row, axis] += dv
    return replace(run, positions=x, velocities=v)


def _apart() -> Iterator[Probe]:
    """Two balls that never meet: every body, axis and sign counts, and the worst moment, not the mean or the last."""
    x, v = np.array([(-1.0, -1.0, -1.0), (1.0, 1.5, 1.0)]), np.array([(-1.0, 2.0, -2.0), (2.0, -1.0, 2.0)])
    run = _flown([(0.0, x, v)])
    case = _case(_scene(_balls(_tuples(x), _tuples(v))), run)
    yield Probe("two balls apart", case, "nc", run, EXACT | {"angular_momentum_drift": 0.0, "penetration_max": 0.0})
    for row, mass in enumerate((LIGHT, HEAVY)):
        for axis in range(3):
            moved = _changed(run, -1, row, axis, dx=FAULT)
            yield Probe(
                f"a displacement, body {row}, axis {axis}", case, "nc", moved,
                {"position_error": FAULT / LENGTH, "trajectory_error": FAULT / np.sqrt(COUNT + 1) / LENGTH},
            )  # fmt: skip
            for sign in (-1, 1):
                gain = mass * ((v[row, axis] + sign * FAULT) ** 2 - v[row, axis] ** 2) / 2 / ENERGY
                known = {
                    "momentum_drift": mass * FAULT / (HEAVY * SPEED), "velocity_error": FAULT / SPEED,
                    "energy_drift": gain, "energy_gain": max(gain, 0.0),
                }  # fmt: skip
                kicked = _changed(run, -1, row, axis, dv=sign * FAULT)
                yield Probe(f"a kick {sign:+d}, body {row}, axis {axis}", case, "nc", kicked, known)
    gain = HEAVY * ((v[1, 0] + FAULT) ** 2 - v[1, 0] ** 2) / 2 / ENERGY
    known = {"momentum_drift": FAULT / SPEED, "energy_gain": gain, "energy_drift": 0.0}
    yield Probe("a kick that comes and goes", case, "nc", _changed(run, slice(9, 17), 1, 0, dv=FAULT), known)


def _turning() -> Iterator[Probe]:
    """Opposite momenta of 1 and 3 kg, 2 m apart: L = 1 * 1.5 * 3 + 3 * 0.5 * 1 = 6. One is faster by FAULT m/s from the
    middle on: the reduced mass, 3/4 kg, times 2 m, times FAULT. The scale is the largest sum of m |r| |v|, then as much
    more.
    """
    places, speeds = [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [(0.0, 3.0, 0.0), (0.0, -1.0, 0.0)]
    run = Trajectory(TIMES, np.array([places] * (COUNT + 1)), np.array([speeds] * (COUNT + 1)))
    case = _case(_scene(_balls(places, speeds)), run)
    for row, sign in ((0, 1), (1, -1)):
        drift = 0.75 * 2 * FAULT
        known = {"angular_momentum_drift": drift / (6 + drift)}
        yield Probe(f"a torque, body {row}", case, "nc", _changed(run, slice(16, None), row, 1, dv=sign * FAULT), known)


def _falling() -> Iterator[Probe]:
    """Free fall by both Euler orders: matched, energy is kept; raw, it is off by (1/2 - f) h M g^2 T, and positions by
    (1/2 - f) g h T, f being the fraction of a step spent with the old velocity.
    """
    start, v0 = np.array([(-1.0, -1.0, 2.0), (1.0, 1.5, 1.0)]), np.array([(-1.0, 2.0, -2.0), (2.0, -1.0, 2.0)])
    g, t = np.array((0.0, 4.0, -3.0)), TIMES[:, None, None]
    truth = Trajectory(TIMES, start + v0 * t + g * t**2 / 2, v0 + g * t)
    scene = _scene(_balls(_tuples(start), _tuples(v0)), gravity=(0.0, 4.0, -3.0))
    for order, f in (("velocity first", 0.0), ("parabola", 0.5), ("position first", 1.0)):
        run = replace(truth, positions=truth.positions + (0.5 - f) * STEP * g * t)
        off = (0.5 - f) * STEP * END
        known = {
            "position_error": abs(off) * 5.0 / LENGTH, "velocity_error": 0.0, "momentum_drift": 0.0,
            "energy_gain": 0.0, "energy_drift": 0.0, "energy_drift_raw": -off * (HEAVY + LIGHT) * 25.0 / ENERGY,
        }  # fmt: skip
        yield Probe(f"free fall, {order}", _case(scene, truth), "nc", run, known)


def _wall() -> Iterator[Probe]:
    """A ball of 3 kg meets a wall at (3, 0, -4) m/s, e = b = 1/2: (3, 0, 2) by Newton, (1.5, 0, 2) by the documents."""
    before, at = np.array([(3.0, 0.0, -4.0)]), np.array([(0.0, 0.0, 0.5)])
    bodies = [
        Body("wall", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0)),
        Body("ball", Sphere(0.5), HEAVY, (-3 * HIT, 0.0, 0.5 + 4 * HIT), (3.0, 0.0, -4.0)),
    ]
    scene = _scene(bodies, Contact(bounciness=0.5))

    def run(x: float, z: float, late: float = 0.0) -> Trajectory:
        meets = at + late * before
        return _flown([(0.0, at - HIT * before, before), (HIT + late, meets, np.array([(x, 0.0, z)]))])

    kept = {"impact_velocity_error": 0.0, "impact_time_error": 0.0, "restitution_error": 0.0}
    cases = {"nc": _case(scene, run(3.0, 2.0), (HIT,)), "doc": _case(scene, run(1.5, 2.0), (HIT,))}
    yield Probe("a wall, Newton's law", cases["nc"], "nc", run(3.0, 2.0), EXACT | kept)
    yield Probe("a wall, the documents' law", cases["doc"], "doc", run(1.5, 2.0), EXACT | kept)
    other = kept | {"impact_velocity_error": 1.5 / 5, "energy_drift": HEAVY * (1.5**2 - 9) / 2 / ENERGY}
    yield Probe("a wall, the other law", cases["nc"], "nc", run(1.5, 2.0), other)
    lively = {
        "restitution_error": 0.01, "impact_velocity_error": 0.04 / 5, "impact_time_error": 0.0, "momentum_drift": 0.0,
        "energy_drift": HEAVY * (2.04**2 - 2**2) / 2 / ENERGY,
    }  # fmt: skip
    yield Probe("a wall, e 2 % too large", cases["nc"], "nc", run(3.0, 2.04), lively)
    pushed = {"momentum_drift": FAULT / SPEED, "restitution_error": 0.0, "impact_velocity_error": FAULT / 5}
    yield Probe("a frictionless wall that pushes sideways", cases["nc"], "nc", run(3.0 + FAULT, 2.0), pushed)
    late = kept | {"impact_time_error": 2 * STEP, "position_error": (4 + 2) * 2 * STEP / LENGTH, "energy_drift": 0.0}
    late["penetration_max"] = (4 * 2 - 2 * 0.5) * STEP / LENGTH
    yield Probe("a wall met two steps late", cases["nc"], "nc", run(3.0, 2.0, 2 * STEP), late)
    far = _changed(run(3.0, 2.0), slice(30, None), 0, 2, dv=FAULT)
    yield Probe("a push far from the wall", cases["nc"], "nc", far, {"momentum_drift": FAULT / SPEED})


def _walls() -> Iterator[Probe]:
    """To and fro between two walls; the first or the second impact takes FAULT of the speed."""
    bodies = [
        Body("left", HalfSpace((1.0, 0.0, 0.0)), None, (0.0, 0.0, 0.0)),
        Body("right", HalfSpace((-1.0, 0.0, 0.0)), None, (1.0 + 40 * STEP, 0.0, 0.0)),
        Body("ball", Sphere(0.5), HEAVY, (0.5 + 4 * HIT, 0.0, 0.0), (-4.0, 0.0, 0.0)),
    ]
    left, right = np.array([(0.5, 0.0, 0.0)]), np.array([(0.5 + 40 * STEP, 0.0, 0.0)])

    def run(first: float, second: float) -> Trajectory:
        speed = np.array([(4.0, 0.0, 0.0)])
        legs = [(0.0, left + HIT * speed, -speed), (HIT, left, first * speed)]
        return _flown([*legs, (HIT + 10 * STEP / first, right, -first * second * speed)])

    case = _case(_scene(bodies), run(1.0, 1.0), (HIT, HIT + 10 * STEP))
    for what, first, second in (("neither", 1.0, 1.0), ("first", 1.0 - FAULT, 1.0), ("second", 1.0, 1.0 - FAULT)):
        known = {"impact_velocity_error": 2 - first - second, "restitution_error": first - 1, "momentum_drift": 0.0}
        known["energy_drift"] = HEAVY * 16 * ((first * second) ** 2 - 1) / 2 / ENERGY
        yield Probe(f"two walls, of which {what} takes energy", case, "nc", run(first, second), known)


def _pair() -> Iterator[Probe]:
    """Balls of 1 and 3 kg, e = b = 1/2, meet along n = (0.6, 0.8, 0) at u = -2 n + t, t = (-0.8, 0.6, 0)."""
    n, t = np.array((0.6, 0.8, 0.0)), np.array((-0.8, 0.6, 0.0))
    u, places = t - 2 * n, np.array([(0.0, 0.0, 0.0), 0.75 * n])
    common = np.array((0.25, -0.5, 1.0))

    def speeds(relative: Floats) -> Floats:
        return np.array([common - HEAVY / (HEAVY + LIGHT) * relative, common + LIGHT / (HEAVY + LIGHT) * relative])

    def run(after: Floats) -> Trajectory:
        return _flown([(0.0, places - HIT * speeds(u), speeds(u)), (HIT, places, speeds(after))])

    start = run(u)
    scene = _scene(_balls(_tuples(start.positions[0]), _tuples(start.velocities[0])), Contact(bounciness=0.5))
    kept = EXACT | dict.fromkeys(("restitution_error", "impact_velocity_error", "angular_momentum_drift"), 0.0)
    newton, documents = _case(scene, run(n + t), (HIT,)), _case(scene, run(n + t / 2), (HIT,))
    yield Probe("a pair, Newton's law", newton, "nc", run(n + t), kept | {"impact_time_error": 0.0})
    yield Probe("a pair, the documents' law", documents, "doc", run(n + t / 2), kept | {"impact_time_error": 0.0})
    lively = {
        "momentum_drift": 0.0, "angular_momentum_drift": 0.0, "restitution_error": 0.02,
        "impact_velocity_error": 0.04 / np.sqrt(5), "energy_drift": 0.75 * (1.04**2 - 1) / 2 / ENERGY,
    }  # fmt: skip
    yield Probe("a pair, e 4 % too large", newton, "nc", run(1.04 * n + t), lively)


SHAPES: tuple[tuple[str, Shape, Shape, V, int, float], ...] = (
    ("ball on a plane", HalfSpace((0.0, 0.0, 1.0)), Sphere(0.25), (0.5, 1.0, 0.25), 2, -1.0),
    ("box on a plane", HalfSpace((0.0, 0.0, 1.0)), Box((1.0, 0.5, 0.25)), (0.5, 1.0, 0.25), 2, -1.0),
    ("ball and box", Box((1.0, 0.5, 0.25)), Sphere(0.25), (0.25, -0.75, 0.125), 1, 1.0),
    ("box and box", Box((1.0, 0.5, 0.25)), Box((0.5, 1.0, 0.5)), (1.5, 0.5, 0.125), 0, -1.0),
    ("capsules side by side", Capsule(0.25, 1.0), Capsule(0.5, 0.5), (0.0, 0.75, 0.5), 1, -1.0),
    ("ball and capsule's end", Capsule(0.25, 1.0), Sphere(0.5), (0.0, 0.0, 1.75), 2, -1.0),
)
"""What, a static shape at the origin, a shape that just touches it, where, and the axis and sense that lead inside."""


def _overlaps() -> Iterator[Probe]:
    """For one sample, or at the end, one of several pairs is FAULT deep."""
    places = [(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), (1.25, 0.0, 0.0)]
    bodies = [*_balls(places, [(0.0, 0.0, 0.0)] * 3), Body("wall", HalfSpace((-1.0, 0.0, 0.0)), None, (1.75, 0.0, 0.0))]
    run = _flown([(0.0, np.array(places), np.zeros((3, 3)))])
    depth = FAULT / LENGTH
    once = {"penetration_max": depth, "penetration_rms": depth / np.sqrt(COUNT + 1), "penetration_final": 0.0}
    # a and b are 1/4 m apart, b and c as well, c and the wall too.
    for what, row, dx in (("first pair", 0, 0.25), ("second pair", 1, 0.25), ("ball and wall", 2, 0.25)):
        deep = _changed(run, 5, row, 0, dx=dx + FAULT)
        yield Probe(f"an overlap, {what}", _case(_scene(bodies), run), "nc", deep, once)
    for what, fixed, moving, place, axis, sense in SHAPES:
        pair = [Body("fixed", fixed, None, (0.0, 0.0, 0.0)), Body("moving", moving, HEAVY, place)]
        run = _flown([(0.0, np.array([place]), np.zeros((1, 3)))])
        deep = _changed(run, slice(None), 0, axis, dx=sense * FAULT)
        known = {"penetration_max": depth, "penetration_final": depth, "position_error": depth}
        yield Probe(f"an overlap, {what}", _case(_scene(pair), run), "nc", deep, known)


def _spinning() -> Iterator[Probe]:
    """A box on its side turns about the world's z, its own y, at 2 rad/s; from the middle on faster by FAULT of it."""
    inertia = HEAVY * (1.0**2 + 0.25**2) / 3
    half = math.sqrt(0.5)
    turned, spin = (half, half, 0.0, 0.0), (0.0, 0.0, 2.0)
    box = Body("box", Box((1.0, 0.5, 0.25)), HEAVY, (0.0, 0.0, 0.0), orientation=turned, spin=spin)
    c, s = np.cos(TIMES), np.sin(TIMES)  # half of 2 rad/s
    turns = half * np.stack([c, c, s, s], axis=1)[:, None]
    spins = np.broadcast_to(np.array(spin), (COUNT + 1, 1, 3))
    scene = replace(_scene([box]), model=Model((0, 1, 2), rotation=True))
    run = Trajectory(TIMES, np.zeros((COUNT + 1, 1, 3)), np.zeros((COUNT + 1, 1, 3)), turns, spins)
    yield Probe("a spin", _case(scene, run), "nc", run, EXACT | {"spin_error": 0.0, "angular_momentum_drift": 0.0})
    faster = spins.copy()
    faster[16:] *= 1 + FAULT
    gain = inertia * 4 * ((1 + FAULT) ** 2 - 1) / 2 / ENERGY
    known = {"energy_gain": gain, "energy_drift": gain, "angular_momentum_drift": FAULT / (1 + FAULT)}
    known["spin_error"] = 2 * FAULT * LENGTH / SPEED
    yield Probe("a spin that grows", _case(scene, run), "nc", replace(run, spins=faster), known)


def _sliding() -> Iterator[Probe]:
    """On a plane with mu = 1/4 at g = 8 m/s^2 a body slows at 2 m/s^2; at 4 m/s^2 half of it no contact can give. At
    rest, FAULT too low.
    """
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    body = Body("body", Sphere(0.5), HEAVY, (0.0, 0.0, 0.5), (1.0, 0.0, 0.0))
    gravity, t = (0.0, 0.0, -8.0), TIMES

    def run(slowing: float) -> Trajectory:
        x, v = np.zeros((COUNT + 1, 1, 3)), np.zeros((COUNT + 1, 1, 3))
        x[:, 0, 0], x[:, 0, 2], v[:, 0, 0] = t - slowing * t**2 / 2, 0.5, 1 - slowing * t
        return Trajectory(TIMES, x, v)

    case = _case(_scene([floor, body], Contact(0.0, friction=0.25), gravity), run(2.0))
    yield Probe("sliding", case, "nc", run(2.0), EXACT | {"penetration_max": 0.0})
    known = {
        "position_error": 2 * END**2 / 2 / LENGTH, "velocity_error": 2 * END / SPEED,
        "momentum_drift": 2 * END / SPEED,
        "energy_drift": HEAVY * ((1 - 4 * END) ** 2 - (1 - 2 * END) ** 2) / 2 / ENERGY,
    }  # fmt: skip
    yield Probe("sliding, friction beyond its cone", case, "nc", run(4.0), known)
    resting = _flown([(0.0, np.array([(0.0, 0.0, 0.5)]), np.zeros((1, 3)))])
    case = _case(_scene([floor, replace(body, velocity=(0.0, 0.0, 0.0))], Contact(0.0), gravity), resting)
    low = _changed(resting, slice(16, None), 0, 2, dx=-FAULT)
    known = {"position_error": FAULT / LENGTH, "penetration_max": FAULT / LENGTH, "momentum_drift": 0.0}
    yield Probe("at rest too low", case, "nc", low, known | {"energy_drift": -HEAVY * 8 * FAULT / ENERGY})
