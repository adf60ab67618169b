"""The poster of the first screen: which case it shows, what its sentence says, and that its panels show that."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from impactbench.reports import charts, page, replay_poster, replay_record, replay_tracks, replay_view
from impactbench.reports.cell import Cell, case_named
from impactbench.reports.replay_poster import HEIGHT, WIDTH
from test_page import HOSTILE, Maker, Outline, case, document
from test_replay import BALL, true_run

NAMES = ("a/one", "b/two", "c/three", "d/four", "e/five")
WALL, PAIR = "static_wall[bounciness=1]", "equal_masses[bounciness=0.5]"
STYLE = charts.Style(tuple(name[0] for name in NAMES), NAMES)


def recorded(name: str, off: float, names: tuple[str, ...] = NAMES) -> dict[str, Any]:
    """A case whose third run leaves the truth from half its time on, in the end by `off` of the scene's length."""
    known = case_named(name)
    run = true_run(known)
    part = np.clip(2 * run.times / run.times[-1] - 1, 0, 1)[:, None, None]
    leaving = part * off * known.scene.length * np.eye(3)[known.scene.model.axes[-1]]
    entries = []
    for index, contestant in enumerate(names):
        moved = replace(run, positions=run.positions + (index == 2) * leaving)
        cell = Cell(name, "nc", contestant, "minimal", "1/240")
        described = replay_record.described(known, "nc", moved, 4)
        entries.append(described | {"cell": cell, "stepless": False, "state": "ok"})
    return replay_tracks.packed_case(known, entries, [], 1)


def poster(cases: list[dict[str, Any]], featured: str, telling: tuple[str, ...] = ()) -> dict[str, Any]:
    """What the poster shows, and the run the replay begins with."""
    found = {"notes": [], "limit": 0.01, "levels": [], "series": [], "cases": cases}
    view = replay_view.view({"replays": found}, STYLE, featured, telling)
    assert view is not None
    return {**view["poster"], "focus": view["data"]["poster"]["focus"]}


def test_it_shows_the_charts_own_case_where_runs_visibly_part_in_it() -> None:
    found = poster([recorded(BALL, 2.0), recorded(WALL, 2.0)], WALL)
    assert (found["case"], found["visible"], found["instead"]) == (WALL, True, None)
    assert "c/three" in found["runs"]
    assert found["focus"] == "c/three"  # of the two the one that is wrong
    # Away by 2 lengths at the end, from half the time on: the sentence's size is what was measured at that time.
    part = 2 * found["time"] / case_named(WALL).scene.duration - 1
    assert float(found["size"].removesuffix(" %")) == pytest.approx(200 * part, abs=0.05)  # three digits


def test_else_a_case_like_the_verdicts_and_says_so() -> None:
    cases = [recorded(BALL, 2.0), recorded(WALL, 0.01), recorded(PAIR, 2.0)]
    for other in (BALL, PAIR):
        found = poster(cases, WALL, (other,))
        assert (found["case"], found["visible"]) == (other, True)
        assert (found["instead"]["case"], found["instead"]["size"]) == (WALL, "1 %")
    assert poster(cases, WALL)["case"] in (BALL, PAIR)


def test_its_panels_hold_both_named_runs_and_their_bodies_large() -> None:
    found = poster([recorded(PAIR, 2.0)], PAIR)
    shown = [panel["contestant"] for panel in found["panels"]]
    assert len(shown) == 4
    assert set(found["runs"]) <= set(shown)
    errors = {panel["contestant"]: panel["error"] for panel in found["panels"]}
    assert errors["a/one"] == "0 %"
    size = float(found["size"].removesuffix(" %"))
    assert float(errors["c/three"].removesuffix(" %")) == pytest.approx(size, abs=0.5)  # two digits
    for panel in found["panels"]:
        circles = re.findall(r'class="l[^"]*" cx="([-\d.]+)" cy="([-\d.]+)" r="([\d.]+)"', panel["svg"])
        assert len(circles) == 2
        for x, y, r in [map(float, circle) for circle in circles]:
            assert 0 <= x - r <= x + r <= WIDTH
            assert 0 <= y - r <= y + r <= HEIGHT
        assert max(float(r) for *_, r in circles) > 10  # the replay's own box of the whole run: 3


def test_where_all_have_left_the_picture_it_is_the_replays() -> None:
    far = recorded(PAIR, 2.0) | {"camera": {"low": [100.0] * 3, "high": [101.0] * 3}}
    stills = [replay_poster.Still(far, run, 0.0) for run in far["runs"]]
    assert replay_poster.closer(far, stills) == far["camera"]


@pytest.mark.parametrize("name", [HOSTILE, "'\"&{{ 7*7 }}", "x" * 200, "\u202eright to left \u05d0\u05d1"])
def test_hostile_names_are_text_in_it(name: str) -> None:
    maker = Maker()
    maker.ladder(WALL, name, 0.1, 1e-4)
    cases = [recorded(WALL, 2.0, ("b/two", "a/one", name))]
    replays = {"notes": [], "limit": 0.01, "levels": [], "series": [], "cases": cases}
    for other in ("a/one", "b/two"):
        maker.ladder(WALL, other, 0.1, 1e-4)
    outline = Outline(page.render(document(maker, [case(WALL, WALL)]) | {"replays": replays}))
    assert not [tag for tag, _ in outline.tags if tag == "img"]
    assert f"{name} error" in outline.text.replace("\n", " ")
