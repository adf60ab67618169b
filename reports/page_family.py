"""One family of scenes on the page: charts of one of its cases, tables of all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from impactbench.reports import charts, charts_plain
from impactbench.reports.chart_svg import Drawing, rounded
from impactbench.reports.page_data import amount, listing, order, words
from impactbench.reports.page_scores import reach

if TYPE_CHECKING:
    from impactbench.reports.page_view import View

MAX_CHARTS = 24  # each costs some 60 kB (drawing and specification) and a quarter of a second


def section(view: View, index: int, family: str, names: list[str]) -> dict[str, Any]:
    """One family: the charts of one of its cases and the tables of all."""
    drawable = view.drawable()
    charted = [name for name in names if (drawable["case"] == name).any()]
    timed = [name for name in charted if drawable.loc[drawable["case"] == name, "timed"].any()]
    name = view.featured if view.featured in names else (timed or charted or names)[0]
    case = view.cases[name]
    points = drawable[drawable["case"] == name]
    orders = {policy: order(line) for policy, line in view.of(name).items()}
    drawn = len(points) > 0 and index < MAX_CHARTS
    differences = [row for row in view.document.get("law_difference", []) if row["case"] in names]
    measures = shown_measures(view, case, points)
    return {
        "id": f"family-{index}",
        "family": family,
        "case": case,
        "names": names,
        "unit": view.unit_of(name),
        "chart": speed_chart(view, f"chart-{index}", case, points) if drawn else None,
        "convergence": convergence_chart(view, f"order-{index}", case, points, orders) if drawn else None,
        "reach": reach(view, name),
        "phases": len({cell["phase"] for cell in view.document["cells"] if cell["case"] == name}),
        "orders": orders,
        "measures": measure_table(view, name),
        "shown": measures,
        "rungs": rung_data(view, points, measures) if drawn else None,
        "data": points.sort_values(["policy", "step"]).to_dict("records"),
        "others": finest_errors(view, names),
        "laws": [row for row in differences if row["value"]],
        "same_laws": [row for row in differences if not row["value"]],
        "failed": failures(view, name).to_dict("records"),
    }


NO_ERROR = ("wall_", "restitution_measured", "offset_energy", "null_", "floor_", "self_horizon")
"""Measures that are no errors: nothing to draw a speed against."""


def shown_measures(view: View, case: dict[str, Any], points: pd.DataFrame) -> list[str]:
    """Error measures of a case, its headline first."""
    known = [m for m in view.measures if not m.startswith(NO_ERROR) and m in points and points[m].notna().any()]
    return sorted(known, key=lambda measure: measure != case["headline"])


def rung_data(view: View, points: pd.DataFrame, measures: list[str]) -> dict[str, Any]:
    """What a script draws after a switch of the measure: one row a rung, errors unsigned."""
    rows = [
        [view.policies.index(rung["policy"]), float(f"{rung['step']:.6g}"), rung["step_text"], _short(rung["cost"])]
        + [_short(rung[measure]) for measure in measures]
        for _, rung in points.sort_values(["policy", "step"]).iterrows()
    ]
    return {"measures": measures, "units": [view.units[measure] for measure in measures], "rows": rows}


def _short(value: float) -> float | None:
    return None if np.isnan(value) else float(f"{abs(value):.3g}")


def titles_of(view: View, case: dict[str, Any], points: pd.DataFrame) -> tuple[str, str]:
    """What the error and the cost of a case are."""
    unit = view.unit_of(case["name"])
    over = f"{words(case['headline'])}" + (" (1 = the scene's own scale)" if unit == "1" else f" [{unit}]")
    timed = bool(points["timed"].all())
    return over, "wall time per simulated second [ms]" if timed else "steps per simulated second (not timed)"


COLUMNS = ["policy", "engine", "profile", "step", "step_text", "error", "cost", "low", "high", "timed"]


def speed_chart(view: View, name: str, case: dict[str, Any], points: pd.DataFrame) -> dict[str, Any]:
    """Specification and static drawing of cost against error."""
    over, cost = titles = titles_of(view, case, points)
    limits = [
        (float(points[column].abs().median()), label)
        for kind, label in (("null", "null model"), ("floor", "the truth's own floor"))
        if (column := f"{kind}_{case['headline']}") in points and points[column].notna().any()
    ]
    limits += [(value, words(name)) for name, value in case.get("null", {}).items() if value]
    limits += [(case["floor"], "round-off")] if "floor" in case else []
    with charts.debug_mode(False):  # no validation of every part against the schema: it doubles the time
        plot = charts.work_precision(points[COLUMNS], failures(view, case["name"]), view.style, titles, limits)
        plot = plot.properties(description=f"{cost} against {over}; the table below holds the same data")
        spec = rounded(plot.to_dict(validate=False))
    timed = bool(points["timed"].all())
    return {"id": name, "spec": spec, "svg": Drawing(spec, name), "timed": timed, "over": over, "cost": cost}


def convergence_chart(
    view: View, name: str, case: dict[str, Any], points: pd.DataFrame, orders: dict[str, Any]
) -> dict[str, Any] | None:
    """Static drawing of error against step with the fitted orders; None where nobody took three steps."""
    stepped = points[points["step"] > 0]
    if stepped["step"].nunique() < 3:
        return None
    over = titles_of(view, case, points)[0]
    with charts.debug_mode(False):
        plot = charts_plain.convergence(stepped[COLUMNS], orders, view.style, ("step [s]", over))
        plot = plot.properties(description=f"{over} against step; the table below holds the same data")
        return {"id": name, "svg": Drawing(plot.to_dict(validate=False), name)}


def failures(view: View, case: str) -> pd.DataFrame:
    """Rungs of a case without a result, one line for each policy, state and reason."""
    rungs = view.rungs[view.rungs["case"] == case]
    silent = (rungs["state"] == "ok") & rungs["error"].isna()  # ran, but the headline is not defined here
    rungs = rungs.assign(state=rungs["state"].mask(silent, "no figure"))
    bad = rungs[rungs["state"] != "ok"]
    grouped = bad.groupby(["policy", "engine", "state", "reason"], sort=False)["step_text"]
    return grouped.agg(lambda texts: listing(text or "every step" for text in texts)).reset_index(name="steps")


def measure_table(view: View, case: str) -> dict[str, Any]:
    """Every measure by policy, at the finest step that all stepping policies with a result share."""
    ran = {p: line[line["state"] == "ok"] for p, line in view.of(case).items()}
    ran = {p: line for p, line in ran.items() if len(line)}
    ladders = [set(line["step"]) for line in ran.values() if (line["step"] > 0).any()]
    common = min(set.intersection(*ladders), default=None) if ladders else None
    chosen = {}
    for policy, line in ran.items():
        same = line[line["step"] == common]
        chosen[policy] = (same if len(same) else line.sort_values("step")).iloc[0]
    rows = [
        {
            "name": measure,
            "unit": view.units[measure],
            "values": [rung.get(measure, np.nan) for rung in chosen.values()],
        }
        for measure in view.measures
    ]
    rows = [row for row in rows if not all(np.isnan(value) for value in row["values"])]
    steps = [rung["step_text"] or "none" for rung in chosen.values()]
    return {"policies": list(chosen), "steps": steps, "rows": rows}


def finest_errors(view: View, names: list[str]) -> list[dict[str, Any]]:
    """Headline error of every case of a family at each policy's finest step, or the state it ended in."""
    return [
        {"case": view.cases[name], "cells": [finest(view, name, policy) for policy in view.policies]} for name in names
    ]


def finest(view: View, case: str, policy: str) -> str:
    """Headline error at the finest step, or why there is none."""
    line = view.lines.get((case, policy))
    if line is None:
        return "–"
    rung = line.sort_values("step").iloc[0]
    if rung["state"] != "ok":
        return str(rung["state"])
    return amount(rung["error"], view.unit_of(case)) if rung["error"] >= 0 else "–"
