"""From a results document to the numbers a page shows: rungs, time to a fixed error, convergence order.

A rung is one (case, policy, step); its figures are those of the worst impact phase.
"""

from __future__ import annotations

import decimal
import itertools
import math
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

TARGET = 0.01
TARGETS = tuple(float(f"{digit}e{power}") for power in range(-6, 1) for digit in (1, 2, 5))[:-2]
"""Targets the slider offers: 1 millionth to 1 in steps of 1, 2, 5."""
FLOOR = 1e-12  # round-off of a computation in doubles at scene scale: below it no two errors can be told apart
KEYS = ["case", "policy", "step"]
Rung = dict[str, Any]  # figures of one (case, policy, step) by name; NaN where nothing was measured
Line = list[Rung]  # all rungs of one (case, policy), finest first


def number(value: float | None) -> str:
    """Three significant digits; a dash where nothing was measured."""
    return "–" if value is None or math.isnan(value) else f"{value:.3g}"


def percent(value: float) -> str:
    """A fraction in per cent, three significant digits."""
    return f"{100 * value:.3g} %".replace("-", "−", 1) if value < 0 else f"{100 * value:.3g} %"


TURNING = re.compile(
    "[\u0590-\u08ff\u200e\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufefc\U00010800-\U00010fff\U0001e800-\U0001efff]"
)
"""Letters of scripts that run from right to left, and marks that change the direction."""


def isolated(name: str) -> str:
    """Name that cannot turn the direction of the text around it; most names need nothing."""
    return f"\u2068{name}\u2069" if TURNING.search(name) else name


def counted(number: int, noun: str) -> str:
    """A number with its noun."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def words(name: str) -> str:
    """Name of a measure or family as words."""
    return name.replace("_", " ")


def amount(value: float, unit: str) -> str:
    """An error for a sentence: dimensionless ones in per cent."""
    return percent(value) if unit == "1" else f"{value:.3g} {unit}"


def listing(items: Iterable[Any], limit: int = 6) -> str:
    """Items in one line, the rest counted."""
    found = list(dict.fromkeys(isolated(str(item)) for item in items))
    more = f" and {len(found) - limit} more" if len(found) > limit else ""
    return ", ".join(found[:limit]) + more


def tidy_cells(document: dict[str, Any]) -> pd.DataFrame:
    """Cells with the policy each belongs to: contestant, and model and law where it ran several."""
    columns = ["case", "family", "law", "contestant", "model", "step", "step_text", "phase", "state", "reason"]
    cells = pd.DataFrame(document["cells"]).reindex(columns=[*columns, "version", "settings", "repeats"])
    cells["step"] = pd.to_numeric(cells["step"]).fillna(0.0)  # 0: moves from event to event
    cells[["step_text", "reason"]] = cells[["step_text", "reason"]].fillna("").astype(str)
    cells["state"] = cells["state"].fillna("error")
    several = cells.groupby(["case", "contestant"])["law"].transform("nunique") > 1
    cells["policy"] = cells["contestant"].astype(str)
    full = cells["model"] != "minimal"
    cells.loc[full, "policy"] += " · " + cells.loc[full, "model"].astype(str)
    cells.loc[several, "policy"] += " · " + cells.loc[several, "law"].astype(str)
    return cells


def tidy_rungs(cells: pd.DataFrame, rows: list[dict[str, Any]]) -> pd.DataFrame:
    """One line a rung, one column a measure: the worst phase's value, sign kept; a rung with a bad phase is bad."""
    values = pd.DataFrame(rows).reindex(columns=["cell", "measure", "value"]).dropna()
    values = values.join(cells[KEYS], on="cell")
    values["size"] = pd.to_numeric(values["value"]).abs()
    worst = values.sort_values("size").drop_duplicates([*KEYS, "measure"], keep="last")
    wide = worst.pivot(index=KEYS, columns="measure", values="value").astype(float)
    bad = cells.assign(bad=cells["state"] != "ok").sort_values("bad", kind="stable")
    return bad.drop_duplicates(KEYS, keep="last").join(wide, on=KEYS).drop(columns="bad")


def time_to(line: Line, target: float) -> Rung | None:
    """Cheapest rung that meets the target together with every finer one; no credit for a lucky step."""
    met = itertools.takewhile(lambda rung: rung["state"] == "ok" and rung["error"] <= target, line)
    # What moves from event to event has no step to pay for: where nothing is timed it has no cost at all.
    known = [rung for rung in met if not math.isnan(rung["cost"]) or not rung["timed"]]
    return min(known, key=expense) if known else None


def expense(rung: Rung) -> float:
    """Cost of a rung to the digits that are shown; 0 where there is none."""
    return 0.0 if math.isnan(rung["cost"]) else float(number(rung["cost"]))


def order(line: Line) -> dict[str, Any] | None:
    """Least-squares slope of log error against log step on the four finest rungs that stand above round-off."""
    usable = [rung for rung in line if rung["state"] == "ok" and rung["step"] > 0 and rung["error"] > 100 * FLOOR][:4]
    if len(usable) < 3:
        return None
    x, y = (np.log([rung[key] for rung in usable]) for key in ("step", "error"))
    slope, offset = (float(c) for c in np.polyfit(x, y, 1))
    spread = float(np.std(x) * np.std(y))
    r2 = float(np.mean((x - x.mean()) * (y - y.mean())) / spread) ** 2 if spread > 0 else 0.0
    fit = [(float(np.exp(end)), float(np.exp(offset + slope * end))) for end in (x[0], x[-1])]
    return {"slope": slope, "r2": r2, "rungs": listing(rung["step_text"] for rung in usable), "fit": fit}


def price(rung: Rung) -> str:
    """Cost of a rung for a sentence that has named the unit."""
    step = f"{rung['step_text']} s" if rung["step"] > 0 else "no fixed step"
    return f"{number(rung['cost'])} ({step})" if rung["timed"] else step


def rounded_up(value: float) -> float:
    """Three significant digits, rounded up: meets a target of as many digits exactly where `value` does."""
    return float(decimal.Context(prec=3, rounding=decimal.ROUND_CEILING).create_decimal(repr(float(value))))
