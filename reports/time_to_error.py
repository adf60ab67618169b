"""Speed against accuracy in one figure: wall time to a fixed error, of every policy on every timed case."""

from __future__ import annotations

import math
from typing import Any

from impactbench.reports.page_data import TARGET, number, percent, time_to
from impactbench.reports.page_scores import ran
from impactbench.reports.page_view import View
from impactbench.reports.terminal import table

TARGETS = (TARGET, TARGET / 10)


def rows(view: View) -> list[dict[str, Any]]:
    """One row a timed case, policy and target: the cheapest step that meets it, as every finer one does, in ms per
    simulated second with the 95 % interval of the median; `ms` None where it is not reached.
    """
    found = []
    for case in view.cases:
        for policy, line in view.of(case).items():
            for target in TARGETS if any(rung["timed"] for rung in line) else ():
                rung = time_to(line, target)
                row: dict[str, Any] = {"case": case, "policy": policy, "target": target}
                if rung is None or math.isnan(rung["cost"]):
                    row |= {"ms": None, "why": "not reached" if ran(line) else str(line[0]["state"])}
                else:
                    row |= {"ms": float(rung["cost"]), "step": str(rung["step_text"])}
                    row |= {name: float(rung[name]) for name in ("low", "high") if not math.isnan(rung[name])}
                found.append(row)
    return found


def text(found: list[dict[str, Any]], target: float = TARGET) -> str:
    """The rows of one target as a table: cases in their order, policies by cost."""
    names = list(dict.fromkeys(row["case"] for row in found))
    chosen = [row for row in found if row["target"] == target]
    chosen.sort(key=lambda row: (names.index(row["case"]), row["ms"] is None, row["ms"] or 0.0))
    lines: list[list[str]] = []
    for row in chosen:
        first = not lines or lines[-1][4] != row["case"]
        lines.append([row["case"] if first else "", row["policy"], interval(row), row.get("step", "-"), row["case"]])
    columns = ["case", "contestant", f"ms per simulated second to {percent(target)} [95 % interval]", "step [s]"]
    return table(columns, [line[:4] for line in lines])


def interval(row: dict[str, Any]) -> str:
    """Median and its interval, or why there is none."""
    if row["ms"] is None:
        return str(row["why"])
    return number(row["ms"]) + (f" [{number(row['low'])}, {number(row['high'])}]" if "low" in row else "")
