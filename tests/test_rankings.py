"""Orders of policies by cost in two runs: alike, turned round, or not known."""

from __future__ import annotations

from typing import Any

import pytest
from impactbench.reports import diff, diff_page, diff_text, rankings
from impactbench.reports.rankings import Turned
from test_page import HOSTILE, Maker, case, document


def run(**seconds: float) -> dict[str, Any]:
    """A run in which each policy meets both targets at 1/30, at so much a second; intervals reach from -10 to +20 %."""
    maker = Maker()
    for policy, wall in seconds.items():
        maker.ladder("a", f"{policy}/tuned", 1e-4, wall)
    return document(maker, [case("a", "a")])


@pytest.mark.parametrize(
    ("after", "alike", "unsure", "turned"),
    [
        ({"x": 1.0, "y": 2.0, "z": 4.0}, 6, 0, 0),
        ({"x": 7.0, "y": 14.0, "z": 28.0}, 6, 0, 0),  # another machine: slower, in the same order
        ({"x": 1.0, "y": 2.0, "z": 2.6}, 4, 2, 0),  # y may cost 2.4, z 2.34
        ({"x": 1.0, "y": 2.0, "z": 2.7}, 6, 0, 0),
        ({"x": 3.1, "y": 2.0, "z": 4.0}, 2, 2, 2),  # x and y change places; x and z overlap
        ({"x": 1.0, "y": 2.0}, 2, 0, 0),
    ],
)
def test_pairs_are_alike_unsure_or_turned_at_both_targets(after, alike, unsure, turned) -> None:
    found = rankings.compare(run(x=1.0, y=2.0, z=4.0), run(**after))
    assert (found.alike, found.unsure, len(found.turned)) == (alike, unsure, turned)
    if turned:
        assert Turned("a", 0.01, "x/tuned", "y/tuned") in found.turned


def test_a_changed_order_is_said_in_every_rendering() -> None:
    found = diff.compare(run(x=1.0, y=2.0), run(x=2.0, y=1.0))
    pair = "a to 1 %: x/tuned was cheaper than y/tuned, now dearer"
    said = "of 2 pairs of policies whose cost both runs tell apart, 2 changed order; 0 with overlapping intervals"
    for text in (diff_text.terminal(found), diff_text.markdown(found), diff_page.render(found)):
        assert said in text
        assert pair in text
    assert diff_text.as_json(found)["rankings"]["turned"][0]["cheaper"] == "x/tuned"


def test_runs_without_times_say_nothing_of_rankings() -> None:
    maker = Maker()
    maker.ladder("a", "x/tuned", 1e-4, None)
    maker.ladder("a", "y/tuned", 1e-4, None)
    untimed = document(maker, [case("a", "a")])
    assert "ankings" not in diff_text.terminal(diff.compare(untimed, untimed))


def test_hostile_names_are_shown_as_text() -> None:
    first, second = run(x=1.0, y=2.0), run(x=2.0, y=1.0)
    for made in (first, second):
        for cell in made["cells"]:
            cell["case"] = HOSTILE
        made["cases"][0]["name"] = HOSTILE
    assert "<img" not in diff_page.render(diff.compare(first, second))
