"""Which step each contestant may take on a case to stay below an error: the largest, and the cheapest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from impactbench.reports.page_data import Line, Rung, number, percent, time_to
from impactbench.reports.page_view import View
from impactbench.reports.terminal import table


def target_of(text: str) -> float:
    """`1%` or `0.01` as a fraction. Raises ValueError with what is possible instead."""
    try:
        value = float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise ValueError(f"error {text!r} is not a positive number; write it as 1% or 0.01")
    return value


def largest_step(line: Line, target: float) -> Rung | None:
    """The coarsest rung that meets the target together with every finer one, at the worst phase."""
    met = None
    for rung in line:
        if rung["state"] != "ok" or not rung["error"] <= target:
            break
        met = rung
    return met


def advice(document: dict[str, Any], target: float) -> str:
    """A table and a sentence for the one case of the document, cheapest contestant first."""
    view = View(document)
    (case,) = view.cases
    found = []
    for policy, line in view.of(case).items():
        step, cheapest = largest_step(line, target), time_to(line, target)
        cost = float(cheapest["cost"]) if cheapest is not None else np.inf
        found.append((cost, policy, step, cheapest, line))
    found.sort(key=lambda item: item[0])
    rows = [_row(*item) for item in found]
    columns = ["contestant", "largest step", "error there", "cheapest step", "ms per simulated s", "otherwise"]
    return f"{table(columns, rows)}\n\n{_sentence(case, target, found)}"


def _row(cost: float, policy: str, step: Rung | None, cheapest: Rung | None, line: Line) -> list[str]:
    if step is None:
        why = next((f"{rung['state']}: {rung['reason']}" for rung in line if rung["state"] != "ok"), "")
        finest = line[0]
        why = why or f"not reached: {percent(float(finest['error']))} at {finest['step_text']}"
        return [policy, "-", "-", "-", "-", why]
    cheap = [str(cheapest["step_text"]), number(cost)] if cheapest is not None else ["-", "-"]
    return [policy, str(step["step_text"]), percent(float(step["error"])), *cheap, ""]


def _sentence(case: str, target: float, found: list[Any]) -> str:
    cost, policy, _, cheapest, _ = found[0]
    if cheapest is None:
        return f"No contestant stays below {percent(target)} error on {case} on this ladder of steps."
    return (
        f"To stay below {percent(target)} error on {case}: {policy} at {cheapest['step_text']} s is cheapest, "
        f"{number(cost)} ms per simulated second."
    )
