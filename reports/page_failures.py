"""Failure cards: which law a contestant violates most, by how much, where, and the command that shows it again."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from impactbench.reports.page_data import TARGET, amount, counted, isolated, listing, words

if TYPE_CHECKING:
    from impactbench.reports.page_view import View

VIOLATIONS = {
    "energy_gain": "Energy: no contact creates it",
    "energy_drift": "Energy: other than the law leaves",
    "momentum_drift": "Momentum: changed by what no contact could do",
    "angular_momentum_drift": "Angular momentum: changed without a torque",
    "penetration_max": "Non-penetration: bodies overlap",
}
"""Measure -> the law it shows broken. The limit is that of the page's target."""
FAULTS = ("diverged", "crashed", "timed out", "error")
SHOWN = 9  # cards that stand open; three rows of three


def cards(view: View) -> list[dict[str, Any]]:
    """One card for each contestant and law it breaks: its worst cell; states that are faults first."""
    return [*_faults(view), *_violations(view)]


def _faults(view: View) -> list[dict[str, Any]]:
    bad = view.cells[view.cells["state"].isin(FAULTS)]
    found = []
    for (policy, state), group in bad.groupby(["policy", "state"], sort=False):
        cell = group.iloc[0]
        numbers = f"{counted(len(group), 'cell')}, first: {isolated(str(cell['reason'])) or 'no reason given'}"
        found.append(_card(view, cell, policy, f"Run {state}", numbers, len(group)))
    return found


def _violations(view: View) -> list[dict[str, Any]]:
    values = pd.DataFrame(view.document["rows"]).reindex(columns=["cell", "measure", "value", "time", "bodies"])
    values = values[values["measure"].isin(VIOLATIONS)]
    values["size"] = pd.to_numeric(values["value"]).abs()
    values = values[values["size"] > TARGET].join(view.cells[["policy", "case", "state"]], on="cell")
    values = values[values["state"] == "ok"].sort_values("size", ascending=False, kind="stable")
    found = []
    for (policy, measure), group in values.groupby(["policy", "measure"], sort=False):
        row = group.iloc[0]
        sign = "" if measure == "penetration_max" else "+" if row["value"] > 0 else "−"
        numbers = f"{words(measure)} {sign}{amount(row['size'], view.units[measure])} of the scene's own scale"
        found.append(_card(view, view.cells.loc[row["cell"]], policy, VIOLATIONS[measure], numbers, len(group)))
        end = view.cases[row["case"]]["duration"] if measure == "energy_drift" else np.nan
        found[-1] |= {"when": _when(row, end), "bodies": _bodies(row), "cases": listing(group["case"], 2)}
    return found


def _when(row: pd.Series, end: float) -> str:
    """Time of the figure; of one that is taken at the end, the end."""
    return next((f"t = {time:.4g} s" for time in (row["time"], end) if not pd.isna(time)), "")


def _bodies(row: pd.Series) -> str:
    return listing(row["bodies"]) if isinstance(row["bodies"], list) else "all"


def _card(view: View, cell: pd.Series, policy: str, law: str, numbers: str, count: int) -> dict[str, Any]:
    return {
        "policy": policy,
        "law": law,
        "numbers": numbers,
        "case": cell["case"],
        "step": cell["step_text"],
        "count": count,
        "when": "",
        "bodies": "",
        "cases": "",
        "command": command(view, cell),
    }


def command(view: View, cell: pd.Series) -> str:
    """What to type to measure this cell again; empty where its scene or engine came from a file."""
    if not view.cases[cell["case"]].get("in_catalogue", True):
        return ""
    step = cell["step_text"] if cell["step"] > 0 else "1/960"  # an event runner takes any
    parts = ["impactbench", "run", cell["case"], "--engine", view.sources.get(cell["contestant"], cell["contestant"])]
    parts += ["--step", step]
    if np.isfinite(cell["phase"]) and cell["phase"]:
        parts += ["--phase", repr(float(cell["phase"]))]
    if cell["model"] != "minimal":
        parts += ["--model", cell["model"]]
    if cell["contestant"].startswith("reference/") and cell["law"] in ("doc", "nc"):
        parts += ["--law", cell["law"]]
    return shlex.join(parts)
