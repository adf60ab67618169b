"""Every body, axis, pair, impact and moment counts: one fault of a known size in each in turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from impactbench.reports.cell import stack
from impactbench.reports.measures import measure
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.records import Body, Scene
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 240


def run_of(name: str) -> tuple[Case, Trajectory]:
    (case,) = select([name])
    times = np.arange(round(case.scene.duration / STEP) + 1) * STEP
    states = [case.truths["nc"].state(float(t)) for t in times]
    return case, stack(times, [state for state in states if state is not None])


def figures(case: Case, trajectory: Trajectory) -> dict[str, float]:
    return {figure.measure: figure.value for figure in measure(case, "nc", trajectory)}


def movable(scene: Scene) -> list[Body]:
    return [scene.bodies[i] for i in scene.movable]


PAIR = "oblique_pair[offset=0.25,bounciness=1]"


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("row", [0, 1])
def test_a_displacement_of_any_body_along_any_axis_is_a_position_error(row: int, axis: int) -> None:
    case, run = run_of(PAIR)
    moved = run.positions.copy()
    moved[-1, row, axis] += 1e-3
    found = figures(case, replace(run, positions=moved))
    assert found["position_error"] == pytest.approx(1e-3 / case.scene.length, rel=1e-9)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("row", [0, 1])
def test_a_kick_of_any_body_along_any_axis_is_a_momentum_drift(row: int, axis: int, sign: int) -> None:
    case, run = run_of(PAIR)
    mass = np.array([body.mass for body in movable(case.scene)], dtype=float)
    kicked = run.velocities.copy()
    kicked[-1, row, axis] += sign * 1e-6
    scale = max((np.linalg.norm(kicked, axis=2) @ mass).max(), mass.max() * case.scene.speed)
    found = figures(case, replace(run, velocities=kicked))
    assert found["momentum_drift"] == pytest.approx(mass[row] * 1e-6 / scale, rel=1e-6)


def test_energy_that_comes_and_goes_is_a_gain() -> None:
    case, run = run_of("free_flight[dimension=3]")
    case = replace(case, scene=replace(case.scene, gravity=(0.0, 0.0, 0.0)))
    velocities = np.broadcast_to(run.velocities[:1], run.velocities.shape).copy()
    energy = movable(case.scene)[0].mass * np.dot(velocities[0, 0], velocities[0, 0]) / 2  # type: ignore[operator]
    velocities[50:100] *= 1.001
    found = figures(case, replace(run, velocities=velocities))
    assert found["energy_gain"] == pytest.approx(2.001e-3 * energy / case.scene.energy, rel=1e-9)


@pytest.mark.parametrize("first", [0, 1])
def test_any_pair_that_overlaps_is_a_penetration(first: int) -> None:
    case, run = run_of("newtons_cradle[count=3,gap=0.01]")
    a, b = movable(case.scene)[first : first + 2]
    (axis,) = case.scene.model.axes
    reach = a.shape.radius + b.shape.radius  # type: ignore[union-attr]
    moved = run.positions.copy()
    # For one step the outer ball of the pair stands 1e-4 m deep in the middle one.
    outer, inner = (0, 1) if first == 0 else (2, 1)
    side = np.sign(moved[1, outer, axis] - moved[1, inner, axis])
    moved[1, outer, axis] = moved[1, inner, axis] + side * (reach - 1e-4)
    found = figures(case, replace(run, positions=moved))
    assert found["penetration_max"] == pytest.approx(1e-4 / case.scene.length, rel=1e-9)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_any_impact_that_breaks_the_law_is_an_impact_error(number: int) -> None:
    case, run = run_of("box_of_walls[dimension=2,hit=faces]")
    slower = run.velocities.copy()
    slower[run.times > case.truths["nc"].impact_times[number]] *= 1 - 1e-3
    found = figures(case, replace(run, velocities=slower))
    assert found["impact_velocity_error"] == pytest.approx(1e-3, rel=1e-6)


def test_spin_has_energy() -> None:
    case, run = run_of("torque_free_spin[body=prism]")
    (body,) = movable(case.scene)
    assert body.orientation == (1.0, 0.0, 0.0, 0.0)  # axes of inertia are the world's at t = 0, and energy is conserved
    energy = 0.5 * float(np.array(body.principal_inertia()) @ np.square(body.spin))
    assert run.spins is not None
    faster = run.spins.copy()
    faster[len(faster) // 2 :] *= 1.001
    found = figures(case, replace(run, spins=faster))
    assert found["energy_gain"] == pytest.approx(2.001e-3 * energy / case.scene.energy, rel=1e-6)


def test_angular_momentum_is_weighted_by_mass() -> None:
    """Opposite sideways momenta of 1 and 3 kg, that far apart: nothing but angular momentum changes."""
    (case,) = select([PAIR])
    a, b = movable(case.scene)
    scene = replace(case.scene, bodies=(replace(a, mass=1.0), replace(b, mass=3.0)), collide=False)
    times = np.arange(11) * STEP
    x = np.array([[[-1.0, 0, 0], [1.0, 0, 0]]] * 11)
    v = np.array([[[0.0, 3.0, 0], [0.0, -1.0, 0]]] * 11)
    v[5:] *= 1.001  # L = 1 kg * 1.5 m * 3 m/s + 3 kg * 0.5 m * 1 m/s = 6, all of it of one sign
    found = figures(replace(case, scene=scene), Trajectory(times, x, v))
    assert found["angular_momentum_drift"] == pytest.approx(1e-3 / 1.001, rel=1e-9)
    v[5:, 0], v[5:, 1] = (0.0, 3.0, 0.0), (0.0, -1.0, 0.0)
    v[5:, 1, 1] += 1e-3  # 3 g m/s, 1.5 m from the common centre once its own motion is taken out: m_r 2 m 1e-3
    found = figures(replace(case, scene=scene), Trajectory(times, x, v))
    assert found["angular_momentum_drift"] == pytest.approx(0.75 * 2 * 1e-3 / 6, rel=1e-3)
