"""Verdicts: a run of the truth passes every check, one with a known fault fails the check of its law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from impactbench.reports.budget_formulas import Setting
from impactbench.reports.budgets import CHECKS
from impactbench.reports.cell import stack, step_count
from impactbench.reports.measures import measure
from impactbench.reports.verdicts import Verdict, exit_code, judge
from impactbench.scenarios.catalogue import all_cases, select
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.truth import Case

STEP = 1 / 240


def true_run(case: Case) -> Trajectory:
    truth = case.truths["nc"]
    times = np.arange(step_count(case.scene, STEP) + 1) * STEP
    states = [truth.state(float(time)) for time in times]
    return stack(times, [state for state in states if state is not None])


def judged(case: Case, trajectory: Trajectory) -> dict[str, Verdict]:
    figures = {figure.measure: figure.value for figure in measure(case, "nc", trajectory)}
    return {verdict.check: verdict for verdict in judge(case, "nc", "1/240", figures)}


@pytest.mark.parametrize("name", ["static_wall[bounciness=0.5]", "oblique_pair[offset=0.5,bounciness=0.5]"])
def test_a_run_of_the_truth_passes_every_check(name: str) -> None:
    (case,) = select([name])
    verdicts = judged(case, true_run(case))
    assert {v.status for v in verdicts.values()} <= {"passed", "excused"}
    assert {"momentum", "energy-gain", "energy-loss", "penetration", "restitution", "impact"} <= {
        name for name, v in verdicts.items() if v.status == "passed"
    }


def test_a_momentum_leak_of_a_millionth_fails_momentum() -> None:
    (case,) = select(["equal_masses[bounciness=1]"])
    run = true_run(case)
    leak = np.where(run.times[:, None] > 0.5, 1 + 1e-6, 1.0)[:, :, None]
    verdicts = judged(case, replace(run, velocities=run.velocities * leak))
    assert verdicts["momentum"].status == "failed"
    assert verdicts["momentum"].value == pytest.approx(1e-6, rel=1e-3)


def test_every_budget_is_a_number_and_grows_with_the_step() -> None:
    """First-order terms grow with h; round-off, where it is all there is, falls with the number of steps."""
    for case in all_cases():
        for law in case.scene.laws:
            for check in CHECKS:
                if not check.excused(case, law):
                    fine, coarse = (check.budget(Setting(case, law, step)) for step in (1 / 960, 1 / 30))
                    assert 0 < fine < np.inf, (check.name, case.scene.name)
                    assert coarse > fine or coarse < 1e-10, (check.name, case.scene.name)


def verdict(status: str, contestant: str = "mujoco/tuned") -> Verdict:
    return Verdict("momentum", "case", "nc", contestant, "minimal", "1/240", 0.0, status)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("statuses", "code"),
    [
        (["passed", "unsupported", "excused"], 0),
        (["passed", "failed", "error"], 1),
        (["passed", "error"], 3),
        (["unsupported", "excused"], 5),
        ([], 5),
        (["passed", "incomparable"], 4),
        (["error", "incomparable"], 3),
        (["failed", "incomparable"], 1),
        (["unsupported", "incomparable"], 4),
        (["passed", "unavailable"], 0),
    ],
)
def test_exit_codes_have_an_order(statuses: list[str], code: int) -> None:
    assert exit_code([verdict(status) for status in statuses]) == code


def test_an_engine_that_was_asked_for_and_is_missing_could_not_be_measured() -> None:
    assert exit_code([verdict("passed"), verdict("unavailable")], asked=["mujoco/tuned"]) == 3
