"""The measures, judged on runs whose every figure is known: the truth itself, and the truth with one fault of a
known size.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from impactbench.reports.cell import median_ranks, stack, step_seconds
from impactbench.reports.geometry import Placed, gap
from impactbench.reports.measures import law_difference, measure
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Law, Sphere
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 240
ZERO = (
    "position_error",
    "velocity_error",
    "trajectory_error",
    "momentum_drift",
    "angular_momentum_drift",
    "energy_drift",
    "energy_gain",
    "impact_velocity_error",
    "impact_time_error",
    "restitution_error",
    "penetration_max",
    "error_sampling",
    "error_integrator",
    "error_discrete",
    "error_impact_velocity",
    "error_penetration",
)
# A run of n steps sums n terms of the scale 1, each rounded to eps: n eps = 480 * 2.2e-16 = 1.1e-13. Positions up to 10
# lengths from the origin enter the impact's instant as a difference quotient over one step: 10 eps / step = 5e-13.
ROUND_OFF = 1e-12


def case_of(name: str) -> Case:
    (case,) = select([name])
    return case


def true_run(case: Case, law: Law) -> Trajectory:
    times = np.arange(round(case.scene.duration / STEP) + 1) * STEP
    states = [case.truths[law].state(float(t)) for t in times]
    return stack(times, [state for state in states if state is not None])


def figures(case: Case, law: Law, trajectory: Trajectory, delay: float = 0.0) -> dict[str, float]:
    return {figure.measure: figure.value for figure in measure(case, law, trajectory, delay)}


TRUE_RUNS = [
    (case, law)
    for case in select([])
    for law, truth in case.truths.items()
    if truth.kind == "trajectory" and not case.scene.model.friction and not case.scene.model.rotation
]


@pytest.mark.parametrize(("case", "law"), TRUE_RUNS, ids=[f"{case.scene.name}-{law}" for case, law in TRUE_RUNS])
def test_a_perfect_run_scores_zero_in_every_measure(case: Case, law: Law) -> None:
    found = figures(case, law, true_run(case, law))
    nonzero = {name: found[name] for name in ZERO if abs(found.get(name, 0.0)) > ROUND_OFF}
    assert not nonzero


def test_the_other_law_is_not_mistaken_for_this_one() -> None:
    case = case_of("oblique_wall[angle=60,bounciness=0.5,dimension=2]")
    found = figures(case, "nc", true_run(case, "doc"))
    # b = 1/2: the tangential speed halves under the documents' law and stays under Newton's.
    assert found["impact_velocity_error"] > 0.2
    assert abs(found["restitution_error"]) < ROUND_OFF
    differences = {figure.measure: figure.value for figure in law_difference(case)}
    assert differences["velocity_difference"] > 0.2


def leak(trajectory: Trajectory, factor: float) -> Trajectory:
    """Every velocity in the second half scaled."""
    half = len(trajectory.times) // 2
    velocities = trajectory.velocities.copy()
    velocities[half:] *= factor
    return replace(trajectory, velocities=velocities)


def test_an_energy_leak_is_measured_with_its_sign_and_size() -> None:
    case = case_of("equal_masses[bounciness=1]")
    run = true_run(case, "nc")
    energy = 0.5 * sum(body.mass * np.dot(body.velocity, body.velocity) for body in case.scene.bodies if body.mass)
    lost = figures(case, "nc", leak(run, 1 - 1e-3))
    gained = figures(case, "nc", leak(run, 1 + 1e-3))
    assert lost["energy_drift"] == pytest.approx(((1 - 1e-3) ** 2 - 1) * energy / case.scene.energy, rel=1e-9)
    assert lost["energy_gain"] < ROUND_OFF
    assert gained["energy_gain"] == pytest.approx(((1 + 1e-3) ** 2 - 1) * energy / case.scene.energy, rel=1e-9)


def test_a_momentum_leak_is_seen_beside_a_wall_that_could_not_have_caused_it() -> None:
    case = case_of("oblique_wall[angle=60,bounciness=1,dimension=2]")
    run = true_run(case, "nc")
    velocities = run.velocities.copy()
    speed = float(np.linalg.norm(velocities[0, 0]))
    velocities[len(velocities) // 2 :, 0, case.scene.model.axes[0]] += 1e-6 * speed
    found = figures(case, "nc", replace(run, velocities=velocities))
    assert found["momentum_drift"] == pytest.approx(1e-6, rel=1e-3)


def test_a_late_impact_shows_in_time_and_not_in_the_law() -> None:
    """The same run, everything two steps late: the law is kept, the instant is not."""
    case = case_of("static_wall[bounciness=0.5]")
    delay = 2 * STEP
    found = figures(case, "nc", true_run(case, "nc"), delay=-delay)
    assert found["impact_velocity_error"] < ROUND_OFF
    assert found["impact_time_error"] == pytest.approx(delay, abs=ROUND_OFF)


@pytest.mark.parametrize(("order", "alpha"), [("velocity first", 0.0), ("position first", 1.0)])
def test_the_half_step_offset_is_separated_from_drift(order: str, alpha: float) -> None:
    """Both Euler orders in free fall keep their own energy exactly; raw, they differ by 1/2 g h v."""
    case = case_of("free_flight[dimension=1]")
    body, g = case.scene.bodies[0], np.array(case.scene.gravity)
    steps = round(case.scene.duration / STEP)
    times = np.arange(steps + 1) * STEP
    positions, velocities = [np.array(body.position)], [np.array(body.velocity)]
    for _ in range(steps):
        new = velocities[-1] + g * STEP
        positions.append(positions[-1] + STEP * (alpha * velocities[-1] + (1 - alpha) * new))
        velocities.append(new)
    run = Trajectory(times, np.array(positions)[:, None], np.array(velocities)[:, None])
    found = figures(case, "nc", run)
    speed_change = float(g @ g) * case.scene.duration
    expected = (0.5 - alpha) * STEP * (body.mass or 0.0) * speed_change / case.scene.energy
    assert abs(found["energy_drift"]) < ROUND_OFF
    assert found["energy_drift_raw"] == pytest.approx(-expected, rel=1e-9)
    assert found["energy_gain"] < ROUND_OFF


PLACES: list[tuple[str, Body, Body, float, Floats]] = [
    (
        "spheres",
        Body("a", Sphere(0.5), 1.0, (0, 0, 0)),
        Body("b", Sphere(0.25), 1.0, (0, 2, 0)),
        1.25,
        np.array([0.0, 1, 0]),
    ),
    (
        "sphere on plane",
        Body("a", HalfSpace((0, 0, 2.0)), None, (0, 0, 1)),
        Body("b", Sphere(0.25), 1.0, (3, 1, 1.2)),
        -0.05,
        np.array([0, 0, 1.0]),
    ),
    (
        "box on plane, turned 45 degrees about y",
        Body("a", HalfSpace((0, 0, 1)), None, (0, 0, 0)),
        Body("b", Box((1, 1, 1)), 1.0, (0, 0, 2), orientation=(math.cos(math.pi / 8), 0, math.sin(math.pi / 8), 0)),
        2 - math.sqrt(2),
        np.array([0, 0, 1.0]),
    ),
    (
        "sphere beside box",
        Body("a", Sphere(0.5), 1.0, (-2, 0, 0)),
        Body("b", Box((1, 1, 1)), None, (0, 0, 0)),
        0.5,
        np.array([1.0, 0, 0]),
    ),
    (
        "sphere's centre inside box",
        Body("a", Sphere(0.5), 1.0, (-0.75, 0, 0)),
        Body("b", Box((1, 1, 1)), None, (0, 0, 0)),
        -0.75,
        np.array([1.0, 0, 0]),
    ),
    (
        "sphere at a box's corner",
        Body("a", Sphere(0.5), 1.0, (2, 2, 2)),
        Body("b", Box((1, 1, 1)), None, (0, 0, 0)),
        math.sqrt(3) - 0.5,
        -np.ones(3) / math.sqrt(3),
    ),
    (
        "boxes overlapping by a tenth",
        Body("a", Box((1, 1, 1)), 1.0, (0, 0, 0)),
        Body("b", Box((1, 2, 1)), 1.0, (0.5, 2.9, 0)),
        -0.1,
        np.array([0, 1.0, 0]),
    ),
    (
        "capsules, crossed",
        Body("a", Capsule(0.25, 1.0), 1.0, (0, 0, 0)),
        Body("b", Capsule(0.25, 1.0), 1.0, (0, 1, 0), orientation=(math.sqrt(0.5), 0, math.sqrt(0.5), 0)),
        0.5,
        np.array([0, 1.0, 0]),
    ),
]


@pytest.mark.parametrize(("what", "a", "b", "distance", "normal"), PLACES, ids=[place[0] for place in PLACES])
def test_gaps_and_normals_from_geometry(what: str, a: Body, b: Body, distance: float, normal: Floats) -> None:
    placed = [Placed(x.shape, np.array([x.position], float), np.array([x.orientation], float)) for x in (a, b)]
    found, direction = gap(*placed)
    assert found[0] == pytest.approx(distance, abs=1e-14)  # some ten round-offs of coordinates up to 3
    assert direction[0] == pytest.approx(normal, abs=1e-14)
    swapped, opposite = gap(*placed[::-1])
    assert swapped[0] == pytest.approx(distance, abs=1e-14)
    assert opposite[0] == pytest.approx(-normal, abs=1e-14)


def test_the_interval_of_the_median_is_the_binomial_one() -> None:
    # n = 10: 2 (C(10,0) + C(10,1)) / 2^10 = 0.0215 <= 0.05, one rank further in 0.109: the second and the ninth value.
    assert median_ranks(10) == (1, 8)
    assert median_ranks(5) == (0, 4)
    assert median_ranks(1) == (0, 0)


@pytest.mark.parametrize("text", ["0", "-1/60", "nan", "inf", "1/0", "two", "", "2"])
def test_a_step_that_is_no_step_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="write it as 1/240"):
        step_seconds(text)


def test_the_deepest_overlap_of_any_pair_is_the_penetration() -> None:
    """One ball of three pushed 0.02 m into its neighbour for one sample: the other pairs stay apart."""
    case = case_of("newtons_cradle[count=3,gap=0.01]")
    run = true_run(case, "nc")
    positions = run.positions.copy()
    first, second = (case.scene.bodies[index] for index in case.scene.movable[:2])
    assert isinstance(first.shape, Sphere)
    assert isinstance(second.shape, Sphere)
    # Sample 0, the first ball at rest or moving: put it where the centres are 0.02 m closer than the radii allow.
    positions[0, 0] = positions[0, 1] - np.array([first.shape.radius + second.shape.radius - 0.02, 0, 0])
    found = figures(case, "nc", replace(run, positions=positions))
    depth = 0.02 / case.scene.length
    assert found["penetration_max"] == pytest.approx(depth, rel=1e-12)
    assert found["penetration_rms"] == pytest.approx(depth / math.sqrt(len(run.times)), rel=1e-12)
    assert found["penetration_final"] < ROUND_OFF
