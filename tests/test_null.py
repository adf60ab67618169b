"""Null models and floors: what doing nothing scores is what geometry says."""

from __future__ import annotations

import pytest
from impactbench.reports.null import floor, limits_of
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.crowds import gas
from impactbench.scenarios.truth import Case, Truth


def case_of(name: str) -> Case:
    (case,) = select([name])
    return case


def test_a_frozen_flight_misses_the_whole_way_and_a_perfect_integrator_none() -> None:
    """Headline: distance at the end over the length g T^2/2; up at 5 m/s for 1 s, that is (5 - g/2) of g/2."""
    found = limits_of(case_of("free_flight[dimension=1]"))
    assert found["null"]["frozen"] == pytest.approx((5 - 9.81 / 2) / (9.81 / 2))
    assert found["null"]["no contact"] < found["floor"] < 1e-12


def test_a_ball_that_passes_through_the_wall_is_off_by_both_ways() -> None:
    """With e = 1/2 it is where v (T - t) / 2 in front should be: off by 3/2 v (T - t)."""
    case = case_of("static_wall[bounciness=0.5]")
    (ball,) = (body for body in case.scene.bodies if not body.static)
    late = case.scene.duration - case.truths["nc"].impact_times[0]
    speed = max(map(abs, ball.velocity))
    assert limits_of(case)["null"]["no contact"] == pytest.approx(1.5 * speed * late / case.scene.length)


def test_every_case_of_the_catalogue_has_its_floor_below_what_is_asked_for() -> None:
    for case in select([]):
        found = limits_of(case)
        assert 0 < found["floor"] < 1e-10
        assert all(value >= 0 for value in found.get("null", {}).values())


def test_a_crowd_costs_nothing_and_has_no_null_model() -> None:
    scene = gas(700)
    case = Case(scene, dict.fromkeys(scene.laws, Truth("invariant", lambda _: None)), "energy_drift")
    assert set(limits_of(case)) == {"floor"}
    assert floor(case) == pytest.approx(10 * 960 * 2.0**-53)
