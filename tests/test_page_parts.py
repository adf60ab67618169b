"""Parts of the report page beside its charts: failure cards, timing detail, models, lines that are no policy's."""

from __future__ import annotations

import base64
import json
import shlex
import zlib
from pathlib import Path

import altair as alt
import pytest
from click.testing import CliRunner
from impactbench.reports import charts, charts_plain, page, page_failures, page_scores, page_timing
from impactbench.reports.cli import main
from impactbench.reports.compare import Plan, compare
from impactbench.reports.options import cases_of, contestants_of
from impactbench.reports.page_data import order
from impactbench.reports.page_view import View
from test_page import Maker, case, document, small, specs


def test_cards_name_the_worst_cell_of_each_law_and_how_to_see_it_again() -> None:
    maker = Maker()
    for phase, drift in ((0.0, -0.02), (0.25, -0.3), (0.5, -0.005)):
        maker.cell("a", "reference/x", 60, {"energy_drift": drift}, phase=phase, law="doc", model="full")
    maker.cell("a", "y/tuned", 120, {"penetration_max": 0.5})
    maker.rows[-1] |= {"time": 0.25, "bodies": ["ball", "wall"]}
    maker.cell("a", "y/tuned", 60, {}, state="crashed", reason="signal 11")
    found = page_failures.cards(View(document(maker, [case("a", "a")])))
    assert [card["law"] for card in found] == [
        "Run crashed",
        "Non-penetration: bodies overlap",
        "Energy: other than the law leaves",
    ]
    assert (found[1]["when"], found[1]["bodies"]) == ("t = 0.25 s", "ball, wall")
    assert found[2]["numbers"].startswith("energy drift −30 %")
    assert (found[2]["when"], found[2]["bodies"]) == ("t = 1 s", "all")  # taken at the end
    assert found[2]["count"] == 2  # -0.005 is within the limit
    assert found[2]["command"] == (
        "impactbench run a --engine reference/x --step 1/60 --phase 0.25 --model full --law doc"
    )


def test_the_command_on_a_card_measures_the_same_figure_again() -> None:
    plan = Plan(cases_of(["static_wall[bounciness=0.5]"]), contestants_of(["pymunk/default"], "both"), ("1/30",))
    found = compare(plan, "")
    card = next(c for c in page_failures.cards(View(found)) if c["law"].startswith("Non-penetration"))
    run = CliRunner().invoke(main, [*shlex.split(card["command"])[1:], "--json"])
    row = next(row for row in json.loads(run.output)["rows"] if row["measure"] == "penetration_max")
    assert row in found["rows"]
    assert row["time"] > 0
    assert card["bodies"] == ", ".join(row["bodies"])


def test_what_the_smallest_model_saves_is_told_where_both_ran() -> None:
    maker = Maker()
    for model, wall, error in (("minimal", 1e-3, 0.25), ("full", 4e-3, 0.125)):
        maker.cell("a", "x/y", 60, {"position_error": error, "wall_time": wall}, model=model)
    (row,) = View(document(maker, [case("a", "a")])).content()["savings"]
    assert (row["saved"], row["error"], row["change"]) == ("75 %", 0.25, 0.125)
    assert View(small()).content()["savings"] == []


def test_every_repeat_is_in_the_timing_detail() -> None:
    maker = Maker()
    maker.cell("a", "x/y", 60, {"position_error": 0.1}, repeats=[3e-3, 1e-3, 2e-3])
    found = document(maker, [case("a", "a", duration=2.0)])
    found["provenance"]["clock_seconds"] = 2e-5
    timing = View(found).content()["timing"]
    assert [(row["repeats"], row["median"], row["least"]) for row in timing["rows"]] == [("3 1 2", 2.0, 1.0)]
    # 20 us of a run of 2 s simulated at 1 ms each
    assert "20 µs, at most 1 % of it" in timing["overhead"].replace("2e+01", "20")


def test_of_many_timed_cells_the_finest_steps_are_listed_and_the_others_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(page_timing, "MOST_ROWS", 2)
    maker = Maker()
    for name in ("a", "b"):
        for step in (60, 240):
            maker.cell(name, "x/y", step, {"position_error": 0.1}, repeats=[1e-3])
    made = document(maker, [case("a", "a"), case("b", "b")])
    html = page.render(made)
    found = page_timing.timing(View(made))
    assert found is not None
    assert ([(row["case"], row["step"]) for row in found["rows"]], found["left_out"]) == (
        [("a", "1/240"), ("b", "1/240")],
        2,
    )
    assert "All repeats of 2 timed cells; those of 2 more are in the results file" in html
    assert "Repeats are listed of 2 timed cells, the finest steps first." in html


def test_what_was_not_measured_is_named_with_its_command() -> None:
    text = page.render(small())
    assert "hard cases: impactbench hard;" in text
    assert "what the smallest model saves: impactbench compare --model both." in text
    maker = Maker()
    maker.cell("a", "x/y", 60, {"position_error": 0.1}, model="full")
    assert "the smallest model saves: impactbench" not in page.render(document(maker, [case("a", "a")]))


def test_null_models_and_floors_are_lines_in_the_chart() -> None:
    maker = Maker()
    maker.cell("a", "x/y", 60, {"position_error": 0.1, "null_position_error": 0.5, "floor_position_error": 1e-7})
    html = page.render(document(maker, [case("a", "a")]))
    spec, _ = (json.loads(spec) for spec in specs(html))
    rows = [row for rows in spec["datasets"].values() for row in rows]
    assert {(row["x"], row["t"]) for row in rows if "t" in row} >= {
        (0.5, "null model"),
        (1e-7, "the truth's own floor"),
    }


def test_a_contestant_without_a_step_reaches_its_target_where_nothing_is_timed() -> None:
    maker = Maker()
    maker.cell("a", "x/exact", None, {"position_error": 0.0})
    maker.cell("a", "x/y", 60, {"position_error": 0.001})
    found = View(document(maker, [case("a", "a")]))
    assert page_scores.reach(found, "a") == (
        "To stay below 1 % error, coarsest step that does: x/exact no fixed step; x/y 1/60 s."
    )


def test_charts_are_filled_copies_of_one_description_that_keeps_to_the_schema() -> None:
    view = View(small())
    known = [name for name in view.cases if len({point["step"] for point in view.points(name)}) >= 3]
    orders = {policy: order(line) for policy, line in view.of(known[0]).items()}
    points = view.points(known[0])
    specs = []
    for limits in ([(0.5, "null model")], []):
        specs.append(charts.work_precision(points, [], view.style, ("error", "cost"), limits))
        specs.append(
            charts_plain.convergence([p for p in points if p["step"] > 0], orders, view.style, ("step", "error"))
        )
    for spec in specs:
        alt.LayerChart.from_dict(spec, validate=True)
        # Nothing is drawn of data that are not there, and no data are there for nothing.
        assert {layer["data"]["name"] for layer in spec["layer"]} == set(spec["datasets"])
    assert ["limits" in spec["datasets"] for spec in specs] == [True, False, False, False]
    assert specs[1] == specs[3]  # what went into a chart does not stay for the next
    assert all("datasets" not in make(view.style) for make in (charts.speed_layers, charts_plain.order_layers))


def test_the_scripts_of_the_charts_are_made_once_for_an_installation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    monkeypatch.setattr(page.vl_convert, "javascript_bundle", lambda snippet: made.append(snippet) or "a</script>é")
    monkeypatch.setattr(page, "KEPT", tmp_path / "kept")
    texts = [page.bundle.__wrapped__() for _ in range(2)]
    assert [zlib.decompress(base64.b64decode(text)).decode() for text in texts] == ["a</script>é"] * 2
    assert len(made) == 1
    (kept,) = (tmp_path / "kept").iterdir()
    kept.write_bytes(b"\xff")  # not what was written: made again
    assert page.bundle.__wrapped__() == texts[0]
    (tmp_path / "file").touch()
    monkeypatch.setattr(page, "KEPT", tmp_path / "file")  # nothing can be kept there
    assert page.bundle.__wrapped__() == texts[0]
    assert len(made) == 3
