"""What `impactbench explain` prints: a check's law, measure, budget and derivation, with worked numbers."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from impactbench.reports.budget_formulas import Setting
from impactbench.reports.budgets import CHECKS, Check
from impactbench.reports.cell import step_seconds
from impactbench.reports.terminal import table
from impactbench.reports.verdict_text import figure
from impactbench.scenarios.truth import Case

SIDES = {"both": "either sign counts", "above": "only a gain counts", "below": "only a loss counts"}


def listed() -> str:
    return table(["check", "measure", "budget", "law"], [[c.name, c.measure, c.formula, c.law] for c in CHECKS])


def text(check: Check, cases: Sequence[Case], steps: Sequence[str], every: bool) -> str:
    """`every` case that is given, also those the check says nothing about; else the first of each family."""
    parts = [
        f"{check.name}: {check.law}",
        f"measure  {check.measure} [{check.unit}], {SIDES[check.side]}",
        f"budget   {check.formula}",
        textwrap.fill(check.derivation, 100),
        table(["case", "law", "step", "budget"], _worked(check, cases, steps, every)),
    ]
    return "\n\n".join(parts)


def _worked(check: Check, cases: Sequence[Case], steps: Sequence[str], every: bool) -> list[list[str]]:
    rows: list[list[str]] = []
    seen: set[str] = set()
    for case in cases:
        for law in case.scene.laws:
            why = check.excused(case, law)
            if (why or case.scene.family in seen) and not every:
                continue
            if not every:
                seen.add(case.scene.family)
            rows += [
                [case.scene.name, law, step,
                 f"none: {why}" if why else figure(check.budget(Setting(case, law, step_seconds(step))), check.unit)]
                for step in steps
            ]  # fmt: skip
    return rows
