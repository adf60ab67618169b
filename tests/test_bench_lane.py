"""The benchmarks of the timing lane and of small models: what they say is what the parts do."""

from __future__ import annotations

import time

import pytest
from impactbench.adapters.contestants import select
from impactbench.reports import bench_lane, bench_model
from impactbench.reports.bench_model import _models, difference, rubble, take_turns
from impactbench.reports.cell import Cell, run_seconds, time_cells, timing_figures
from impactbench.scenarios.crowds import gas


def test_the_lane_is_compared_with_a_loop_of_the_same_steps() -> None:
    found = bench_lane.compare("pymunk/tuned", 7)
    assert found["low"] <= found["lane / bare"] <= found["high"]
    assert found["us per step, bare"] > 0


def test_a_harness_that_dawdles_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A path that takes twice the time, even of one engine call for all steps, is not within 1 %."""

    def slow(engine, steps):  # type: ignore[no-untyped-def]
        start = time.perf_counter()
        run_seconds(engine, steps)
        while time.perf_counter() < start + 0.02:
            pass
        return time.perf_counter() - start

    monkeypatch.setattr(bench_lane, "run_seconds", slow)
    assert bench_lane.compare("mujoco/tuned", 7)["within 1 %"] == "no"


def test_smallest_and_full_model_of_a_line_agree() -> None:
    """Slides and free joints do the same arithmetic along x: round-off of 40 steps, up to 80 lengths away."""
    found = _models(gas(60, 1, 0.8), "mujoco/tuned", True)
    assert found["largest difference [lengths]"] < 1e-10
    assert found["low"] <= found["times faster"] <= found["high"]


def test_statics_that_may_meet_change_nothing_but_the_time() -> None:
    scene = rubble(400, 3)
    (contestant,) = select(["pybullet/tuned"])
    ends, seconds = [], []
    for meet in (False, True):
        engine = contestant.load()(scene, "nc", "tuned", scene.model, 1 / 240)
        if meet:
            bench_model._let_statics_meet(engine)
        seconds.append(min(take_turns([engine], 6, 4)[0]))
        ends.append(engine.read())
        engine.close()
    assert difference(*ends) == 0
    assert seconds[1] > 2 * seconds[0]  # some 2400 overlapping pairs against none: 30 times at 2000 statics


def test_a_timed_cell_knows_the_harness_share_and_the_price_of_a_read() -> None:
    (contestant,) = select(["pybullet/tuned"])
    cell = Cell("free_flight[dimension=1]", "nc", contestant.name, "minimal", "1/240")
    (times,) = time_cells(([(cell, contestant)], 3)).values()
    assert [len(times[name]) for name in ("run", "harness", "read")] == [3, 3, 3]
    figures = {figure.measure: figure for figure in timing_figures(times)}
    assert figures["wall_read"].unit == "s"
    assert 1e-7 < figures["wall_read"].value < 1e-3
    # One call of nothing against 240 steps of at least a microsecond each.
    assert 0 < figures["wall_harness"].value < 0.05 * figures["wall_time"].value
