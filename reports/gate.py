"""The gate: run a selection at a step and judge every cell. Deterministic; nothing here looks at a clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.reports.compare import Plan, Progress, compare
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case

STEPS = ("1/240",)
"""A step that engines are run at; budgets are functions of it, so that any other will do."""


def run_cells(
    cases: Sequence[Case],
    contestants: Sequence[Contestant],
    steps: Sequence[str] = STEPS,
    law: Law | None = None,
    jobs: int = 1,
    command: str = "",
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """The results document of the accuracy lane alone, for `verdicts.judge_document`."""
    plan = Plan(cases, contestants, steps or STEPS, law, jobs=jobs, timing="none")
    return compare(plan, command, progress)
