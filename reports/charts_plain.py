"""Charts without rails: error against step with its fitted order, and the empty ones a script fills after a switch of
the error measure.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import altair as alt
from impactbench.reports.chart_labels import LINE
from impactbench.reports.chart_layout import DRAWN, Row, decades, short, span
from impactbench.reports.charts import (
    DASH,
    DETAIL,
    ENDS,
    INK,
    POWER,
    TEXT,
    TOOLTIP,
    Style,
    debug_mode,
    filled,
    layered,
    on,
    scale,
    theme,
)
from impactbench.reports.page_data import FLOOR

WIDTH, HEIGHT = 560, 240
MARGIN = 270  # pixels right of the curves, for their names


def lines(data: str, style: Style) -> list[alt.Chart]:
    """Points joined in order of step; data has policy, engine, profile, step, step_text, error, cost, x, y."""
    joined = on(data).mark_line(strokeWidth=1.8)
    marks = on(data).mark_point(size=52, filled=True, opacity=1)
    return [
        joined.encode(color=style.color(), detail=DETAIL, order=alt.Order("step:Q"), strokeDash=DASH),
        marks.encode(color=style.color(), shape=style.shape(), tooltip=TOOLTIP),
    ]


@functools.lru_cache(4)
def order_layers(style: Style) -> dict[str, Any]:
    """What a chart of error against step is made of, from back to front."""
    fit = on("fits").mark_rule(color=INK, opacity=0.8, strokeDash=[2, 2], strokeWidth=1)
    leader = on("leaders").mark_rule(color=INK, opacity=0.35, strokeWidth=0.8)
    name = on("names").mark_text(align="left", fontSize=11, baseline="middle").encode(text=TEXT)
    rules = [rule.encode(**ENDS) for rule in (fit, leader)]
    return layered([*lines("points", style), *rules, name], WIDTH + MARGIN, HEIGHT)


def convergence(points: list[Row], orders: dict[str, Any], style: Style, titles: tuple[str, str]) -> dict[str, Any]:
    """Specification of error against step, named at the right with the fitted order; errors at round-off sit on its
    line.
    """
    points = [
        {**{key: point[key] for key in DRAWN}, "x": point["step"], "y": max(point["error"], FLOOR)} for point in points
    ]
    xs, ys = span([point["x"] for point in points], 0.1), span([point["y"] for point in points], 0.1)
    ticks = dict(sorted({point["x"]: point["step_text"] for point in reversed(points)}.items()))
    fits = [
        {"x": o["fit"][0][0], "y": o["fit"][0][1], "x2": o["fit"][1][0], "y2": o["fit"][1][1]}
        for o in orders.values()
        if o
    ]
    names, leaders = _names(points, orders, xs, ys)
    spec = filled(order_layers(style), {"points": points, "fits": fits, "leaders": leaders, "names": names})
    wide = [10 ** xs[0], 10 ** (xs[0] + (xs[1] - xs[0]) * (1 + MARGIN / WIDTH))]
    scale(spec, "x", wide, values=list(ticks), title=titles[0], labelExpr=_fractions(ticks))
    scale(spec, "y", [10 ** ys[0], 10 ** ys[1]], values=decades(ys), title=titles[1])
    return spec


def _fractions(ticks: dict[float, str]) -> str:
    """Ticks named as the steps were written; values that are written the same way are equal."""
    pairs = [f"abs(datum.value / {x!r} - 1) < 1e-6 ? '{text}'" for x, text in ticks.items()]
    return " : ".join([*pairs, "''"])


def _names(
    points: list[Row], orders: dict[str, Any], xs: tuple[float, float], ys: tuple[float, float]
) -> tuple[list[Row], list[Row]]:
    """Names in a column right of the curves, as close to their coarse ends as there is room, and leaders to them."""
    coarsest = {point["policy"]: point for point in sorted(points, key=lambda point: float(point["x"]))}
    ends = sorted(coarsest.values(), key=lambda point: -float(point["y"]))
    scale = HEIGHT / (ys[1] - ys[0])
    wanted = [(ys[1] - math.log10(end["y"])) * scale for end in ends]
    rows: list[float] = []
    for want in wanted:
        rows.append(max(want, rows[-1] + LINE if rows else 6.0))
    surplus = max(0.0, rows[-1] - (HEIGHT - 4))
    for k in range(len(rows) - 1, -1, -1):
        rows[k] = min(
            rows[k] - (surplus if k == len(rows) - 1 else 0), rows[k + 1] - LINE if k + 1 < len(rows) else HEIGHT
        )
    at = 10 ** (xs[0] + (xs[1] - xs[0]) * (1 + 16 / WIDTH))
    texts, leaders = [], []
    for end, row in zip(ends, rows, strict=True):
        found, y = orders.get(end["policy"]), 10 ** (ys[1] - row / scale)
        name = f"{short(end['policy'])}  " + (
            f"order {found['slope']:.2f} (r² {found['r2']:.2f})" if found else "no order"
        )
        texts.append({"x": at, "y": y, "t": name})
        leaders.append({"x": end["x"], "y": end["y"], "x2": at, "y2": y})
    return texts, leaders


def blank(style: Style) -> dict[str, Any]:
    """Specification with named data that a script fills: both axes logarithmic, lines named at their finest step."""
    x = alt.X("x:Q", scale=alt.Scale(type="log", nice=False, padding=24), axis=alt.Axis(title="x", labelExpr=POWER))
    y = alt.Y("y:Q", scale=alt.Scale(type="log", nice=False, padding=12), axis=alt.Axis(title="y", labelExpr=POWER))
    with debug_mode(False):
        name = (
            on("points")
            .mark_text(align="left", dx=8, fontSize=11)
            .encode(x=x, y=alt.Y("label_y:Q"), text=alt.Text("label:N"))
        )
        curves = [layer.encode(x=x, y=y) for layer in lines("points", style)]
        chart = alt.layer(*curves, name, config=theme(), width=WIDTH + 150, height=HEIGHT)
        return chart.to_dict(validate=False)
