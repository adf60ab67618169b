"""The split of an error: runs that carry exactly one kind of it, by a known amount, and none of the others."""

from __future__ import annotations

import numpy as np
import pytest
from impactbench.reports.cell import stack
from impactbench.reports.measures import law_difference, measure
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.flight import discrete_flight
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 240
PARTS = ("error_sampling", "error_integrator", "error_impact_velocity", "error_impact_time", "error_penetration")
# Positions up to 20 lengths from the origin, 500 steps, the instant of an impact as a difference quotient over a step.
ROUND_OFF = 1e-11


def case_of(name: str) -> Case:
    (case,) = select([name])
    return case


FLIGHT = case_of("free_flight[dimension=2]")
WALL = case_of("static_wall[bounciness=0.5]")


def true_run(case: Case) -> Trajectory:
    times = np.arange(round(case.scene.duration / STEP) + 1) * STEP
    states = [case.truths["nc"].state(float(t)) for t in times]
    return stack(times, [state for state in states if state is not None])


def parts(case: Case, trajectory: Trajectory) -> dict[str, float]:
    return {f.measure: f.value for f in measure(case, "nc", trajectory)}


def only(case: Case, trajectory: Trajectory, part: str, value: float) -> None:
    found = parts(case, trajectory)
    assert found[part] == pytest.approx(value, rel=1e-6)
    others = {name: found[name] for name in PARTS if name != part and abs(found.get(name, 0.0)) > ROUND_OFF}
    assert not others


def changed(run: Trajectory, positions: Floats | None = None, velocities: Floats | None = None) -> Trajectory:
    x = run.positions if positions is None else positions
    v = run.velocities if velocities is None else velocities
    return Trajectory(run.times, x, v)


def test_sampling_alone() -> None:
    """Velocities of half a step later than the positions they stand beside: 1/2 h m |g . v| of energy."""
    run, g = true_run(FLIGHT), np.array(FLIGHT.scene.gravity)
    late = run.velocities + g * STEP / 2
    late[0] = run.velocities[0]
    power = late[:, 0] @ g * FLIGHT.scene.bodies[0].mass
    only(
        FLIGHT,
        changed(run, None, late),
        "error_sampling",
        np.abs(power - power[0]).max() * STEP / 2 / FLIGHT.scene.energy,
    )


def test_integrator_alone() -> None:
    """A flight that falls 1 % too fast, velocities and positions alike."""
    run, g = true_run(FLIGHT), np.array(FLIGHT.scene.gravity)
    t = run.times[:, None, None]
    too_fast = changed(run, run.positions + 0.01 * g * t**2 / 2, run.velocities + 0.01 * g * t)
    expected = 0.01 * 9.81 * FLIGHT.scene.duration**2 / 2 / FLIGHT.scene.length
    only(FLIGHT, too_fast, "error_integrator", expected)
    assert parts(FLIGHT, too_fast)["error_discrete"] == pytest.approx(expected)


@pytest.mark.parametrize("velocity_first", [True, False])
def test_euler_is_off_the_parabola_by_its_half_step_and_off_its_own_solution_by_nothing(velocity_first: bool) -> None:
    steps = round(FLIGHT.scene.duration / STEP)
    states = [discrete_flight(FLIGHT.scene, STEP, k, velocity_first) for k in range(steps + 1)]
    found = parts(FLIGHT, stack(np.arange(steps + 1) * STEP, states))
    expected = 9.81 * STEP * FLIGHT.scene.duration / 2 / FLIGHT.scene.length
    assert found["error_integrator"] == pytest.approx(expected, rel=1e-9)
    assert found["error_discrete"] < ROUND_OFF
    assert found["error_sampling"] > 1e-3  # the same half step, seen in the energy


def impact(run: Trajectory) -> int:
    """Last sample before the impact."""
    return int(np.flatnonzero(np.abs(np.diff(run.velocities[:, 0], axis=0)).max(axis=1) > 1e-9)[0])


def test_impact_velocity_alone() -> None:
    """A tenth of the speed after the impact is missing, at the right time and place."""
    run, truth = true_run(WALL), WALL.truths["nc"]
    k, tc = impact(run), truth.impact_times[0]
    x, v = run.positions.copy(), run.velocities.copy()
    at = truth.state(tc)
    assert at is not None
    v[k + 1 :] *= 0.9
    x[k + 1 :] = at.positions + (run.times[k + 1 :, None, None] - tc) * v[k + 1 :]
    # e = 1/2: what is missing is a tenth of half the speed before.
    only(WALL, changed(run, x, v), "error_impact_velocity", 0.05)


def test_impact_time_alone() -> None:
    """The turn comes 0.4 steps early, in front of the wall, with the right velocities."""
    run, truth = true_run(WALL), WALL.truths["nc"]
    early, tc = 0.4 * STEP, truth.impact_times[0]
    before, after = run.velocities[0], run.velocities[-1]
    t = run.times[:, None, None]
    x = np.where(t < tc - early, run.positions[0] + before * t, run.positions[0] + before * (tc - early))
    x = x + np.where(t < tc - early, 0.0, after * (t - tc + early))
    v = np.where(t < tc - early, before, after)
    only(WALL, changed(run, x, v), "error_impact_time", -early * WALL.scene.speed / WALL.scene.length)


def test_penetration_alone() -> None:
    """Four steps after the impact the body is in the wall for one sample; its velocity knows nothing of it."""
    run = true_run(WALL)
    k = impact(run) + 4
    x = run.positions.copy()
    into = -run.velocities[-1, 0] / np.linalg.norm(run.velocities[-1, 0])
    gap = np.linalg.norm(run.positions[k, 0] - WALL.truths["nc"].state(WALL.truths["nc"].impact_times[0]).positions[0])
    x[k, 0] += into * (gap + 0.07 * WALL.scene.length)
    only(WALL, changed(run, x), "error_penetration", 0.07)


def test_the_law_s_part_is_no_contestant_s() -> None:
    """Each law's own run has no part of any kind under that law; what tells the laws apart stands with the case."""
    case = case_of("oblique_wall[angle=60,bounciness=0.5,dimension=2]")
    found = parts(case, true_run(case))
    assert not {name for name in PARTS if abs(found.get(name, 0.0)) > ROUND_OFF}
    assert {f.measure: f.value for f in law_difference(case)}["velocity_difference"] > 0.2
