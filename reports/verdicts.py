"""From cells and figures to verdicts: which checks passed, failed, or could not say anything, and why.

    verdicts = judge(case, law, "1/240", figures, contestant="mine/default")       # of one run
    verdicts = judge_document(document, cases)                                     # of a results document
    sys.exit(exit_code(verdicts))

`figures` maps measures to values as `measures.measure` gives them. Nothing here runs an engine.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np
from impactbench.reports.budget_file import Overrides, known_limits, overriding
from impactbench.reports.budget_formulas import Setting
from impactbench.reports.budgets import CHECKS, Check
from impactbench.reports.cell import stack, step_seconds
from impactbench.reports.measures import measure
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case

Status = Literal["passed", "failed", "error", "unavailable", "unsupported", "excused", "incomparable"]
STATUSES: tuple[Status, ...] = get_args(Status)
PASSED, FAILED, INCOMPLETE, NO_BASELINE, NOTHING = 0, 1, 3, 4, 5
KEPT = ("unsupported", "unavailable")
"""States of a cell that are statuses of its verdict; any other without figures is an error."""
BASELINE = "baseline"
"""The check of every cell that it is as it was accepted."""
FINITE = "finite"
"""The check of every run that its numbers are numbers."""


@dataclass(frozen=True)
class Verdict:
    """What one check says of one cell.

    status:  passed, failed; error (crashed, timed out, raised, or a figure is missing); unavailable (the engine is not
             here); unsupported (the engine cannot express the case); excused (the check has no meaning there);
             incomparable (no baseline to compare with).
    value, budget: the figure that counts and the largest allowed, in `unit`; NaN where there is none.
    limit:   why the budget is not the derived one; empty where it is.
    reason:  why not passed; empty where passed.
    """

    check: str
    case: str
    law: Law
    contestant: str
    model: str
    step: str
    phase: float
    status: Status
    measure: str = ""
    value: float = math.nan
    budget: float = math.nan
    unit: str = "1"
    limit: str = ""
    reason: str = ""

    @property
    def where(self) -> str:
        return f"{self.case} {self.contestant} {self.step}"

    @property
    def margin(self) -> float:
        """Value over budget: above 1 it failed."""
        return self.value / self.budget if self.budget else (math.inf if self.value else 0.0)


def judge(
    case: Case,
    law: Law,
    step: str,
    figures: Mapping[str, float],
    contestant: str = "",
    overrides: Overrides | None = None,
    model: str = "minimal",
    phase: float = 0.0,
    checks: Sequence[Check] = CHECKS,
    until: float = math.inf,
) -> list[Verdict]:
    """A verdict for every check, of one finite run at `step` (1/240, "no step" for an event-driven one).

    `until` [s] is where the run ended, if before its scene does. `overrides` None means the known limits of the shipped
    adapters.
    """
    overrides = known_limits() if overrides is None else overrides
    seconds = step_seconds(step) if step != "no step" else step_seconds("1/240")
    setting = Setting(case, law, seconds)
    blank = Verdict("", case.scene.name, law, contestant, model, step, phase, "passed")
    return [_judge(check, setting, figures, overrides, blank, until) for check in checks]


def _judge(
    check: Check,
    setting: Setting,
    figures: Mapping[str, float],
    overrides: Overrides,
    blank: Verdict,
    until: float,
) -> Verdict:
    case, law = setting.case, setting.law
    blank = replace(blank, check=check.name, measure=check.measure, unit=check.unit)
    excused = check.excused(case, law)
    entry = overriding(overrides, check, blank.contestant, case.scene.name)
    if excused or (entry and entry.off):
        return replace(blank, status="excused", reason=excused or (entry.reason if entry else ""))
    derived = check.budget(setting)
    budget = entry.budget(check, setting) if entry else derived
    blank = replace(blank, budget=budget, limit=f"{entry.source}: {entry.reason}" if entry else "")
    if check.measure not in figures:
        return _absent(check, setting, blank, until)
    value = figures[check.measure]
    counted = check.excess(value) if math.isfinite(value) else math.nan
    if not math.isfinite(counted):
        return replace(blank, status="failed", reason=f"{check.measure} is not a finite number")
    if counted <= derived <= budget:  # the entry was not needed
        return replace(blank, value=counted, budget=derived, limit="")
    if counted <= budget:
        return replace(blank, value=counted)
    return replace(blank, status="failed", value=counted, reason=f"{check.measure} {value:.3g} exceeds {budget:.3g}")


APART = 4
"""Steps between an impact and the next from which on a contestant must show it as one of its own: each may be found one
late, last two where the pair is taken apart only then, and the measure needs one between them.
"""


def _absent(check: Check, setting: Setting, blank: Verdict, until: float) -> Verdict:
    """A figure that is not there: a failure where a run of the truth itself has it and its impacts are apart in time,
    so that a missed impact shows.
    """
    case, law, step = setting.case, setting.law, setting.step
    end = min(until, case.scene.duration)
    times = [0.0, *(t for t in case.truths[law].impact_times if t < end), end]
    apart = all(later - sooner > APART * step for sooner, later in pairwise(times))
    if apart and check.measure in _of_truth(case, law, step, end):
        return replace(blank, status="failed", reason=f"no {check.measure}: the truth has an impact, this run none")
    return replace(blank, status="excused", reason=f"no {check.measure}: contacts are not apart in time")


@cache
def _of_truth(case: Case, law: Law, step: float, end: float) -> frozenset[str]:
    """Measures of a run that follows the truth exactly; none where the truth gives no states."""
    truth, times = case.truths[law], np.arange(max(1, round(end / step)) + 1) * np.float64(step)
    if truth.kind != "trajectory":
        return frozenset()
    states = [state for time in times if (state := truth.state(float(time))) is not None]
    if len(states) != len(times):
        return frozenset()
    return frozenset(figure.measure for figure in measure(case, law, stack(times, states)))


def judge_document(
    document: Mapping[str, Any],
    cases: Iterable[Case],
    overrides: Overrides | None = None,
    checks: Sequence[Check] = CHECKS,
    until: float = math.inf,
) -> list[Verdict]:
    """Verdicts of every cell of a results document; one verdict for a cell that has no figures."""
    by_name = {case.scene.name: case for case in cases}
    overrides = known_limits() if overrides is None else overrides
    figures: dict[int, dict[str, float]] = {}
    for row in document["rows"]:
        figures.setdefault(row["cell"], {})[row["measure"]] = row["value"]
    verdicts: list[Verdict] = []
    for number, cell in enumerate(document["cells"]):
        if cell["state"] == "ok":
            verdicts += judge(
                by_name[cell["case"]], cell["law"], cell["step_text"], figures.get(number, {}),
                cell["contestant"], overrides, cell["model"], cell["phase"], checks, until,
            )  # fmt: skip
        else:
            verdicts.append(_without_figures(cell))
    return verdicts


def _without_figures(cell: Mapping[str, Any]) -> Verdict:
    """A run whose numbers are no longer numbers broke the physics; one that could not be measured broke the check."""
    state = cell["state"]
    told = f"{state}: {cell['reason']}" if cell["reason"] else state
    status: Status = "failed" if state == "diverged" else state if state in KEPT else "error"
    blank = Verdict(
        "run", cell["case"], cell["law"], cell["contestant"], cell["model"], cell["step_text"], cell["phase"], status
    )
    return replace(blank, check=FINITE if state == "diverged" else "run", reason=told)


def counts(verdicts: Iterable[Verdict]) -> dict[str, int]:
    """How many verdicts of each status, in a fixed order."""
    found = Counter(verdict.status for verdict in verdicts)
    return {status: found[status] for status in STATUSES}


def exit_code(verdicts: Sequence[Verdict], asked: Iterable[str] = ()) -> int:
    """0 all passed; 1 a check failed; 3 something could not be measured; 4 no baseline to compare with; 5 nothing was
    judged. In this order of precedence: 1, 3, 4, 5.

    `asked` holds the contestants that were asked for by name: one that is missing is 3, others are left out.
    """
    number, named = counts(verdicts), set(asked)
    if number["failed"]:
        return FAILED
    if number["error"] or any(v.status == "unavailable" and v.contestant in named for v in verdicts):
        return INCOMPLETE
    if number["incomparable"]:
        return NO_BASELINE
    return PASSED if number["passed"] else NOTHING
