"""Predictability: growth of a known size measured, the horizon it gives, and trajectory errors counted up to it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from impactbench.adapters.contestants import select
from impactbench.reports.cell import step_count
from impactbench.reports.cli import main
from impactbench.reports.measures import measure
from impactbench.reports.page import environment
from impactbench.reports.predictability import ROUNDING, SIZES, Copy, Horizon, growth_of, horizon, judge
from impactbench.reports.predictability_view import text, view
from impactbench.reports.retold import Trial
from impactbench.scenarios import catalogue, hard_chaos
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.hard_chaos import REACH, SPEED, dispersing_billiard, known_until, stretching
from impactbench.scenarios.records import Body, Box
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.truth import Case


def test_the_stretching_is_the_eigenvalue_of_flight_and_mirror() -> None:
    """Flight (x, s) -> (x + s L, s), then a convex mirror (x, s) -> (x, s + 2 x/R)."""
    for ratio in (0.1, 1.0, 5.0):
        step = np.array([[1, 0], [2 / 1.0, 1]]) @ np.array([[1, ratio], [0, 1]])
        assert abs(np.linalg.det(step) - 1) < 1e-12
        assert math.isclose(max(np.linalg.eigvals(step).real), stretching(ratio), rel_tol=1e-12)


@pytest.fixture(scope="module")
def billiard() -> tuple[Case, Horizon]:
    case = dispersing_billiard(1.0)
    return case, horizon(case)


def test_exponential_growth_is_measured_at_its_known_rate(billiard: tuple[Case, Horizon]) -> None:
    """ln(2 + sqrt 3) a bounce. The spread is read as a running maximum, which moves in steps of a bounce: over some 14
    bounces from ten times 1e-12 to 1 % a line through steps is off by less than one step, 1/14.
    """
    case, found = billiard
    expected = math.log(2 + math.sqrt(3)) * SPEED / REACH
    assert found.growth == "exponential"
    assert abs(found.rate / expected - 1) < 1 / 14
    assert found.runner == "reference/exact"
    # What the truth declares comes from the formula, what is measured from copies whose part along the growing
    # direction is random: by less than a factor of ten, that is two bounces.
    assert abs(found.time - case.truths["nc"].horizon) < math.log(10) / found.rate
    assert found.reached


def test_round_off_does_to_the_exact_runner_what_the_horizon_says(billiard: tuple[Case, Horizon]) -> None:
    """Against the closed form: within 1 % up to the declared horizon, far off soon after."""
    case, _ = billiard
    (exact,) = select(["reference/exact"])
    trial = Trial(exact.load(), exact.profile, "nc", case.scene, case.scene.duration / 400)
    run, truth = trial.run(case.scene), case.truths["nc"]
    known = [truth.state(float(time)) for time in run.times]
    off = [
        float(np.linalg.norm(x - state.positions)) / case.scene.length
        for x, state in zip(run.positions, known, strict=True)
        if state is not None
    ]
    within = run.times <= truth.horizon
    assert max(np.array(off)[within]) < 0.01
    assert max(off) > 0.5


def test_growth_in_a_box_of_walls_is_linear_and_has_no_horizon() -> None:
    """Mirror images: a velocity off by d v puts the place off by d v t, no more. Both are off by the same part of
    their scales, so that the spread grows by at most the sum of their directions, V/L a second each along one axis.
    """
    (case,) = catalogue.select(["box_of_walls[dimension=2,hit=faces]"])
    found = horizon(case)
    assert (found.growth, found.reached, found.time) == ("linear", False, case.scene.duration)
    most = case.scene.speed / case.scene.length
    assert 0.5 * most < found.rate <= most * (1 + 1e-6)
    assert found.amplification <= 1 + most * case.scene.duration


def copies(law: object, sizes: tuple[float, ...] = SIZES) -> list[Copy]:
    times = np.linspace(0, 10, 400)
    return [Copy(size, times, np.minimum(np.array([law(t) for t in times]) * size, 1.0)) for size in sizes]  # type: ignore[operator]


def test_laws_of_growth_are_told_apart() -> None:
    name, rate = growth_of(copies(lambda t: math.exp(2 * t)))
    assert name == "exponential"
    assert abs(rate - 2) < 1e-6
    name, rate = growth_of(copies(lambda t: 1 + 40 * t))
    assert name == "linear"
    assert abs(rate - 40) < 1e-6
    assert growth_of(copies(lambda t: 1 + math.sin(t) / 10))[0] == "none"


def test_the_horizon_is_where_round_off_has_grown_to_one_percent() -> None:
    case = dispersing_billiard(1.0)
    scene = replace(case.scene, duration=30.0)
    found = judge(scene, copies(lambda t: math.exp(4 * t)), None, "it")
    # exp(4 t) 2^-50 = 0.01; copies are read every 10/399 s.
    assert abs(found.time - math.log(0.01 / ROUNDING) / 4) < 10 / 399
    # Two steps that disagree earlier end it earlier.
    assert judge(scene, copies(lambda t: math.exp(4 * t)), 1.5, "it").time == 1.5
    # Copies that never get to 1 % go on at their rate.
    slow = judge(scene, copies(lambda t: math.exp(1.5 * t)), None, "it")
    assert abs(slow.time - math.log(0.01 / ROUNDING) / 1.5) < 10 / 399


def test_errors_beyond_the_horizon_do_not_count() -> None:
    """A run that is right up to the horizon and anywhere after: no trajectory error. A truth without one counts it."""
    case = dispersing_billiard(1.0)
    truth, scene = case.truths["nc"], case.scene
    step = 1 / 240
    times = np.arange(step_count(scene, step) + 1) * step
    states = [truth.state(float(t)) for t in times]
    x = np.array([s.positions for s in states if s is not None])
    v = np.array([s.velocities for s in states if s is not None])
    lost = times > truth.horizon
    assert lost.any()
    x[lost] += 0.3
    figures = {f.measure: f.value for f in measure(case, "nc", Trajectory(times, x, v))}
    assert figures["trajectory_error"] < 1e-12
    assert figures["position_error"] < 1e-12
    endless = Case(scene, dict.fromkeys(scene.laws, replace(truth, horizon=math.inf)))
    figures = {f.measure: f.value for f in measure(endless, "nc", Trajectory(times, x, v))}
    assert figures["trajectory_error"] > 0.05


def test_an_error_before_the_horizon_counts() -> None:
    """The stepped runner places each of some 20 impacts up to a step late, v h/L = 1.1 % of the scene."""
    case = dispersing_billiard(1.0)
    (stepped,) = select(["reference/stepped"])
    run = Trial(stepped.load(), stepped.profile, "nc", case.scene, 1 / 240).run(case.scene)
    figures = {f.measure: f.value for f in measure(case, "nc", run)}
    assert figures["trajectory_error"] > 0.011


def test_where_the_reference_cannot_a_contestant_runs_the_copies() -> None:
    (rolling,) = catalogue.select(["rolling_onset[friction=0.3]"])
    slab = Body("slab", Box((9.0, 9.0, 1.0)), None, (0.0, 0.0, -1.0))
    block = Body("block", Box((0.2, 0.2, 0.1)), 1.0, (0.0, 0.0, 0.1), (3.0, 0.0, 0.0))
    space = replace(rolling.scene.model, axes=(0, 1, 2))
    case = replace(rolling, scene=replace(rolling.scene, bodies=(slab, block), model=space))  # box on box, in space
    with pytest.raises(Unsupported, match="name a contestant"):
        horizon(case)
    (mujoco,) = select(["mujoco/tuned"])
    found = horizon(case, contestant=mujoco)
    assert (found.runner, found.reached) == ("mujoco/tuned", False)


def test_known_until_is_reached_within_the_case() -> None:
    for ratio in (0.1, 1.0):
        case = hard_chaos.dispersing_billiard(ratio)
        assert known_until(ratio) < case.scene.duration
        assert case.truths["nc"].horizon == known_until(ratio)


def test_the_command_writes_table_file_and_section(tmp_path: Path) -> None:
    command = ["predictability", "dispersing_billiard[ratio=1]", "--out", str(tmp_path), "--jobs", "1"]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, result.output
    part = json.loads((tmp_path / "predictability.json").read_text())
    (row,) = part["rows"]
    assert row["growth"] == "exponential"
    assert text(part) in result.output
    html = environment().get_template("predictability.html").render(view=view(part))
    assert f"{row['time']:.3g}" in html
