"""Tables of the page over all cases: scoreboard, cells without a result, settings, repeats of the timing."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from impactbench.reports.page_data import (
    TARGET,
    Line,
    Rung,
    expense,
    isolated,
    listing,
    number,
    price,
    rounded_up,
    time_to,
)

if TYPE_CHECKING:
    from impactbench.reports.page_view import View


def scoreboard(view: View) -> list[dict[str, Any]]:
    """Cases against policies; cells hold their ladder, fine to coarse, so that a script can change the target."""
    rows = []
    for name, case in view.cases.items():
        cells = [score(view, name, policy) for policy in view.policies]
        timed = any(rung["timed"] for line in view.of(name).values() for rung in line)
        bad = sum(cell["kind"] != "met" for cell in cells)
        rows.append({"case": case, "cells": cells, "bad": bad, "timed": timed, "unit": view.unit_of(name)})
    return sorted(rows, key=lambda row: -int(row["bad"]))


def score(view: View, case: str, policy: str) -> dict[str, Any]:
    """One cell of the scoreboard: cheapest rung below the target, or that it is not reached, or its state."""
    line = view.lines.get((case, policy))
    if line is None:
        return {"kind": "none", "text": "–", "ladder": None}
    if not ran(line):
        return {"kind": "state", "text": str(line[0]["state"]), "ladder": None}
    ladder = []
    for rung in line:
        usable = rung["state"] == "ok" and not math.isnan(rung["error"])
        cost = "" if not rung["timed"] else None if math.isnan(rung["cost"]) else number(rung["cost"])
        ladder.append([rounded_up(rung["error"]) if usable else None, cost, rung["step_text"]])
    best = time_to(line, TARGET)
    if best is None:
        return {"kind": "missed", "text": "✕ not reached", "ladder": ladder}
    return {"kind": "met", "text": f"✓ {_short(best)}", "ladder": ladder}


def ran(line: Line) -> bool:
    """Whether any rung has a result."""
    return any(rung["state"] == "ok" for rung in line)


def _short(rung: Rung) -> str:
    return f"{number(rung['cost'])} ms" if rung["timed"] else rung["step_text"] or "any step"


def reach(view: View, case: str, target: float = TARGET) -> str:
    """Which policies stay below the target, at what cost, and which do not get there."""
    lines = view.of(case)
    found = {policy: time_to(line, target) for policy, line in lines.items()}
    reached = sorted(((expense(r), p, r) for p, r in found.items() if r is not None), key=lambda item: item[:2])
    missed = [p for p, r in found.items() if r is None and ran(lines[p])]
    silent = [p for p in lines if not ran(lines[p])]
    best = [f"{isolated(p)} {price(rung)}" for _, p, rung in reached]
    goal = view.goal(view.cases[case], target)
    timed = any(rung["timed"] for line in lines.values() for rung in line)
    scale = "ms per simulated second" if timed else "coarsest step that does"
    text = f"To stay below {goal}, {scale}: {'; '.join(best)}." if best else f"No policy stays below {goal}."
    if missed and best:
        text += f" {listing(missed, 20)} {'does' if len(missed) == 1 else 'do'} not get there."
    return text + (f" No result: {listing(silent, 20)}." if silent else "")


def statuses(view: View) -> list[dict[str, Any]]:
    """All cells without a result, grouped by who, what and why."""
    bad = view.cells[view.cells["state"] != "ok"]
    rows = []
    for (policy, state, reason), group in bad.groupby(["policy", "state", "reason"], sort=False):
        steps = [text for text in group.sort_values("step")["step_text"] if text]
        row = {"policy": policy, "state": state, "reason": reason, "count": len(group)}
        rows.append({**row, "cases": listing(group["case"], 8), "steps": listing(steps, 8)})
    return sorted(rows, key=lambda row: (row["state"], -row["count"]))


def settings(view: View) -> list[dict[str, Any]]:
    """What each policy was told: every setting with the values it took."""
    told: dict[tuple[str, str], dict[str, None]] = {}
    for policy, settings in zip(view.cells["policy"], view.cells["settings"], strict=True):
        for key, value in settings.items() if isinstance(settings, dict) else ():
            text = value if isinstance(value, str) else json.dumps(value)
            told.setdefault((policy, str(key)), {})[text] = None
    return [{"policy": p, "key": k, "count": len(v), "values": listing(v, 6)} for (p, k), v in sorted(told.items())]
