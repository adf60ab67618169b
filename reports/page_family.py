"""One family of scenes on the page: charts of one of its cases, tables of all."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING, Any

from impactbench.reports import charts, charts_plain
from impactbench.reports.chart_layout import NARROW, WIDE
from impactbench.reports.chart_svg import Drawing, rounded
from impactbench.reports.page_data import FLOOR, Rung, amount, listing, order, words
from impactbench.reports.page_scores import reach

if TYPE_CHECKING:
    from impactbench.reports.page_view import View

MAX_CHARTS = 24
"""Each costs some 60 kB (drawing and specification) and a quarter of a second; fewer where they do not fit."""


def section(view: View, index: int, family: str, names: list[str]) -> dict[str, Any]:
    """One family: the charts of one of its cases and the tables of all."""
    charted = [name for name in names if view.points(name)]
    timed = [name for name in charted if any(point["timed"] for point in view.points(name))]
    name = view.featured if view.featured in names else (timed or charted or names)[0]
    case = view.cases[name]
    points = view.points(name)
    ordered = sorted(points, key=lambda point: (point["policy"], point["step"]))
    orders = {policy: order(line) for policy, line in view.of(name).items()}
    drawn = len(points) > 0 and (index < view.most_charts or name == view.featured)
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
        "rungs": rung_data(view, ordered, measures) if drawn else None,
        "limited": len(points) > 0 and not drawn,
        "data": ordered if drawn or not view.sparse else [],
        "others": finest_errors(view, names),
        "laws": [row for row in differences if abs(row["value"]) > FLOOR],
        "same_laws": [row for row in differences if abs(row["value"]) <= FLOOR],
        "failed": failures(view, name),
    }


NO_ERROR = ("wall_", "restitution_measured", "offset_energy", "null_", "floor_", "self_horizon")
"""Measures that are no errors: nothing to draw a speed against."""


def shown_measures(view: View, case: dict[str, Any], points: list[Rung]) -> list[str]:
    """Error measures of a case, its headline first."""
    known = [m for m in view.measures if not m.startswith(NO_ERROR) and measured(points, m)]
    return sorted(known, key=lambda measure: measure != case["headline"])


def measured(points: list[Rung], measure: str) -> list[float]:
    """Values of a measure where it was taken."""
    values = (float(point.get(measure, math.nan)) for point in points)
    return [value for value in values if not math.isnan(value)]


def rung_data(view: View, points: list[Rung], measures: list[str]) -> dict[str, Any]:
    """What a script draws after a switch of the measure: one row a rung, errors unsigned."""
    rows = [
        [view.policies.index(rung["policy"]), float(f"{rung['step']:.6g}"), rung["step_text"], _short(rung["cost"])]
        + [_short(rung[measure]) for measure in measures]
        for rung in points
    ]
    return {"measures": measures, "units": [view.units[measure] for measure in measures], "rows": rows}


def _short(value: float) -> float | None:
    return None if math.isnan(value) else float(f"{abs(value):.3g}")


def titles_of(view: View, case: dict[str, Any], points: list[Rung]) -> tuple[str, str]:
    """What the error and the cost of a case are."""
    unit = view.unit_of(case["name"])
    over = f"{words(case['headline'])}" + (" (1 = the scene's own scale)" if unit == "1" else f" [{unit}]")
    timed = all(point["timed"] for point in points)
    return over, "wall time per simulated second [ms]" if timed else "steps per simulated second (not timed)"


def speed_chart(view: View, name: str, case: dict[str, Any], points: list[Rung]) -> dict[str, Any]:
    """Specification and static drawing of cost against error."""
    over, cost = titles = titles_of(view, case, points)
    limits = [
        (statistics.median(map(abs, values)), label)
        for kind, label in (("null", "null model"), ("floor", "the truth's own floor"))
        if (values := measured(points, f"{kind}_{case['headline']}"))
    ]
    limits += [(value, words(name)) for name, value in case.get("null", {}).items() if value]
    limits += [(case["floor"], "round-off")] if "floor" in case else []
    silent, timed = failures(view, case["name"]), all(point["timed"] for point in points)
    described = {"description": f"{cost} against {over}; the table below holds the same data"}
    # The first chart is drawn once more for the width of a phone.
    frames = {"": WIDE} | ({"narrow": NARROW} if case["name"] == view.featured else {})
    drawings = []
    for kind, frame in frames.items():
        spec = rounded(charts.work_precision(points, silent, view.style, titles, limits, frame) | described)
        own = f"{name}-{kind}" if kind else name
        drawings.append({"id": own, "kind": kind, "spec": spec, "svg": Drawing(spec, own)})
    return {"id": name, "drawings": drawings, "timed": timed, "over": over, "cost": cost}


def convergence_chart(
    view: View, name: str, case: dict[str, Any], points: list[Rung], orders: dict[str, Any]
) -> dict[str, Any] | None:
    """Static drawing of error against step with the fitted orders; None where nobody took three steps."""
    stepped = [point for point in points if point["step"] > 0]
    if len({point["step"] for point in stepped}) < 3:
        return None
    over = titles_of(view, case, points)[0]
    spec = charts_plain.convergence(stepped, orders, view.style, ("step [s]", over))
    spec["description"] = f"{over} against step; the table below holds the same data"
    return {"id": name, "svg": Drawing(spec, name)}


def failures(view: View, case: str) -> list[dict[str, str]]:
    """Rungs of a case without a result, one line for each policy, state and reason."""
    found: dict[tuple[str, str, str, str], list[str]] = {}
    for rung in view.by_case[case]:
        silent = rung["state"] == "ok" and math.isnan(rung["error"])  # ran, but the headline is not defined here
        state = "no figure" if silent else rung["state"]
        if state != "ok":
            key = rung["policy"], rung["engine"], state, rung["reason"]
            found.setdefault(key, []).append(rung["step_text"] or "every step")
    names = ("policy", "engine", "state", "reason")
    return [{**dict(zip(names, key, strict=True)), "steps": listing(texts)} for key, texts in found.items()]


def measure_table(view: View, case: str) -> dict[str, Any]:
    """Every measure by policy, at the finest step that all stepping policies with a result share."""
    lines = {policy: [rung for rung in line if rung["state"] == "ok"] for policy, line in view.of(case).items()}
    ladders = [{rung["step"] for rung in line} for line in lines.values() if any(rung["step"] > 0 for rung in line)]
    common = min(set.intersection(*ladders), default=None) if ladders else None
    chosen = {
        policy: next((rung for rung in line if rung["step"] == common), line[0])
        for policy, line in lines.items()
        if line
    }
    rows = [
        {
            "name": measure,
            "unit": view.units[measure],
            "values": [rung.get(measure, math.nan) for rung in chosen.values()],
        }
        for measure in view.measures
        if measured(list(chosen.values()), measure)
    ]
    steps = [f"step {rung['step_text']}" if rung["step"] > 0 else "no step" for rung in chosen.values()]
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
    rung = line[0]
    if rung["state"] != "ok":
        return str(rung["state"])
    return amount(rung["error"], view.unit_of(case)) if rung["error"] >= 0 else "–"
