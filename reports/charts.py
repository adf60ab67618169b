"""Speed-against-error charts: Altair specifications, drawn once more as SVG for readers without scripts.

Altair describes each kind of chart once, on data known by name only; a chart is a copy of that with its data, the ends
of its scales and its titles filled in.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
from altair.utils.schemapi import debug_mode as debug_mode
from impactbench.reports.chart_layout import (
    FAIL,
    WIDE,
    Axes,
    Frame,
    Row,
    bounds,
    curves,
    decades,
    fail_marks,
    labels,
    rails,
    span,
    target,
)
from impactbench.reports.page_data import FLOOR, TARGET

# Okabe and Ito's palette without yellow (illegible on white) and black (illegible on a dark page).
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C")
# Eight shapes against seven colours: 56 policies before a pair repeats.
SHAPES = ("circle", "square", "triangle-up", "diamond", "cross", "triangle-down", "triangle-right", "triangle-left")
INK = "currentColor"  # follows the page, in its light and its dark scheme


@dataclass(frozen=True)
class Style:
    """Colour per engine and shape per policy, the same in every chart of a page."""

    engines: tuple[str, ...]
    policies: tuple[str, ...]

    def color(self) -> alt.Color:
        """Colour of the engine, without a legend: lines are labelled at their ends."""
        scale = alt.Scale(domain=list(self.engines), range=[PALETTE[i % 7] for i in range(len(self.engines))])
        return alt.Color("engine:N", scale=scale, legend=None)

    def shape(self) -> alt.Shape:
        """Shape of the policy, so that colour is never the only sign."""
        scale = alt.Scale(domain=list(self.policies), range=[SHAPES[i % 8] for i in range(len(self.policies))])
        return alt.Shape("policy:N", scale=scale, legend=None)


TOOLTIP = [
    alt.Tooltip("policy:N", title="policy"),
    alt.Tooltip("step_text:N", title="step [s]"),
    alt.Tooltip("error:Q", title="error", format=".3g"),
    alt.Tooltip("cost:Q", title="cost", format=".3g"),
]
DASH = alt.StrokeDash("profile:N", scale=alt.Scale(domain=["default", "other"], range=[[5, 3], [1, 0]]), legend=None)
DETAIL = alt.Detail("policy:N")
# Channels, not their shorthand: that is looked up in the whole schema.
PLACE: dict[str, Any] = {"x": alt.X("x:Q"), "y": alt.Y("y:Q")}
ENDS: dict[str, Any] = {"x2": alt.X2("x2:Q"), "y2": alt.Y2("y2:Q")}
TEXT = alt.Text("t:N")
SIDE: dict[str, Any] = {"align": alt.ExprRef("datum.side")}
BACKWARDS = alt.Order("step:Q", sort="descending")


def work_precision(
    points: list[Row],
    failed: list[Row],
    style: Style,
    titles: tuple[str, str],
    limits: Sequence[tuple[float, str]] = (),
    frame: Frame = WIDE,
) -> dict[str, Any]:
    """Specification of cost against error, one line a policy in order of step.

    `points` have policy, engine, profile, step, step_text, error, cost, low, high, timed; `failed` have policy, engine,
    state, reason, steps; `titles` are those of the two axes; `limits` are errors to draw a line at, with their names.
    A narrow `frame` is for the width of a phone.
    """
    shown = [point["error"] for point in points if point["error"] > FLOOR]
    costs = [point[key] for point in points for key in ("cost", "low", "high") if not math.isnan(point[key])]
    axes = Axes(
        span([*shown, TARGET, *(x for x, _ in limits if x > FLOOR)], 0.12),
        span([*costs, 1.6 * max(costs)], 0.15),
        frame if failed else frame._replace(fail=0),
    )
    spots = [axes.pixel(point["error"], point["cost"]) for point in points]
    data = {
        **rails(axes, spots),
        **target(axes),
        **bounds(limits, axes, spots),
        **curves(points, spots, axes),
        **labels(points, spots, axes, limits),
        "failed": fail_marks(failed, axes),
    }
    spec = {**filled(speed_layers(style), data), "width": frame.width, "height": frame.height}
    x_ends, y_ends = [axes.at_x(0), axes.at_x(frame.width)], [axes.at_y(frame.height), axes.at_y(0)]
    scale(spec, "x", x_ends, values=decades(axes.x, frame.width // 80), title=titles[0])
    scale(spec, "y", y_ends, values=decades(axes.y), title=titles[1])
    return spec


def filled(template: dict[str, Any], data: dict[str, list[Row]]) -> dict[str, Any]:
    """Copy of a layered specification with its named data; a layer that has none is left out."""
    spec = copy.deepcopy(template)
    spec["datasets"] = {name: rows for name, rows in data.items() if rows}
    spec["layer"] = [layer for layer in spec["layer"] if layer["data"]["name"] in spec["datasets"]]
    return spec


def scale(spec: dict[str, Any], channel: str, ends: list[float], **axis: Any) -> None:
    """Set the ends of a scale and what its axis says; the layers share what the first of them says."""
    encoding = spec["layer"][0]["encoding"][channel]
    encoding["scale"]["domain"] = ends
    encoding["axis"] |= axis


def layered(layers: list[alt.Chart], width: int, height: int) -> dict[str, Any]:
    """Specification of layers on one pair of logarithmic scales; their data, ends and ticks are filled in later."""
    with debug_mode(False):  # no validation of every part against the schema: it doubles the time
        log, axis = alt.Scale(type="log", nice=False), alt.Axis(labelExpr=POWER)
        # What the first says of the shared scales holds for all, and need not be said again.
        first = layers[0].encode(x=alt.X("x:Q", scale=log, axis=axis), y=alt.Y("y:Q", scale=log, axis=axis))
        chart = alt.layer(first, *layers[1:], config=theme(), width=width, height=height)
        return chart.to_dict(validate=False)


def on(name: str) -> alt.Chart:
    """Layer on data that are filled in by name, placed by their x and y."""
    return alt.Chart(alt.NamedData(name)).encode(**PLACE)


@functools.lru_cache(4)
def speed_layers(style: Style) -> dict[str, Any]:
    """What a chart of cost against error is made of, from back to front; Altair takes longer for it than to draw."""
    aim = on("target").transform_calculate(x="target", t="format(100 * target, '~g') + ' %'")
    aim = aim.transform_filter("target > datum.low && target < datum.high")
    small: dict[str, Any] = {"align": "left", "fontSize": 10, "fontStyle": "italic"}
    line = on("points").mark_line(strokeWidth=1.8)
    mark = on("points").mark_point(size=52, filled=True, opacity=1)
    tooltip = [alt.Tooltip(field + ":N") for field in ("policy", "state", "steps", "reason")]
    cross = on("failed").mark_point(size=60, strokeWidth=1.8, filled=False, opacity=1)
    reason = on("failed").mark_text(align="left", dx=FAIL, fontSize=10, baseline="middle")
    spec = layered(
        [
            on("bands").mark_rect(opacity=0.07, fill=INK).encode(**ENDS),
            on("words").mark_text(**small).encode(text=TEXT),
            aim.mark_rule(color=INK, opacity=0.6, strokeDash=[2, 3]).encode(y2=ENDS["y2"]),
            aim.transform_calculate(y="datum.end").mark_text(dx=3, **small).encode(text=TEXT),
            on("limits").mark_rule(color=INK, opacity=0.5, strokeDash=[6, 3]).encode(y2=ENDS["y2"]),
            on("limit names").mark_text(baseline="middle", **small | SIDE).encode(text=TEXT),
            on("front")
            .mark_line(strokeWidth=11, opacity=0.16, color=INK, strokeCap="round")
            .encode(order=alt.Order("x:Q")),
            on("intervals").mark_rule(strokeWidth=1.5, opacity=0.6).encode(color=style.color(), y2=alt.Y2("high:Q")),
            line.encode(color=style.color(), detail=DETAIL, order=BACKWARDS, strokeDash=DASH),
            mark.encode(color=style.color(), shape=style.shape(), tooltip=TOOLTIP),
            on("labels").mark_text(fontSize=11, baseline="middle", **SIDE).encode(text=TEXT),
            on("steps").mark_text(**SIDE, fontSize=9, opacity=0.85, baseline="middle").encode(text=TEXT),
            on("leaders").mark_rule(color=INK, opacity=0.45, strokeWidth=0.8).encode(**ENDS),
            cross.encode(color=style.color(), shape=style.shape(), tooltip=tooltip),
            reason.encode(text=TEXT, tooltip=tooltip),
        ],
        WIDE.width,
        WIDE.height,
    )
    for channel in ("x", "y"):
        spec["layer"][0]["encoding"][channel]["axis"]["format"] = "~g"
    return {**spec, "params": [{"name": "target", "value": TARGET}]}


# d3 has no format that writes 0.001 plainly and 1e-9 briefly.
POWER = "datum.value >= 0.001 && datum.value < 10000 ? format(datum.value, '~g') : format(datum.value, '.0e')"


def theme() -> alt.Config:
    """Quiet axes in the page's own ink on no background."""
    axis = alt.AxisConfig(
        labelColor=INK,
        titleColor=INK,
        tickColor=INK,
        domainColor=INK,
        gridColor=INK,
        gridOpacity=0.13,
        domainOpacity=0.4,
        tickOpacity=0.4,
        titleFontWeight="normal",
        labelFontSize=11,
        titleFontSize=12,
    )
    text = alt.MarkConfig(color=INK, fill=INK)
    view = alt.ViewConfig(stroke=None)
    return alt.Config(background="transparent", font="system-ui, sans-serif", view=view, axis=axis, text=text)
