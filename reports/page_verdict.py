"""What the first screen says: what holds, what does not, which engine to take. Each a line with its number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd
from impactbench.reports.page_data import (
    TARGET,
    Rung,
    counted,
    expense,
    isolated,
    listing,
    number,
    percent,
    price,
    time_to,
    words,
)

if TYPE_CHECKING:
    from impactbench.reports.page_view import View

LAWS = {
    "momentum": ("momentum_drift",),
    "angular momentum": ("angular_momentum_drift",),
    "energy": ("energy_gain", "energy_drift"),
    "no overlap": ("penetration_max",),
}
"""What every contact law demands, and the measures that show its violation."""


def verdict(view: View) -> list[dict[str, str]]:
    """Lines of the verdict, each with a mark, its word and a sentence."""
    found = [
        ("good", "✓", "Holds", holds(view)),
        ("bad", "✕", "Fails", fails(view)),
        ("take", "→", "Take", take(view)),
    ]
    return [{"kind": kind, "mark": mark, "word": word, "text": text} for kind, mark, word, text in found if text]


def coverage(view: View) -> str:
    """What was compared on what, and how many cells gave no result."""
    states = view.cells["state"].value_counts()
    other = ", ".join(f"{n} {state}" for state, n in states.items() if state != "ok")
    steps = view.cells[view.cells["step"] > 0].sort_values("step", ascending=False)["step_text"].drop_duplicates()
    ladder = f" at {counted(len(steps), 'step size')}" if len(steps) else ""
    ladder += f" ({steps.iloc[0]} to {steps.iloc[-1]} s)" if len(steps) > 1 else ""
    who, cases = counted(view.cells["contestant"].nunique(), "contestant"), counted(len(view.cases), "case")
    ran = f"{states.get('ok', 0)} of {counted(len(view.cells), 'cell')} ran"
    return f"{who} on {cases}{ladder}: {ran}" + (f"; {other}." if other else ".")


def holds(view: View) -> str:
    """How many policies keep each law within the limit in every case, at their finest step."""
    finest = view.finest_rungs()
    policies = list(dict.fromkeys(finest["policy"]))
    keepers = {}
    for law, measures in LAWS.items():
        known = finest[[m for m in measures if m in finest]].abs()
        if known.notna().any(axis=None):
            broken = set(finest.loc[(known > TARGET).any(axis=1), "policy"])
            measured = set(finest.loc[known.notna().any(axis=1), "policy"])
            keepers[law] = [p for p in policies if p in measured and p not in broken]
    kept = [(law, len(found)) for law, found in keepers.items() if found]
    if not kept:
        return ""
    first = f"{kept[0][0]} by {kept[0][1]} of {counted(len(policies), 'contestant')}"
    counts = [first, *(f"{law} by {count}" for law, count in kept[1:])]
    return f"within {percent(TARGET)} in every case at the finest step: {', '.join(counts)}."


def fails(view: View) -> str:
    """The worst violation with its place."""
    found = worst(view)
    if found is None:
        return ""
    rung, what = found
    at = f" at {rung['step_text']} s" if rung["step"] > 0 else ""
    return f"{isolated(rung['policy'])} {what} in {isolated(rung['case'])}{at} (limit {percent(TARGET)})."


def worst(view: View) -> tuple[pd.Series, str] | None:
    """The worst violation: energy gained, else energy lost, else the largest error at a finest step."""
    ran = view.rungs[view.rungs["state"] == "ok"]
    for measure, verb, sign in (("energy_gain", "gains", 1), ("energy_drift", "loses", -1)):
        size = sign * ran[measure] if measure in ran else pd.Series(dtype=float)
        if size.notna().any() and size.max() > TARGET:
            return ran.loc[size.idxmax()], f"{verb} {percent(size.max())} of the energy"
    finest = view.finest_rungs()
    unit = finest["case"].map(view.unit_of)
    finest = finest[(unit == "1") & (finest["error"] > TARGET)]
    if not len(finest):
        return None
    rung = finest.loc[finest["error"].idxmax()]
    return rung, f"has a {words(view.cases[rung['case']]['headline'])} of {percent(rung['error'])}"


def take(view: View) -> str:
    """The cheapest policy below the target on the featured case, and who stays below it most often."""
    return " ".join(part for part in (_cheapest(view), _most_often(view)) if part)


def _cheapest(view: View) -> str:
    if view.featured is None:
        return ""
    case = view.cases[view.featured]
    found = [(p, r) for p, line in view.of(view.featured).items() if (r := time_to(line, TARGET)) is not None]
    found.sort(key=lambda item: (expense(item[1]), item[0]))
    where = isolated(words(case["family"]))
    if not found:
        return f"Nobody stays below {view.goal(case)} in {where}."
    policy, rung = found[0]
    what = "cheapest" if rung["timed"] else "coarsest step"
    unit = " ms per simulated second" if rung["timed"] else ""
    text = f"{isolated(policy)} for {where}: {what} below {view.goal(case)}, {_cost(rung)}{unit}"
    engine = next(((p, r) for p, r in found if not p.startswith("reference/")), None)
    if engine is not None and engine[0] != policy:
        text += f"; among engines {isolated(engine[0])}, {_cost(engine[1])}"
    return text + "."


def _cost(rung: Rung) -> str:
    return number(rung["cost"]) if rung["timed"] else price(rung)


def _most_often(view: View) -> str:
    """Engine policies that stay below the target at their finest step in most cases."""
    finest = view.finest_rungs()
    finest = finest[~finest["policy"].str.startswith("reference/")]
    below = (finest["error"] <= TARGET).groupby(finest["policy"], sort=False).sum()
    if not len(below) or len(view.cases) < 2:
        return ""
    best = [policy for policy, count in below.items() if count == below.max()]
    return f"Engine with most cases: {listing(best, 3)}, {below.max()} of {len(view.cases)}."
