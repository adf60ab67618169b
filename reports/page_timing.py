"""Timing in detail, and what the smallest model of a scene saves against the full one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from impactbench.reports.page_data import number, percent

if TYPE_CHECKING:
    from impactbench.reports.page_view import View


MOST_ROWS = 500
"""Timed cells whose repeats are listed, some 350 bytes each."""


def timing(view: View) -> dict[str, Any] | None:
    """Every repeat of every timed cell, and the harness' own share of a run; None where nothing was timed.

    Of more than `MOST_ROWS` cells the finest steps come first; `left_out` counts the others.
    """
    timed = view.cells[view.cells["repeats"].map(lambda found: isinstance(found, list) and bool(found))]
    if not len(timed):
        return None
    known, shown = _figures(view), timed
    if len(timed) > MOST_ROWS:
        shown = timed.sort_values("step", kind="stable").head(MOST_ROWS).sort_index()
        view.thinned.append(f"Repeats are listed of {MOST_ROWS} timed cells, the finest steps first.")
    rows = [
        {
            **known.get(index, {}),
            "case": cell["case"],
            "policy": cell["policy"],
            "step": cell["step_text"],
            "median": 1e3 * float(np.median(cell["repeats"])),
            "least": 1e3 * min(cell["repeats"]),
            "repeats": " ".join(number(1e3 * seconds) for seconds in cell["repeats"]),
        }
        for index, cell in shown.iterrows()
    ]
    return {"rows": rows, "left_out": len(timed) - len(shown), "overhead": _overhead(view, timed)}


def _figures(view: View) -> dict[Any, dict[str, float]]:
    """By cell: what one read of the state costs [us], and the harness' share of the clocked time; older results have
    neither.
    """
    found: dict[Any, dict[str, float]] = {}
    for row in view.document["rows"]:
        if row["measure"].startswith("wall_"):
            found.setdefault(row["cell"], {})[row["measure"]] = row["value"]
    return {
        index: {"read": 1e6 * times["wall_read"], "share": times["wall_harness"] / times["wall_time"]}
        for index, times in found.items()
        if {"wall_read", "wall_harness", "wall_time"} <= set(times) and times["wall_time"] > 0
    }


def _overhead(view: View, timed: pd.DataFrame) -> str:
    """The harness' part of the runs that were timed: measured with an engine that does nothing, else its clock's."""
    shares = [figures["share"] for figures in _figures(view).values()]
    if shares:
        middle, most = float(np.median(shares)), max(shares)
        return (
            "The harness' own share of the clocked time, measured with an engine that does nothing, is "
            f"{percent(middle)} in the median and at most {percent(most)}. Reading the state is never clocked; its "
            "cost stands apart."
        )
    clock = view.document["provenance"].get("clock_seconds")
    if clock is None:
        return ""
    shortest = min(min(c["repeats"]) * view.cases[c["case"]]["duration"] for _, c in timed.iterrows())
    return f"The harness' own share of a timed run is {clock * 1e6:.2g} µs, at most {percent(clock / shortest)} of it."


def savings(view: View) -> list[dict[str, Any]]:
    """Time and error of the smallest and the full model of a case, at the finest step both ran at."""
    found = []
    for (case, policy), full in view.lines.items():
        if not policy.endswith(" · full") and " · full · " not in policy:
            continue
        small = view.lines.get((case, policy.replace(" · full", "")))
        if small is None:
            continue
        whole = {rung["step"]: rung for rung in full if rung["state"] == "ok"}
        rung = next((rung for rung in small if rung["state"] == "ok" and rung["step"] in whole), None)
        if rung is None:
            continue
        other = whole[rung["step"]]
        timed = rung["timed"] and other["timed"]
        found.append(
            {
                "case": case,
                "policy": policy.replace(" · full", ""),
                "step": rung["step_text"],
                "small": rung["cost"] if timed else np.nan,
                "full": other["cost"] if timed else np.nan,
                "saved": percent(1 - rung["cost"] / other["cost"]) if timed else "not timed",
                "error": rung["error"],
                "change": rung["error"] - other["error"],
            }
        )
    return found
