"""Tuned engines realise the law: what is left falls with the step as derived, down to a floor that is known."""

from __future__ import annotations

from typing import Any

import pytest
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reports.cell import step_seconds
from impactbench.reports.compare import Plan, compare
from impactbench.reports.page_data import order
from impactbench.reports.page_view import View
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


@pytest.mark.parametrize("contestant", TUNED)
@pytest.mark.parametrize("case", IMPACTS)
def test_the_time_of_an_impact_is_of_first_order(worst, case: str, contestant: str) -> None:
    """Found at the first step that overlaps: up to h late, the worst of 8 phases between 7/8 h and h at either step."""
    ratio = worst[case, contestant, "1/60", "impact_time_error"] / worst[case, contestant, "1/960", "impact_time_error"]
    assert 16 * 7 / 8 <= ratio <= 16 * 8 / 7


@pytest.mark.parametrize("contestant", TUNED)
def test_flight_is_split_into_its_half_step_and_nothing_else(worst, contestant: str) -> None:
    """Against the parabola g h T / 2 of the scene's length, at every step; against Euler's own solution round-off."""
    (case,) = select(["free_flight[dimension=1]"])
    for step in STEPS:
        expected = 9.81 * step_seconds(step) * case.scene.duration / 2 / case.scene.length
        assert worst[case.scene.name, contestant, step, "error_integrator"] == pytest.approx(expected, abs=1e-11)
        assert worst[case.scene.name, contestant, step, "error_discrete"] < 1e-11


def orders(case: str, contestants: list[str], steps: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    plan = Plan(select([case]), select_contestants(contestants), steps, timing="none")
    found = {policy: order(line) for policy, line in View(compare(plan, "test")).of(case).items()}
    assert all(found.values())
    return {policy: fit for policy, fit in found.items() if fit}


def test_runge_kutta_turns_with_order_four_and_euler_with_order_one() -> None:
    """A free prism: the error of the spin, at steps where it is 3e-10 and more, above a hundred round-offs.

    A fit of order p over steps that halve errs by the next order's share, h L w ~ 0.1 at 1/60 s and falling: within a
    tenth of p.
    """
    steps = ("1/60", "1/120", "1/240", "1/480")
    found = orders("torque_free_spin[body=prism]", ["mujoco/rk4", "mujoco/tuned"], steps)
    assert found["mujoco/rk4"]["slope"] == pytest.approx(4, abs=0.4)
    assert found["mujoco/tuned"]["slope"] == pytest.approx(1, abs=0.1)
    assert all(fit["r2"] > 0.999 and fit["rungs"] == "1/480, 1/240, 1/120, 1/60" for fit in found.values())


@pytest.mark.parametrize("contestant", TUNED)
def test_flight_is_of_order_one(contestant: str) -> None:
    fit = orders("free_flight[dimension=1]", [contestant], STEPS)[contestant]
    assert fit["slope"] == pytest.approx(1, abs=1e-6)
    assert fit["r2"] == pytest.approx(1, abs=1e-9)
