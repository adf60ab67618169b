"""Charts: labels that lie clear of one another, and drawings that say what the specification says."""

from __future__ import annotations

import itertools
import math
import re
from html import unescape
from typing import Any

import pytest
from impactbench.reports import chart_labels, charts, page
from impactbench.reports.chart_layout import FAIL, NARROW, WIDE, Frame
from impactbench.reports.chart_svg import svg_of
from impactbench.reports.page_family import failures
from impactbench.reports.page_view import View
from test_page import HOSTILE, Maker, case, document

LETTERS = {"labels": 6.1, "steps": 5.0, "limit names": 5.4, "words": 5.4, "failed": 5.4}  # widths in pixels
SPECIAL = (HOSTILE, "'\"&{{ 7*7 }}", 'a class="b" id="c" 0.12345', "</text></svg><script>alert(2)</script>", "x" * 200)


def crowded() -> View:
    """Seven ladders close together, an error of 0, a cell without a result, limits at both ends."""
    maker = Maker()
    for name, error, wall, power in (
        ("reference/stepped", 0.0, 2e-4, 1), ("pybullet/default", 0.4, 3e-4, 1.5), ("pybullet/tuned", 0.3, 8e-4, 3),
        ("mujoco/default", 0.3, 1.5e-4, 0.8), ("mujoco/tuned", 0.35, 1.4e-4, 4), ("pymunk/default", 0.8, 0.8e-4, 1),
        ("pymunk/tuned", 2e-3, 2.5e-4, 0.2),
    ):  # fmt: skip
        maker.ladder("a", name, error, wall, power)
    maker.cell("a", "reference/exact", None, {}, state="unsupported", reason="lasting contacts")
    null = {"frozen": 0.9, "no_contact": 70.0, "round_off": 4e-12}
    return View(document(maker, [case("a", "a", null=null)]))


def spec_of(view: View, frame: Frame) -> dict[str, Any]:
    """The chart of its only case."""
    (known,) = view.cases.values()
    limits = [(value, name.replace("_", " ")) for name, value in known["null"].items()]
    return charts.work_precision(view.points("a"), failures(view, "a"), view.style, ("error", "cost"), limits, frame)


def boxes(spec: dict[str, Any]) -> dict[str, chart_labels.Box]:
    """Where the specification's texts stand in pixels; its layers set how they are aligned."""
    (first, last), (bottom, top) = ([math.log10(x) for x in end_of(spec, channel)] for channel in ("x", "y"))
    found = {}
    for name, letter in LETTERS.items():
        for row in spec["datasets"].get(name, ()):
            x = (math.log10(row["x"]) - first) / (last - first) * spec["width"] + (FAIL if name == "failed" else 0)
            y = (top - math.log10(row["y"])) / (top - bottom) * spec["height"]
            width = letter * len(row["t"])
            left = x - width if row.get("side") == "right" else x
            found[f"{name}: {row['t']} at {x:.0f}, {y:.0f}"] = (left, y - 5, left + width, y + 5)
    return found


def end_of(spec: dict[str, Any], channel: str) -> list[float]:
    return list(spec["layer"][0]["encoding"][channel]["scale"]["domain"])


@pytest.mark.parametrize("frame", [WIDE, NARROW])
def test_no_label_lies_over_another(frame: Frame) -> None:
    found = boxes(spec_of(crowded(), frame))
    assert any("no contact" in name for name in found)
    assert sum(name.startswith("labels") for name in found) == 7
    assert any(name.startswith("steps: 1/30") for name in found)
    over = [(a, b) for a, b in itertools.combinations(found, 2) if chart_labels.overlap(found[a], found[b])]
    assert over == []


def test_a_segment_crosses_the_boxes_it_runs_through() -> None:
    box = (10.0, 10.0, 20.0, 20.0)
    assert chart_labels.crosses((0, 0, 30, 30), box)
    assert chart_labels.crosses((12, 12, 13, 13), box)  # inside
    assert not chart_labels.crosses((0, 12, 30, 45), box)  # past its lower left corner, though their extents meet
    assert not chart_labels.crosses((0, 21, 30, 21), box)


def test_a_drawing_keeps_every_number_and_name_of_its_specification() -> None:
    spec = spec_of(crowded(), WIDE)
    texts = [unescape(text) for text in re.findall(r">([^<>]+)</text>", svg_of(spec, "one"))]
    assert "0.001" in texts  # a tick: shortened as coordinates are, it would read 0.0
    for name in ("labels", "steps", "limit names", "words"):
        assert {row["t"].replace("  ", " ") for row in spec["datasets"][name]} <= {t.replace("  ", " ") for t in texts}


@pytest.mark.parametrize("name", SPECIAL)
def test_hostile_names_are_text_in_the_drawing_and_short_in_the_chart(name: str) -> None:
    maker = Maker()
    maker.ladder("a", f"{name}/default", 0.1, 1e-4)
    maker.cell("a", name, 60, {}, state="crashed", reason=name)
    view = View(document(maker, [case("a", "a", null={})]))
    svg = svg_of(spec_of(view, WIDE), "one")
    assert set(re.findall(r"<(\w+)", svg)) <= {"svg", "g", "path", "line", "text", "rect", "defs", "clipPath"}
    texts = [unescape(text) for text in re.findall(r">([^<>]+)</text>", svg)]
    shown = f"{name}/default"
    assert any(text.startswith(shown[:25]) for text in texts)
    assert max(map(len, texts)) <= 40
    assert "<script>alert(2)" not in page.render(view.document)
