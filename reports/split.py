"""The error of a run split by where it comes from, under names of one kind and all without dimension.

    error_sampling         positions and velocities of different instants: the energy this offsets, over the scene's
    error_integrator       flight apart from all contacts, against the parabola from its start; spin by its momentum
    error_discrete         the same flight against what Euler's method must leave: round-off, or a fault
    error_impact_velocity  velocities after an impact against the law's, from those measured before it
    error_impact_time      how late the first impact was, in the time the scene's speed takes for its length
    error_penetration      deepest overlap, over the scene's length

The law's own part, the distance of the two laws' truths, belongs to the case and stands in `law_difference`.
Semi-implicit steps show their half step twice, as what it is: an energy offset, and g h T/2 off the parabola.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from impactbench.reports.impacts import PairHistory, episodes, flight_fraction
from impactbench.scenarios.records import Scene
from impactbench.scenarios.trajectory import Flags, Floats, Trajectory

Part = tuple[str, float, float | None, tuple[str, ...]]
"""Name, value, when [s] and between which bodies: a figure's parts."""
MOST_PAIRS = 2000
"""In a crowd nobody flies long; its pairs are not gone through once more."""
SAME = {
    "error_sampling": "offset_energy",
    "error_impact_velocity": "impact_velocity_error",
    "error_penetration": "penetration_max",
}
"""Parts that are a measure of their own already."""


def split(
    scene: Scene,
    trajectory: Trajectory,
    pairs: list[PairHistory],
    known: Mapping[str, Part],
    momenta: Floats | None = None,
) -> Iterator[Part]:
    """The parts this run can give; `known`: its measures by name, `momenta`: of spins [T, n, 3] where modelled."""
    for name, measure in SAME.items():
        if measure in known:
            yield (name, *known[measure][1:])
    if "impact_time_error" in known:
        yield "error_impact_time", known["impact_time_error"][1] * scene.speed / scene.length, None, ()
    if len(pairs) <= MOST_PAIRS and len(trajectory.times) > 1:
        yield from _flight(scene, trajectory, pairs, momenta)


def _flight(scene: Scene, trajectory: Trajectory, pairs: list[PairHistory], momenta: Floats | None) -> Iterator[Part]:
    """Errors at the end of every flight, the largest of them; nothing where nobody flies."""
    times, gravity = trajectory.times, np.array(scene.gravity)
    step = float(times[1] - times[0])
    # Whole numbers are what schemes have: 0 and 1 are Euler's, velocity or position first, 1/2 is the parabola.
    offset = (0.5 - round(2 * flight_fraction(scene, trajectory)) / 2) * step * gravity
    against_parabola, against_euler, where = [], [], []
    for row, clear in enumerate(apart(scene, trajectory, pairs)):
        for first, last in episodes(clear):
            end, long = last + 1, float(times[last + 1] - times[first])
            start = trajectory.positions[first, row] + trajectory.velocities[first, row] * long
            miss = trajectory.positions[end, row] - start - gravity * long**2 / 2
            turned = 0.0 if momenta is None else _turned(momenta[first, row], momenta[end, row])
            against_parabola.append(max(float(np.linalg.norm(miss)) / scene.length, turned))
            against_euler.append(float(np.linalg.norm(miss - offset * long)) / scene.length)
            where.append((float(times[end]), scene.bodies[scene.movable[row]].name))
    if where:
        worst = int(np.argmax(against_parabola))
        yield "error_integrator", against_parabola[worst], where[worst][0], (where[worst][1],)
        yield "error_discrete", max(against_euler), None, ()


def _turned(before: Floats, after: Floats) -> float:
    """Change of a spin momentum, relative to it; nothing turns it in free flight."""
    size = float(np.linalg.norm(before))
    return float(np.linalg.norm(after - before)) / size if size > 0 else 0.0


def apart(scene: Scene, trajectory: Trajectory, pairs: list[PairHistory]) -> Flags:
    """Steps in which a body is out of reach of all others, at both ends, shape [n, T - 1]."""
    steps = np.diff(trajectory.times)
    clear = np.ones((len(scene.movable), len(steps)), dtype=bool)
    row_of = {index: row for row, index in enumerate(scene.movable)}
    for pair in pairs:
        speeds = np.sqrt(np.einsum("ti,ti->t", pair.relative, pair.relative))
        reach = 2 * np.maximum(speeds[:-1], speeds[1:]) * steps + 1e-3 * scene.length
        far = np.minimum(pair.gap[:-1], pair.gap[1:]) > reach
        for index in (pair.a, pair.b):
            if index in row_of:
                clear[row_of[index]] &= far
    return clear
