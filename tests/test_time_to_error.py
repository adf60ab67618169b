"""The table of times to a fixed error: cheapest step, interval, and what is not reached."""

from __future__ import annotations

import json

from impactbench.reports import time_to_error
from impactbench.reports.page_data import order
from impactbench.reports.page_view import View
from impactbench.reports.results import save
from impactbench.reports.summary import markdown
from test_page import Maker, case, document


def made_up() -> View:
    maker = Maker()
    maker.ladder("a", "x/tuned", 0.08, 1e-3)  # below 1 % from 1/240 on (exactly 1 % there), 8 ms
    maker.ladder("a", "y/tuned", 0.4, 2e-3)  # at 1/960 still 1.25 %
    maker.ladder("a", "z/tuned", 1e-3, 4e-3)
    return View(document(maker, [case("a", "a")]))


def test_rows_hold_the_cheapest_step_and_its_interval(tmp_path) -> None:
    found = {(row["policy"], row["target"]): row for row in time_to_error.rows(made_up())}
    one = found["x/tuned", 0.01]
    assert (one["step"], round(one["ms"], 9)) == ("1/240", 8.0)
    assert (round(one["low"], 9), round(one["high"], 9)) == (7.2, 9.6)
    assert found["y/tuned", 0.01] == {
        "case": "a", "policy": "y/tuned", "target": 0.01, "ms": None, "why": "not reached",
    }  # fmt: skip
    assert found["x/tuned", 0.001]["ms"] is None
    assert found["z/tuned", 0.001]["step"] == "1/30"
    save({"time_to_error": list(found.values())}, tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text())["time_to_error"][0]["case"] == "a"


def test_the_table_says_who_is_cheapest_first_and_how_sure() -> None:
    text = time_to_error.text(time_to_error.rows(made_up()))
    lines = [line for line in text.splitlines() if "/tuned" in line]
    assert [name for line in lines for name in ("x/tuned", "y/tuned", "z/tuned") if name in line] == [
        "z/tuned",
        "x/tuned",
        "y/tuned",
    ]
    assert "4 [3.6, 4.8]" in text
    assert "8 [7.2, 9.6]" in text
    assert "not reached" in text


def test_markdown_shows_the_interval_too() -> None:
    assert "8 ms (7.2 to 9.6)" in markdown(made_up().document)


def test_an_error_that_grows_as_the_step_shrinks_has_a_negative_order() -> None:
    maker = Maker()
    maker.ladder("a", "x/tuned", 0.01, None, power=-0.5)
    fit = order(View(document(maker, [case("a", "a")])).lines["a", "x/tuned"])
    assert fit is not None
    assert round(fit["slope"], 9) == -0.5
