"""Null models and floors: what doing nothing scores is what geometry says."""

from __future__ import annotations

import json

import pytest
from impactbench.reports import page
from impactbench.reports.null import floor, limits_of
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.crowds import gas
from impactbench.scenarios.truth import Case, Truth
from test_page import Maker, case, document, specs


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
    for found_case in select([]):
        found = limits_of(found_case)
        assert 0 < found["floor"] < 1e-10
        assert all(value >= 0 for value in found.get("null", {}).values())


def test_a_crowd_costs_nothing_and_has_no_null_model() -> None:
    scene = gas(700)
    case = Case(scene, dict.fromkeys(scene.laws, Truth("invariant", lambda _: None)), "energy_drift")
    assert set(limits_of(case)) == {"floor"}
    assert floor(case) == pytest.approx(10 * 960 * 2.0**-53)


def test_the_chart_shows_them_as_named_lines() -> None:
    maker = Maker()
    maker.ladder("a", "x/y", 0.1, 1e-3)
    described = case("a", "a") | {"null": {"frozen": 0.5, "no contact": 0.0}, "floor": 2e-10}
    spec, narrow = (json.loads(spec) for spec in specs(page.render(document(maker, [described]))))
    assert spec["width"] > narrow["width"]  # drawn again for a phone
    rows = [row for rows in spec["datasets"].values() for row in rows]
    named = {(row["x"], row["t"]) for row in rows if "t" in row}
    assert {(0.5, "frozen"), (2e-10, "round-off")} <= named
    assert "no contact" not in {text for _, text in named}
