"""Speed-against-error charts: Altair specifications, drawn once more as SVG for readers without scripts.

Everything that is not a curve (floor rail, rail of cells without a result, labels) is laid out in pixels here and
turned back into data values, so that one pair of logarithmic scales carries the whole picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
import pandas as pd
from altair.utils.schemapi import debug_mode as debug_mode
from impactbench.reports.chart_labels import LETTER, LINE, Box, between, place
from impactbench.reports.page_data import FLOOR, TARGET, isolated

# Okabe and Ito's palette without yellow (illegible on white) and black (illegible on a dark page).
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C")
# Eight shapes against seven colours: 56 policies before a pair repeats.
SHAPES = ("circle", "square", "triangle-up", "diamond", "cross", "triangle-down", "triangle-right", "triangle-left")
WIDTH, HEIGHT = 780, 290
FLOOR_RAIL, FAIL_RAIL = 54, 210  # pixels
INK = "currentColor"  # follows the page, in its light and its dark scheme


@dataclass(frozen=True)
class Axes:
    """Two logarithmic scales and the pixel rails beside them; `fail` is 0 when every cell has a result."""

    x: tuple[float, float]
    y: tuple[float, float]
    fail: int

    @property
    def main(self) -> int:
        """Width in pixels of the part that holds curves."""
        return WIDTH - FLOOR_RAIL - self.fail

    def at_x(self, pixel: float) -> float:
        """Error drawn at this pixel from the left."""
        low, high = self.x
        return float(10 ** (low + (pixel - FLOOR_RAIL) / self.main * (high - low)))

    def at_y(self, pixel: float) -> float:
        """Cost drawn at this pixel from the top."""
        low, high = self.y
        return float(10 ** (high - pixel / HEIGHT * (high - low)))

    def pixel(self, error: float, cost: float) -> tuple[float, float]:
        """Where a point is drawn; errors at or below the floor sit on the floor rail."""
        x = FLOOR_RAIL / 2
        if error > FLOOR:
            x = FLOOR_RAIL + (math.log10(error) - self.x[0]) / (self.x[1] - self.x[0]) * self.main
        return x, (self.y[1] - math.log10(cost)) / (self.y[1] - self.y[0]) * HEIGHT


def span(values: list[float], pad: float) -> tuple[float, float]:
    """Decimal logarithms of the smallest and largest value, at least one decade apart, with room around."""
    logs = [math.log10(v) for v in values] or [0.0]
    low, high = min(logs) - pad, max(logs) + pad
    short = max(0.0, 1.0 - (high - low)) / 2
    return low - short, high + short


def short(text: str, length: int = 26) -> str:
    """Label for a chart, cut where it would run over its neighbours; tables show names whole."""
    return isolated(text if len(text) <= length else text[: length - 1] + "…")


def pareto(points: pd.DataFrame) -> pd.DataFrame:
    """Points that no other point beats in both error and cost, by rising error."""
    best, keep = math.inf, []
    for index, row in points.sort_values(["error", "cost"]).iterrows():
        if row["cost"] < best:
            best = row["cost"]
            keep.append(index)
    return points.loc[keep]


@dataclass(frozen=True)
class Style:
    """Colour per engine and shape per policy, the same in every chart of a page."""

    engines: list[str]
    policies: list[str]

    def color(self) -> alt.Color:
        """Colour of the engine, without a legend: lines are labelled at their ends."""
        scale = alt.Scale(domain=self.engines, range=[PALETTE[i % 7] for i in range(len(self.engines))])
        return alt.Color("engine:N", scale=scale, legend=None)

    def shape(self) -> alt.Shape:
        """Shape of the policy, so that colour is never the only sign."""
        scale = alt.Scale(domain=self.policies, range=[SHAPES[i % 8] for i in range(len(self.policies))])
        return alt.Shape("policy:N", scale=scale, legend=None)


TOOLTIP = [
    alt.Tooltip("policy:N", title="policy"),
    alt.Tooltip("step_text:N", title="step [s]"),
    alt.Tooltip("error:Q", title="error", format=".3g"),
    alt.Tooltip("cost:Q", title="cost", format=".3g"),
]


def frame_of(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Frame of a few layout items."""
    return pd.DataFrame(rows)


def work_precision(
    points: pd.DataFrame,
    failed: pd.DataFrame,
    style: Style,
    titles: tuple[str, str],
    limits: Sequence[tuple[float, str]] = (),
) -> alt.LayerChart | alt.FacetChart:
    """Cost against error, one line a policy in order of step.

    `points` has policy, engine, step, step_text, error, cost, low, high; `failed` has policy, engine, state, reason,
    steps; `titles` are those of the two axes; `limits` are errors to draw a line at, with their names.
    """
    shown = points[points["error"] > FLOOR]
    costs = [*points["cost"], *points["low"].dropna(), *points["high"].dropna()]
    axes = Axes(
        span([*shown["error"], TARGET, *(x for x, _ in limits if x > FLOOR)], 0.12),
        span([*costs, 1.6 * max(costs)], 0.15),
        FAIL_RAIL if len(failed) else 0,
    )
    spots = [axes.pixel(e, c) for e, c in zip(points["error"], points["cost"], strict=True)]
    points = points.assign(x=[axes.at_x(x) for x, _ in spots], y=points["cost"])
    layers = [*rails(axes), *target(axes), *bounds(limits, axes), *curves(points, style), *labels(points, spots, axes)]
    if len(failed):
        layers += fail_marks(failed, axes, style)
    aim = alt.param(name="target", value=TARGET)
    return alt.layer(*scaled(layers, axes, titles), config=theme(), width=WIDTH, height=HEIGHT).add_params(aim)


def scaled(layers: list[alt.Chart], axes: Axes, titles: tuple[str, str]) -> list[alt.Chart]:
    """Put every layer on the same two scales; ticks are whole decades inside the part that holds curves."""
    x_scale = alt.Scale(type="log", domain=[axes.at_x(0), axes.at_x(WIDTH)], nice=False)
    y_scale = alt.Scale(type="log", domain=[axes.at_y(HEIGHT), axes.at_y(0)], nice=False)
    x_axis = alt.Axis(values=decades(axes.x), format="~g", title=titles[0], labelExpr=POWER)
    y_axis = alt.Axis(values=decades(axes.y), format="~g", title=titles[1], labelExpr=POWER)
    first = layers[0].encode(x=alt.X("x:Q", scale=x_scale, axis=x_axis), y=alt.Y("y:Q", scale=y_scale, axis=y_axis))
    # The layers share their scales: what the first says holds for all, and need not be said again.
    return [first, *(layer.encode(x=alt.X("x:Q"), y=alt.Y("y:Q")) for layer in layers[1:])]


# d3 has no format that writes 0.001 plainly and 1e-9 briefly.
POWER = "datum.value >= 0.001 && datum.value < 10000 ? format(datum.value, '~g') : format(datum.value, '.0e')"


def decades(log_span: tuple[float, float]) -> list[float]:
    """Powers of ten inside a span of logarithms, thinned to at most nine."""
    powers = range(math.ceil(log_span[0]), math.floor(log_span[1]) + 1)
    return [10.0**p for p in powers][:: 1 + len(powers) // 10]


def rails(axes: Axes) -> list[alt.Chart]:
    """Bands left and right of the curves, and the corner to aim for."""
    bands = [{"x": axes.at_x(0), "x2": axes.at_x(FLOOR_RAIL - 6)}]
    texts = [{"x": axes.at_x(4), "t": "floor"}]
    if axes.fail:
        bands.append({"x": axes.at_x(WIDTH - axes.fail + 10), "x2": axes.at_x(WIDTH)})
        texts.append({"x": axes.at_x(WIDTH - axes.fail + 18), "t": "no result"})
    bands = [{**b, "y": axes.at_y(HEIGHT), "y2": axes.at_y(0)} for b in bands]
    texts = [{**t, "y": axes.at_y(10)} for t in texts]
    texts.append({"x": axes.at_x(FLOOR_RAIL + 4), "y": axes.at_y(HEIGHT - 9), "t": "↙ better"})
    return [
        alt.Chart(frame_of(bands)).mark_rect(opacity=0.07, fill=INK).encode(x2="x2:Q", y2="y2:Q"),
        alt.Chart(frame_of(texts)).mark_text(align="left", fontSize=10, fontStyle="italic").encode(text="t:N"),
    ]


def target(axes: Axes) -> list[alt.Chart]:
    """Line at the error target, which a script may move; not drawn where it would leave the part with curves."""
    low, high = (axes.at_x(pixel) for pixel in (FLOOR_RAIL, WIDTH - axes.fail))
    line = alt.Chart(frame_of([{"y": axes.at_y(0), "y2": axes.at_y(HEIGHT), "end": axes.at_y(HEIGHT - 9)}]))
    line = line.transform_calculate(x="target", t="format(100 * target, '~g') + ' %'")
    line = line.transform_filter(f"target > {low!r} && target < {high!r}")
    text = line.transform_calculate(y="datum.end").mark_text(align="left", dx=3, fontSize=10, fontStyle="italic")
    return [line.mark_rule(color=INK, opacity=0.6, strokeDash=[2, 3]).encode(y2="y2:Q"), text.encode(text="t:N")]


def bounds(limits: Sequence[tuple[float, str]], axes: Axes) -> list[alt.Chart]:
    """Named lines at errors that do not depend on a policy: what a frozen scene scores, what the truth is good for."""
    rows = [{"x": x, "y": axes.at_y(0), "y2": axes.at_y(HEIGHT), "t": name} for x, name in limits if x > FLOOR]
    if not rows:
        return []
    texts = [{**row, "y": axes.at_y(22 + 12 * k)} for k, row in enumerate(rows)]
    return [
        alt.Chart(frame_of(rows)).mark_rule(color=INK, opacity=0.5, strokeDash=[6, 3]).encode(y2="y2:Q"),
        alt.Chart(frame_of(texts)).mark_text(align="left", dx=3, fontSize=10, fontStyle="italic").encode(text="t:N"),
    ]


def curves(points: pd.DataFrame, style: Style) -> list[alt.Chart]:
    """Pareto front under everything, then interval bars, lines and points."""
    front = pareto(points) if points["timed"].all() else points.iloc[:0]
    dash = alt.StrokeDash(
        "profile:N", scale=alt.Scale(domain=["default", "other"], range=[[5, 3], [1, 0]]), legend=None
    )
    base = alt.Chart(points)
    interval = points[points["high"] > points["low"]]
    bars = alt.Chart(interval.assign(y=interval["low"])).mark_rule(strokeWidth=1.5, opacity=0.6)
    return [
        alt.Chart(front).mark_line(strokeWidth=11, opacity=0.16, color=INK, strokeCap="round").encode(order="x:Q"),
        bars.encode(color=style.color(), y2="high:Q"),
        base.mark_line(strokeWidth=1.8).encode(
            color=style.color(), detail="policy:N", order=alt.Order("step:Q", sort="descending"), strokeDash=dash
        ),
        base.mark_point(size=52, filled=True, opacity=1).encode(
            color=style.color(), shape=style.shape(), tooltip=TOOLTIP
        ),
    ]


def labels(points: pd.DataFrame, spots: list[tuple[float, float]], axes: Axes) -> list[alt.Chart]:
    """Policy and finest step at each line's fine end, the coarsest step at the other."""
    numbered = points.assign(row=range(len(points)))
    wanted: list[tuple[float, float, str]] = []
    segments: list[Box] = []
    for policy, line in numbered.groupby("policy", sort=False):
        ordered = line.sort_values("step")
        segments += between([spots[int(row)] for row in ordered["row"]])
        name = f"{short(str(policy))}  {ordered.iloc[0]['step_text']}".rstrip()
        wanted.append((*spots[int(ordered.iloc[0]["row"])], name))
        if len(ordered) > 1:
            wanted.append((*spots[int(ordered.iloc[-1]["row"])], str(ordered.iloc[-1]["step_text"])))
    wanted.sort(key=lambda item: -len(item[2]))  # names first: they are the ones that must stay close
    placed = place(
        wanted,
        [(x - 6, y - 6, x + 6, y + 6) for x, y in spots],
        segments,
        (FLOOR_RAIL / 2, 0, WIDTH - axes.fail, HEIGHT),
    )
    texts, leaders = [], []
    for (x, y, text), (left, middle) in zip(wanted, placed, strict=True):
        texts.append({"x": axes.at_x(left), "y": axes.at_y(middle), "t": text})
        near = left if left > x else left + LETTER * len(text)
        if abs(middle - y) > LINE:  # moved aside: say which point it belongs to
            ends = {"x2": axes.at_x(near), "y2": axes.at_y(middle)}
            leaders.append({"x": axes.at_x(x), "y": axes.at_y(y), **ends})
    found = [alt.Chart(frame_of(texts)).mark_text(align="left", fontSize=11, baseline="middle").encode(text="t:N")]
    if leaders:
        rule = alt.Chart(frame_of(leaders)).mark_rule(color=INK, opacity=0.45, strokeWidth=0.8)
        found.append(rule.encode(x2="x2:Q", y2="y2:Q"))
    return found


def fail_marks(failed: pd.DataFrame, axes: Axes, style: Style) -> list[alt.Chart]:
    """One mark in the right rail for every policy and state without a result, with the reason in its tooltip."""
    pitch = min(26.0, (HEIGHT - 40) / len(failed))
    left = WIDTH - axes.fail + 22
    rows = [34 + pitch * i for i in range(len(failed))]
    marked = failed.assign(x=axes.at_x(left), y=[axes.at_y(y) for y in rows])
    words = [f"{short(p, 18)} {s}" for p, s in zip(failed["policy"], failed["state"], strict=True)]
    named = marked.assign(x=axes.at_x(left + 10), t=[short(word, 31) for word in words])
    tooltip = ["policy:N", "state:N", "steps:N", "reason:N"]
    return [
        alt.Chart(marked)
        .mark_point(size=60, strokeWidth=1.8, filled=False, opacity=1)
        .encode(color=style.color(), shape=style.shape(), tooltip=tooltip),
        alt.Chart(named).mark_text(align="left", fontSize=10, baseline="middle").encode(text="t:N", tooltip=tooltip),
    ]


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
