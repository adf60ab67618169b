"""Tuned engines realise the law: what is left falls with the step as derived, down to a floor that is known."""

from __future__ import annotations

import pytest
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reports.cell import step_seconds
from impactbench.reports.compare import Plan, compare
from impactbench.reports.results import frame
from impactbench.scenarios.catalogue import select

STEPS = ("1/60", "1/240", "1/960")
PHASES = tuple(k / 8 for k in range(8))
TUNED = ["pybullet/tuned", "mujoco/tuned", "pymunk/tuned"]
IMPACTS = [
    "equal_masses[bounciness=0.5]",
    "static_wall[bounciness=0.5]",
    "oblique_wall[angle=60,bounciness=1,dimension=2]",
]


@pytest.fixture(scope="module")
def worst() -> dict[tuple[str, str, str, str], float]:
    """Largest absolute value over all phases, by case, contestant, step and measure."""
    cases = select([*IMPACTS, "free_flight[dimension=1]"])
    rows = frame(compare(Plan(cases, select_contestants(TUNED), STEPS, phases=PHASES, jobs=2, timing="none"), "test"))
    assert set(rows.state) == {"ok"}
    rows["size"] = rows.value.abs()
    return rows.groupby(["case", "contestant", "step_text", "measure"])["size"].max().to_dict()


@pytest.mark.parametrize("contestant", TUNED)
@pytest.mark.parametrize("case", IMPACTS)
def test_the_position_error_of_an_impact_is_of_first_order(worst, case: str, contestant: str) -> None:
    """An impact is acted on up to one step late, so the worst phase errs by C h, C not depending on h.

    The worst of 8 phases lies between 7/8 and all of it at either step: over a factor 16 in h the errors' ratio is
    between 14 and 18.3.
    """
    ratio = worst[case, contestant, "1/60", "position_error"] / worst[case, contestant, "1/960", "position_error"]
    assert 16 * 7 / 8 <= ratio <= 16 * 8 / 7


@pytest.mark.parametrize("contestant", TUNED)
@pytest.mark.parametrize("case", IMPACTS)
def test_the_law_itself_is_kept_at_every_step(worst, case: str, contestant: str) -> None:
    """Judged with its own velocities before the impact: no step in it. MuJoCo's stiffness leaves some 1e-12."""
    for step in STEPS:
        assert worst[case, contestant, step, "impact_velocity_error"] < 1e-10
        # At most one step late; pymunk and Bullet touch at round-off of the gap, which adds nothing visible.
        assert worst[case, contestant, step, "impact_time_error"] <= step_seconds(step) * (1 + 1e-6)


@pytest.mark.parametrize("contestant", TUNED)
def test_free_flight_errs_by_g_h_t_over_two(worst, contestant: str) -> None:
    """Semi-implicit Euler, whichever of velocity and position goes first: |x - x_true| = g h t / 2."""
    (case,) = select(["free_flight[dimension=1]"])
    scene = case.scene
    for step in STEPS:
        expected = 9.81 * step_seconds(step) * scene.duration / 2 / scene.length
        # Shifted starts move the velocity by round-off only; n steps sum n eps of a few lengths: 1e-11 is ample.
        assert worst[scene.name, contestant, step, "position_error"] == pytest.approx(expected, abs=1e-11)
