"""The report page: its numbers, its safety and its completeness, on a small made-up document."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import altair as alt
import pytest
from impactbench.reports import page, page_verdict
from impactbench.reports.page_data import time_to
from impactbench.reports.page_view import View

HOSTILE = "<img src=x onerror=alert(1)>"
STEPS = (30, 60, 120, 240, 480, 960)
SCRIPT_END = "</script><script>alert(2)</script><!--"


def case(name: str, family: str, **changes: Any) -> dict[str, Any]:
    """One case as a results document holds it."""
    found = {
        "name": name, "family": family, "question": f"What does {family} show?", "headline": "position_error",
        "laws": ["newton"], "truth": {"newton": "trajectory"}, "parameters": {},
        "duration": 1.0, "length": 1.0, "speed": 1.0, "energy": 1.0,
        "model": {"axes": ["z"], "rotation": False},
    }  # fmt: skip
    return {**found, **changes}


class Maker:
    """Builds a document cell by cell."""

    def __init__(self) -> None:
        self.cells: list[dict[str, Any]] = []
        self.rows: list[dict[str, Any]] = []

    def cell(self, name: str, contestant: str, rung: int | None, measures: dict[str, float], **changes: Any) -> None:
        """One cell and its rows; `rung` is 1/step."""
        found = {
            "case": name, "family": name, "law": "newton", "contestant": contestant, "model": "minimal",
            "step": 1 / rung if rung else None, "step_text": f"1/{rung}" if rung else "", "phase": 0.0,
            "state": "ok", "reason": "", "version": "1.0", "settings": {"iterations": 10},
        }  # fmt: skip
        self.cells.append({**found, **changes})
        for measure, value in measures.items():
            unit = "s" if measure.startswith("wall") else "1"
            self.rows.append({"cell": len(self.cells) - 1, "measure": measure, "value": value, "unit": unit})

    def ladder(self, name: str, contestant: str, error: float, wall: float | None, power: float = 1.0) -> None:
        """Six steps whose error falls with the given order from `error` at 1/30 and whose time is inverse to it."""
        for rung in STEPS:
            measures = {"position_error": error * (30 / rung) ** power, "energy_drift": -0.5 * error * 30 / rung}
            if wall is not None:
                seconds = wall * rung / 30
                measures |= {"wall_time": seconds, "wall_time_low": 0.9 * seconds, "wall_time_high": 1.2 * seconds}
            self.cell(name, contestant, rung, measures)


def document(maker: Maker, cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Results document around cells; the family of a cell does not matter to the page, that of its case does."""
    provenance = {
        "created": "2026-01-02T03:04:05+00:00", "command": "impactbench compare", "impactbench": "0.1.0",
        "python": "3.11", "platform": "Linux", "processor": "a processor", "cores": 4, "commit": None,
        "versions": {"engine": "1.0"}, "load": 0.1, "notes": [],
    }  # fmt: skip
    laws = [{"case": cases[0]["name"], "measure": "position_error", "value": 0.25, "unit": "1"}]
    return {"schema": 1, "provenance": provenance, "cases": cases, "cells": maker.cells, "rows": maker.rows} | {
        "law_difference": laws
    }


def small() -> dict[str, Any]:
    """Two cases: a timed stack with every state, and an untimed one."""
    maker = Maker()
    maker.ladder("stacked_drop_3", "reference/stepped", 0.02, 2e-4)
    maker.ladder("stacked_drop_3", "mujoco/tuned", 0.08, 1e-4)
    maker.ladder("stacked_drop_3", "pybullet/default", 3.0, 3e-4, 0.5)
    maker.cell("stacked_drop_3", "reference/events", None, {"position_error": 0.0, "wall_time": 1e-4})
    for state in ("unsupported", "unavailable", "diverged", "crashed", "timed out", "error"):
        maker.cell("stacked_drop_3", f"engine/{state}", 60, {}, state=state, reason=f"because {state}")
    maker.cell("bounce", "mujoco/tuned", 60, {"position_error": 0.002, "energy_gain": 0.86})
    maker.cell("bounce", "mujoco/tuned", 120, {"position_error": 0.001, "energy_gain": 0.1})
    return document(maker, [case("bounce", "bounce"), case("stacked_drop_3", "stacked_drop")])


@pytest.fixture(scope="module")
def html() -> str:
    """The page of the small document."""
    return page.render(small())


class Outline(HTMLParser):
    """Tags with attributes, and the text outside scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.inside = tag

    def handle_endtag(self, _tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside not in ("script", "style"):
            self.text += data


def embedded(html: str, name: str) -> Any:
    """JSON inside the script element of this id."""
    found = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', html, re.S)
    assert found
    return json.loads(found[1])


def specs(html: str) -> list[str]:
    """Chart specifications on the page."""
    return re.findall(r'<script type="application/json" class="spec">(.*?)</script>', html, re.S)


def test_the_verdict_says_what_holds_what_fails_and_what_to_take() -> None:
    view = View(small())
    assert page_verdict.coverage(view).startswith(
        "10 contestants on 2 cases at 6 step sizes (1/30 to 1/960 s): 21 of 27 cells ran; "
    )
    assert "1 timed out" in page_verdict.coverage(view)
    holds, fails, take = (line["text"] for line in page_verdict.verdict(view))
    # Drift at the finest step: half of 0.02/32 and 0.08/32 (below 1 %), half of 3.0/32 = 4.7 %; mujoco gains 10 %.
    assert holds == "within 1 % in every case at the finest step: energy by 1 of 4 contestants."
    assert fails == "mujoco/tuned gains 86 % of the energy in bounce at 1/60 s (limit 1 %)."
    # Errors at the finest steps below 1 %: mujoco/tuned in both cases, pybullet/default 3.0 / 32**0.5 in none.
    assert take == (
        "reference/events for stacked drop: cheapest below 1 % error, 0.1 ms per simulated second; "
        "among engines mujoco/tuned, 0.8. Engine with most cases: mujoco/tuned, 2 of 2."
    )


def test_the_verdict_names_a_loss_and_an_error_where_no_energy_is_gained() -> None:
    maker = Maker()
    maker.cell("a", "x/y", 60, {"position_error": 0.5, "energy_drift": -0.3})
    assert "x/y loses 30 % of the energy in a at 1/60 s" in page_verdict.fails(View(document(maker, [case("a", "a")])))
    maker = Maker()
    maker.cell("a", "x/y", 60, {"position_error": 0.5, "energy_drift": -0.003})
    assert page_verdict.fails(View(document(maker, [case("a", "a")]))) == (
        "x/y has a position error of 50 % in a at 1/60 s (limit 1 %)."
    )


def test_time_to_a_fixed_error_is_the_cheapest_rung_that_stays_below(html: str) -> None:
    # 0.02 * 30/60 = 0.01 at 1/60 (2 * 0.2 ms); 0.08 * 30/240 = 0.01 at 1/240 (8 * 0.1 ms)
    expected = (
        "To stay below 1 % error, ms per simulated second: reference/events 0.1 (no fixed step); "
        "reference/stepped 0.4 (1/60 s); mujoco/tuned 0.8 (1/240 s). "
        "pybullet/default does not get there."
    )
    assert expected in Outline(html).text


def test_a_lucky_coarse_step_earns_nothing() -> None:
    maker = Maker()
    for rung, error in zip(STEPS, (0.001, 0.05, 0.03, 0.009, 0.004, 0.002), strict=True):
        maker.cell("a", "x/y", rung, {"position_error": error, "wall_time": rung * 1e-5})
    rung = time_to(View(document(maker, [case("a", "a")])).lines["a", "x/y"], 0.01)
    assert rung is not None
    assert rung["step_text"] == "1/240"


def test_the_worst_phase_counts() -> None:
    maker = Maker()
    for phase, error in ((0.0, 0.001), (0.25, -0.04), (0.5, 0.02)):
        maker.cell("a", "x/y", 60, {"position_error": error, "wall_time": 1e-4}, phase=phase)
        maker.cell("a", "x/y", 120, {"position_error": error}, phase=phase, state="diverged" if phase == 0.25 else "ok")
    finer, coarser = View(document(maker, [case("a", "a")])).lines["a", "x/y"]
    assert (coarser["step_text"], coarser["position_error"], coarser["error"]) == ("1/60", -0.04, 0.04)
    assert (finer["step_text"], finer["state"]) == ("1/120", "diverged")


def test_convergence_order_is_that_of_the_made_up_ladder(html: str) -> None:
    orders = View(small()).content()["sections"][1]["orders"]
    # Drawn from end to end of the four finest rungs: 0.08 * 30/960 at 1/960, 0.08 * 30/120 at 1/120.
    assert orders["mujoco/tuned"]["fit"] == [
        pytest.approx((1 / 960, 0.0025), rel=1e-9),
        pytest.approx((1 / 120, 0.02), rel=1e-9),
    ]
    assert orders["mujoco/tuned"]["slope"] == pytest.approx(1.0)
    assert orders["pybullet/default"]["slope"] == pytest.approx(0.5)
    assert orders["mujoco/tuned"]["r2"] == pytest.approx(1.0)
    assert orders["reference/events"] is None


def test_every_failed_cell_is_a_mark_in_the_rail_and_a_row_of_a_table(html: str) -> None:
    spec = next(spec for spec in specs(html) if "because diverged" in spec)
    text = Outline(html).text
    for state in ("unsupported", "unavailable", "diverged", "crashed", "timed out", "error"):
        assert f'"state":"{state}","reason":"because {state}"' in spec
        assert f"because {state}" in text


def test_an_exact_result_sits_on_the_floor_rail(html: str) -> None:
    spec = next(json.loads(spec) for spec in specs(html) if "reference/events" in spec)
    rows = [row for rows in spec["datasets"].values() for row in rows if row.get("policy") == "reference/events"]
    drawn = [row["x"] for row in rows if row.get("error") == 0]
    low = spec["layer"][0]["encoding"]["x"]["scale"]["domain"][0]
    smallest = min(row["x"] for rows in spec["datasets"].values() for row in rows if row.get("error", 0) > 0)
    assert drawn
    assert all(low < x < smallest for x in drawn)


def test_the_specifications_keep_to_the_schema(html: str) -> None:
    for spec in specs(html):
        alt.LayerChart.from_dict(json.loads(spec), validate=True)


def test_the_law_difference_is_apart(html: str) -> None:
    assert "The distance between two truths, no engine's error" in Outline(html).text
    found = small()
    found["law_difference"] = [{**found["law_difference"][0], "value": 1e-16}]
    assert "The distance between two truths" not in page.render(found)  # round-off is no difference


def test_nothing_is_loaded_from_elsewhere(html: str) -> None:
    for tag, attributes in Outline(html).tags:
        for name in ("src", "href", "data", "action", "xlink:href"):
            assert re.match(r"(data:|#|$)", attributes.get(name) or ""), (tag, attributes)
    assert "default-src 'none'" in html


def test_structure_for_readers_of_every_kind(html: str) -> None:
    tags = Outline(html).tags
    names = [tag for tag, _ in tags]
    assert names.count("main") == 1
    assert names.count("h1") == 1
    assert ("html", {"lang": "en"}) in tags
    assert all("scope" in attributes for tag, attributes in tags if tag == "th")
    ids = [attributes["id"] for _, attributes in tags if attributes.get("id")]
    assert len(ids) == len(set(ids))
    targets = {(attributes.get("href") or "")[1:] for tag, attributes in tags if tag == "a"}
    assert targets <= set(ids)
    # Two of speed against error, the first once more for a phone, one of error against step.
    assert names.count("svg") == 4


@pytest.mark.parametrize(
    "name", [HOSTILE, SCRIPT_END, "long" * 50, "\u202eright to left \u05d0\u05d1", "'\"&{{ 7*7 }}"]
)
def test_hostile_names_are_text_everywhere(name: str) -> None:
    maker = Maker()
    maker.ladder(name, f"{name}/default", 0.1, 1e-4)
    maker.cell(name, name, 60, {}, state="crashed", reason=name, settings={name: name})
    found = document(maker, [case(name, name, question=name)])
    html = page.render(found)
    outline = Outline(html)
    assert name in outline.text
    assert not [tag for tag, _ in outline.tags if tag == "img"]
    assert "alert(2)" not in [text.strip() for text in re.findall(r"<script>(.*?)</script>", html, re.S)]
    # Two specifications, their rungs, what the script needs, the data, the library, its unpacking, the page's own.
    assert sum(tag == "script" for tag, _ in outline.tags) == 8
    assert embedded(html, "results") == found


def test_the_rows_are_embedded(html: str) -> None:
    assert embedded(html, "results") == small()


def sixty(families: int = 4) -> dict[str, Any]:
    """Sixty cases of six policies at three phases: more than a page may hold."""
    maker = Maker()
    cases = []
    for index in range(60):
        cases.append(case(f"case_{index}", f"family_{index * families // 60}"))
        for policy in ("a/default", "a/tuned", "b/default", "b/tuned", "c/tuned", "reference/stepped"):
            for _ in range(3):
                maker.ladder(f"case_{index}", policy, 0.1, 1e-4)
    return document(maker, cases)


def test_sixty_cases_stay_within_the_budget_and_say_what_was_left_out() -> None:
    html = page.render(sixty())
    assert len(html.encode()) <= page.BUDGET
    assert "Each family charts one case" in html
    assert "too large for this page" in html
    assert "embedded here is the worst phase of every rung" in html
    # 0.1 at 1/30 halves with the step; 0.1 ms at 1/30 s doubles.
    line = embedded(html, "results")["rungs"]["case_59"]["a/tuned"]
    assert line[-2:] == [["1/60", "ok", 0.05, 0.2], ["1/30", "ok", 0.1, 0.1]]
    assert all(f"case_{index}<" in html for index in range(60))


def test_where_no_data_fit_fewer_charts_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = page.render(sixty(families=24))
    monkeypatch.setattr(page, "BUDGET", 1_400_000)  # the scripts of the charts take 0.4 of them
    html = page.render(sixty(families=24))
    assert len(html.encode()) <= 1_400_000 < len(whole.encode())
    assert "Charts are drawn for the first 12 families; the others have tables only." in html


def test_at_last_only_the_first_families_keep_the_tables_behind_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "BUDGET", 0)
    html = page.render(sixty(families=24))
    assert "Charts are drawn for the first 1 families" in html
    assert "Rungs are listed behind those charts only; the others are in the results file." in html
    # The featured case and the first family's are one and the same here.
    assert html.count("Data behind the chart") == 1
    assert html.count("the number of charts on this page is limited") == 23


def test_a_document_without_any_result_still_makes_a_page() -> None:
    maker = Maker()
    maker.cell("a", "x/y", None, {}, state="unavailable", reason="not installed")
    text = Outline(page.render(document(maker, [case("a", "a")]))).text
    assert "0 of 1 cell ran; 1 unavailable." in text
    assert "no policy has both an error and a cost" in text


def test_a_page_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "report.html"
    target.write_text("old")

    def fail(found: dict[str, Any]) -> str:
        raise RuntimeError("half way")

    with monkeypatch.context() as patch:
        patch.setattr(page, "render", fail)
        with pytest.raises(RuntimeError):
            page.write_page({}, target)
    assert target.read_text() == "old"
    page.write_page(small(), target)
    assert target.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
