"""Charts without rails: error against step with its fitted order, and the empty ones a script fills after a switch of
the error measure.
"""

from __future__ import annotations

import math
from typing import Any

import altair as alt
import pandas as pd
from impactbench.reports.chart_labels import LINE
from impactbench.reports.charts import INK, POWER, TOOLTIP, Style, decades, frame_of, short, span, theme
from impactbench.reports.page_data import FLOOR

WIDTH, HEIGHT = 560, 240
MARGIN = 270  # pixels right of the curves, for their names


def lines(data: Any, style: Style, x: alt.X, y: alt.Y) -> list[alt.Chart]:
    """Points joined in order of step; data has policy, engine, profile, step, step_text, error, cost, x, y."""
    dash = alt.StrokeDash(
        "profile:N", scale=alt.Scale(domain=["default", "other"], range=[[5, 3], [1, 0]]), legend=None
    )
    base = alt.Chart(data)
    joined = base.mark_line(strokeWidth=1.8).encode(
        x=x, y=y, color=style.color(), detail="policy:N", order=alt.Order("step:Q"), strokeDash=dash
    )
    marks = base.mark_point(size=52, filled=True, opacity=1).encode(
        x=x, y=y, color=style.color(), shape=style.shape(), tooltip=TOOLTIP
    )
    return [joined, marks]


def convergence(
    points: pd.DataFrame, orders: dict[str, Any], style: Style, titles: tuple[str, str]
) -> alt.LayerChart | alt.FacetChart:
    """Error against step, named at the right with the fitted order; errors at round-off sit on its line."""
    points = points.assign(x=points["step"], y=points["error"].clip(lower=FLOOR))
    xs, ys = span([*points["x"]], 0.1), span([*points["y"]], 0.1)
    wide = alt.Scale(
        type="log", domain=[10 ** xs[0], 10 ** (xs[0] + (xs[1] - xs[0]) * (1 + MARGIN / WIDTH))], nice=False
    )
    tall = alt.Scale(type="log", domain=[10 ** ys[0], 10 ** ys[1]], nice=False)
    ticks = points.drop_duplicates("x").sort_values("x")
    x = alt.X("x:Q", scale=wide, axis=alt.Axis(values=[*ticks["x"]], title=titles[0], labelExpr=_fractions(ticks)))
    y = alt.Y("y:Q", scale=tall, axis=alt.Axis(values=decades(ys), title=titles[1], labelExpr=POWER))
    fits = [
        {"x": o["fit"][0][0], "y": o["fit"][0][1], "x2": o["fit"][1][0], "y2": o["fit"][1][1]}
        for o in orders.values()
        if o
    ]
    layers = lines(points, style, x, y)
    if fits:
        rule = alt.Chart(frame_of(fits)).mark_rule(color=INK, opacity=0.8, strokeDash=[2, 2], strokeWidth=1)
        layers.append(rule.encode(x=x, y=y, x2="x2:Q", y2="y2:Q"))
    texts, leaders = _names(points, orders, xs, ys)
    rule = alt.Chart(leaders).mark_rule(color=INK, opacity=0.35, strokeWidth=0.8)
    text = alt.Chart(texts).mark_text(align="left", fontSize=11, baseline="middle")
    layers += [rule.encode(x=x, y=y, x2="x2:Q", y2="y2:Q"), text.encode(x=x, y=y, text="t:N")]
    return alt.layer(*layers, config=theme(), width=WIDTH + MARGIN, height=HEIGHT)


def _fractions(ticks: pd.DataFrame) -> str:
    """Ticks named as the steps were written; values that are written the same way are equal."""
    pairs = [
        f"abs(datum.value / {x!r} - 1) < 1e-6 ? '{t}'" for x, t in zip(ticks["x"], ticks["step_text"], strict=True)
    ]
    return " : ".join([*pairs, "''"])


def _names(
    points: pd.DataFrame, orders: dict[str, Any], xs: tuple[float, float], ys: tuple[float, float]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Names in a column right of the curves, as close to their coarse ends as there is room, and leaders to them."""
    ends = points.sort_values("x").drop_duplicates("policy", keep="last").sort_values("y", ascending=False)
    scale = HEIGHT / (ys[1] - ys[0])
    wanted = [(ys[1] - math.log10(y)) * scale for y in ends["y"]]
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
    for (_, end), row in zip(ends.iterrows(), rows, strict=True):
        found, y = orders.get(str(end["policy"])), 10 ** (ys[1] - row / scale)
        name = f"{short(str(end['policy']))}  " + (
            f"order {found['slope']:.2f} (r² {found['r2']:.2f})" if found else "no order"
        )
        texts.append({"x": at, "y": y, "t": name})
        leaders.append({"x": end["x"], "y": end["y"], "x2": at, "y2": y})
    return frame_of(texts), frame_of(leaders)


def blank(style: Style) -> dict[str, Any]:
    """Specification with named data that a script fills: both axes logarithmic, lines named at their finest step."""
    x = alt.X("x:Q", scale=alt.Scale(type="log", nice=False, padding=24), axis=alt.Axis(title="x", labelExpr=POWER))
    y = alt.Y("y:Q", scale=alt.Scale(type="log", nice=False, padding=12), axis=alt.Axis(title="y", labelExpr=POWER))
    data = alt.NamedData("points")
    name = alt.Chart(data).mark_text(align="left", dx=8, fontSize=11).encode(x=x, y="label_y:Q", text="label:N")
    chart = alt.layer(*lines(data, style, x, y), name, config=theme(), width=WIDTH + 150, height=HEIGHT)
    return chart.to_dict(validate=False)
