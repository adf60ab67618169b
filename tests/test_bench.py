"""The benchmarks: what they print is what was measured, mistakes are one line."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from impactbench.reports import bench
from impactbench.reports.bench_race import Race, conservation, deepest, run_race
from impactbench.reports.bench_text import text_of
from impactbench.reports.cli import main
from impactbench.scenarios.crowds import column, gas, wall
from impactbench.scenarios.trajectory import State


def test_a_race_measures_all_on_the_same_scene():
    scene = gas(80, 2, 0.2)
    part = run_race(Race(scene, ("reference/stepped", "pymunk/tuned", "mujoco/tuned"), 1 / 240, 60, 6))
    ours, *others = part["rows"]
    assert ours["contestant"] == "reference/stepped"
    assert "ratio" not in ours
    for row in others:
        assert row["ratio low"] <= row["ratio"] <= row["ratio high"]
        assert row["steps per second"] > 0
        assert abs(row["energy change"]) < 1e-3
    assert ours["deepest overlap after steps [m]"] <= ours["deepest overlap before projection [m]"]
    assert "reference/stepped" in text_of("gas", {"what": "", **part})
    json.dumps(part, allow_nan=False)


def test_overlap_and_energy_are_those_of_the_positions():
    scene = gas(2, 2, 0.01)  # a square of 12.5 m
    x = np.array([[5.0, 5.0, 0.0], [5.0, 5.75, 0.0]])
    assert deepest(scene, x) == pytest.approx(0.25)
    x[1] = (0.3, 3.0, 0.0)
    assert deepest(scene, x) == pytest.approx(0.2)
    still, moving = State(x, np.zeros((2, 3))), State(x, np.ones((2, 3)))
    assert conservation(scene, still, moving)["energy change"] == pytest.approx(3.0 / scene.energy)
    pile = column(2)
    lifted = State(np.array([[0, 0, 1.0], [0, 0, 2.0]]), np.zeros((2, 3)))
    lowered = State(np.zeros((2, 3)), np.zeros((2, 3)))
    assert conservation(pile, lifted, lowered)["energy change"] == pytest.approx(-3 * 9.81 / pile.energy)


def test_crowds_start_without_overlap():
    for d, fill in ((1, 0.5), (2, 0.4), (3, 0.2)):
        scene = gas(200, d, fill)
        assert deepest(scene, np.array([scene.bodies[i].position for i in scene.movable])) <= 0
    with pytest.raises(ValueError, match="too much"):
        gas(64, 3, 0.7)
    bricks = wall(3, 4)
    assert len(bricks.movable) == 12
    places = {bricks.bodies[i].position for i in bricks.movable}
    assert len(places) == 12


def test_an_unknown_benchmark_names_the_known_ones():
    result = CliRunner().invoke(main, ["bench", "gass"])
    assert result.exit_code == 2
    assert "did you mean gas" in result.stderr
    with pytest.raises(ValueError, match="growth"):
        bench.chosen(["nothing"])
    assert bench.chosen([]) == list(bench.BENCHMARKS)


def test_json_holds_what_is_printed(tmp_path, monkeypatch):
    monkeypatch.setitem(bench.BENCHMARKS, "gas", lambda quick: {"rows": [{"contestant": "x", "ratio": 2.0}]})
    file = tmp_path / "bench.json"
    result = CliRunner().invoke(main, ["bench", "gas", "--quick", "--json", str(file)])
    assert result.exit_code == 0, result.output
    found = json.loads(file.read_text())
    assert found["benchmarks"]["gas"]["rows"] == [{"contestant": "x", "ratio": 2.0}]
    assert found["machine"]["cores"]
    missing = CliRunner().invoke(main, ["bench", "gas", "--json", str(tmp_path / "no" / "bench.json")])
    assert missing.exit_code == 2
