"""Replays: what is recorded agrees with the tables, what is packed comes back, what is thinned is said."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from impactbench.adapters import contestants
from impactbench.reports import replay, replay_pack, replay_record, replay_tracks
from impactbench.reports.cell import Cell, case_named, run_cell
from impactbench.reports.compare import TIMED, Plan
from impactbench.reports.geometry import rotation_matrices
from impactbench.scenarios import catalogue
from impactbench.scenarios.records import Capsule, Law
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case
from numpy.typing import NDArray

STEP = 1 / 240
DROP = "stacked_drop[shape=sphere,count=3]"
BALL = "bouncing_ball[bounciness=0.8]"


def true_run(case: Case, law: Law = "nc") -> Trajectory:
    """The truth itself, read at every step."""
    times = np.arange(round(case.scene.duration / STEP) + 1) * STEP
    states = [case.truths[law].state(float(t)) for t in times]
    assert all(state is not None for state in states)
    places, speeds = (np.array([getattr(s, part) for s in states]) for part in ("positions", "velocities"))
    return Trajectory(times, places, speeds)


def packed(case: Case, run: Trajectory, law: Law = "nc", every: int = 4) -> dict[str, Any]:
    """The packed case of one run."""
    recorded = replay_record.described(case, law, replay_record.finite_part(run), every)
    cell = Cell(case.scene.name, law, "made/up", "minimal", "1/240")
    return replay_tracks.packed_case(case, [recorded | {"cell": cell, "stepless": False, "state": "ok"}], [], 1)


def groups(track: dict[str, Any], bodies: int) -> tuple[Floats, NDArray[np.int16], Floats]:
    """Positions [T, n, 3], colour levels [n, T] and series [5, T] of a run's track without turning."""
    count = track["frames"]
    words = replay_pack.unpack(track["data"], (3 * bodies, count, 2), (bodies, count, 1), (5, count, 1))
    rows = words[0].reshape(3, bodies, count).transpose(2, 1, 0)
    places = replay_pack.restored(rows, np.array(track["low"]), np.array(track["span"]))
    return places, words[1], replay_pack.exponential(words[2])


def test_words_come_back_whatever_they_are() -> None:
    random = np.random.default_rng(1)
    a, b = (random.integers(-32768, 32768, shape).astype(np.int16) for shape in ((3, 50), (2, 9)))
    back = replay_pack.unpack(replay_pack.pack((a, 2), (b, 1)), (3, 50, 2), (2, 9, 1))
    assert np.array_equal(back[0], a)
    assert np.array_equal(back[1], b)


def test_series_keep_sign_and_three_digits_over_all_sizes() -> None:
    values = np.array([0.0, 1e-15, -3e-9, 0.86, -1.5, 1e12, np.nan])
    back = replay_pack.exponential(replay_pack.logarithmic(values))
    assert np.isnan(back[-1])
    # Half a word of 1000 to a decade: 10^(1/2000) - 1 = 1.2e-3.
    np.testing.assert_allclose(back[:-1], values[:-1], rtol=1.2e-3)


def test_positions_come_back_within_the_stated_loss() -> None:
    case = case_named(BALL)
    run = true_run(case)
    track = packed(case, run)["runs"][0]
    places, _, _ = groups(track, 1)
    away = np.abs(places - run.positions[::4]).max()
    assert away <= 1.001 * track["loss"]  # the loss is stated with two digits
    assert track["loss"] < 1e-5 * case.scene.length


@pytest.mark.parametrize("engine", ["pymunk/default", "pybullet/default"])
def test_a_recorded_run_has_the_figures_of_the_tables(engine: str) -> None:
    (contestant,) = contestants.select([engine])
    cell = Cell(BALL, "nc", engine, "minimal", "1/240")
    table = {figure.measure: figure.value for figure in run_cell((cell, contestant))["figures"]}
    summary = replay_record.record_run((cell, contestant, 4))["summary"]
    for name in ("energy_gain", "energy_drift"):
        assert summary[name] == pytest.approx(table[name], rel=1e-9, abs=1e-14)
    assert summary["momentum"] == table["momentum_drift"]
    assert summary["penetration"] == table["penetration_max"]
    assert summary["position_error"] >= table["position_error"]  # the table's is that of the end


def test_events_of_a_run_that_leaves_the_truth_at_a_known_time() -> None:
    case = case_named("equal_masses[bounciness=0.5]")
    run = true_run(case)
    moved = run.positions.copy()
    length = case.scene.length
    moved[run.times >= 0.5, 1] += (0.0, 0.02 * length, 0.0)
    moved[run.times == 0.75, 1] += (0.0, 0.03 * length, 0.0)
    events = packed(case, replace(run, positions=moved))["runs"][0]["events"]
    second = case.scene.bodies[case.scene.movable[1]].name
    violation, largest = events["first_violation"], events["largest_error"]
    assert (violation["what"], violation["time"], violation["bodies"]) == ("position_error", 0.5, [second])
    assert violation["value"] == pytest.approx(0.02)
    assert (largest["time"], largest["bodies"]) == (0.75, [second])
    assert largest["value"] == pytest.approx(0.05)
    # The impact is at the truth's instant, seen at the first sample that knows of it.
    assert 0 <= events["first_contact"]["time"] - case.truths["nc"].impact_times[0] <= STEP


def test_a_true_run_violates_nothing_and_is_never_coloured() -> None:
    case = case_named(BALL)
    track = packed(case, true_run(case))["runs"][0]
    assert track["events"]["first_violation"] is None
    _, levels, series = groups(track, 1)
    assert set(levels.ravel()) == {1}
    assert np.nanmax(series[0]) == 0.0


def test_thinned_series_keep_their_extremes() -> None:
    column = np.array([0.0, 1.0, -5.0, 2.0, 0.5, 0.1, 9.0])
    assert replay_record.largest_of(column, 3).tolist() == [0.0, -5.0, 9.0]
    assert np.isnan(replay_record.largest_of(np.full(5, np.nan), 2)).all()


def test_a_diverged_run_ends_where_it_is_no_longer_finite() -> None:
    case = case_named(BALL)
    run = true_run(case)
    places = run.positions.copy()
    places[run.times >= 1.0] = math.nan
    places[(run.times >= 0.9) & (run.times < 1.0)] = 1e50
    with np.errstate(over="ignore", invalid="ignore"):
        found = packed(case, replace(run, positions=places))
    assert found["runs"][0]["frames"] == 60  # 0, 1/60 ... 59/60 s
    assert found["runs"][0]["events"]["first_violation"]["time"] == pytest.approx(0.9, abs=STEP)
    json.dumps(found, allow_nan=False)


def test_friction_is_expected_dissipation() -> None:
    case = case_named("coulomb_slide[heading=0]")
    scene, found = case.scene, packed(case, true_run(case))
    truth = found["truths"]["nc"]
    rows = replay_pack.unpack(truth["data"], (3, found["frames"], 2), (2, found["frames"], 1))[1]
    energy = replay_pack.exponential(rows[1])
    body = scene.bodies[scene.movable[0]]
    friction = scene.contact_of(scene.statics[0], scene.movable[0]).friction
    assert body.mass is not None
    # v = v0 - mu g t while it slides, at t = 0.5 s: E/E0 - 1 in units of the scene's energy.
    speed, start = abs(body.velocity[0]) - friction * 9.81 * 0.5, abs(body.velocity[0])
    assert speed > 0
    lost = 0.5 * body.mass * (speed**2 - start**2) / scene.energy
    assert energy[30] == pytest.approx(lost, rel=2e-3)
    _, _, series = groups(found["runs"][0], 1)
    np.testing.assert_allclose(series[1][1:], energy[1:], rtol=5e-3)


def test_what_does_not_fit_is_thinned_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    case = case_named(DROP)
    (contestant,) = contestants.select(["pymunk/tuned"])
    cell = Cell(DROP, "nc", "pymunk/tuned", "minimal", "1/240")
    run = replay_record.record_run((cell, contestant, 1)) | {"cell": cell, "stepless": False, "state": "ok"}
    whole = replay.fitted([(case, [run], [])])
    assert whole["notes"] == []
    monkeypatch.setattr(replay, "BUDGET", replay.size(whole["cases"][0]) // 2)
    less = replay.fitted([(case, [run], [])])
    assert 0 < replay.size(less["cases"][0]) <= replay.BUDGET
    assert less["notes"]
    assert DROP in less["notes"][0]
    assert less["cases"][0]["runs"][0]["summary"] == whole["cases"][0]["runs"][0]["summary"]
    monkeypatch.setattr(replay, "BUDGET", 10)
    assert replay.fitted([(case, [run], [])])["cases"] == []


def test_cells_that_did_not_run_are_named_with_their_reason() -> None:
    (case,), chosen = catalogue.select([BALL]), contestants.select(["mujoco/tuned", "pymunk/tuned"])
    entries = [(Cell(BALL, "nc", c.name, "minimal", step), c) for c in chosen for step in ("1/60", "1/240")]
    outcomes = {cell.key: {"state": "ok", "reason": ""} for cell, _ in entries}
    outcomes[entries[1][0].key] = {"state": "crashed", "reason": "SIGSEGV"}
    (found,) = replay.replays({BALL: case}, [BALL], entries, outcomes, 1)["cases"]
    assert found["not_recorded"] == [{"contestant": "mujoco/tuned", "reason": "crashed: SIGSEGV"}]
    assert [(run["contestant"], run["step_text"]) for run in found["runs"]] == [("pymunk/tuned", "1/240")]


def test_a_contact_mark_sits_where_the_bodies_touch_while_a_rod_turns() -> None:
    case = case_named("rod_drop[angle=30,bounciness=1]")
    (contestant,) = contestants.select(["pybullet/default"])
    cell = Cell(case.scene.name, "nc", "pybullet/default", "minimal", "1/240")
    run = replay_record.record_run((cell, contestant, 1))
    start, end, static, _, on, *offset = run["contacts"][0]
    first, last = round(start / STEP), round(end / STEP)
    rod = case.scene.bodies[on].shape
    assert case.scene.bodies[static].static
    assert isinstance(rod, Capsule)
    assert last > first + 10  # it stays down and turns
    for step in (first, last):
        arm = rotation_matrices(run["orientations"][step : step + 1])[0, 0] @ offset
        # On the floor, z = 0, but for the touching distance and the rim that the end's half ball rolls over.
        assert abs(run["positions"][step, 0, 2] + arm[2]) <= 1e-3 * case.scene.length + rod.radius
    assert np.linalg.norm(offset) > rod.half_length


def test_the_recorded_case_of_a_family_is_the_timed_one() -> None:
    names = Plan(catalogue.all_cases(), contestants.select(["mujoco/tuned"])).replayed()
    families = dict.fromkeys(case.scene.family for case in catalogue.all_cases())
    assert set(TIMED) <= set(names)
    assert [name.partition("[")[0] for name in names] == list(families)
