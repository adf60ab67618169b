"""The gate: run a selection, judge every cell, and find out when, where and how small each failure is.

    selection = Selection(cases, contestants, overrides=known_limits())
    document, verdicts = check_cells(selection)
    findings = look_into(selection, verdicts)     # one for each law that an engine breaks, worst first

Deterministic; nothing here looks at a clock. Every cell and every look runs in a child process.
"""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from impactbench.adapters.contestants import CONTESTANTS, Contestant, installed
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports.budget_file import Overrides
from impactbench.reports.budgets import CHECKS, Check
from impactbench.reports.compare import Plan, Progress, cell_of, compare
from impactbench.reports.verdicts import Verdict, judge_document
from impactbench.scenarios import catalogue
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case

STEPS = ("1/240",)
"""The step where none is asked for; budgets are functions of it, so that any other will do."""
MOST_FINDINGS = 30
LOOK_LIMIT = 30.0
"""Seconds a look into one failure may take."""
MOST_SMALLER = 4
"""Smaller counts of bodies that are tried, fewest first."""


@dataclass(frozen=True)
class Selection:
    """What is checked. `until` [s] ends runs early. A command that reproduces a failure repeats the words of `options`
    and names a scene file's case by its path in `files`. `baseline` is the file it was compared with, if any.
    """

    cases: Sequence[Case]
    contestants: Sequence[Contestant]
    steps: Sequence[str] = STEPS
    law: Law | None = None
    checks: Sequence[Check] = CHECKS
    overrides: Overrides | None = None
    until: float = math.inf
    jobs: int = 1
    options: Sequence[str] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    baseline: str = ""


@dataclass(frozen=True)
class Finding:
    """One law that one contestant breaks: the worst of its failures, how many there are, and what a look into it found.

    time:   first instant [s] at which the budget is exceeded; NaN where it could not be found.
    bodies: whom it concerns then. command: reproduces it; shortest: the same with the shortest run and the fewest
    bodies that still fail.
    """

    verdict: Verdict
    count: int
    command: str
    shortest: str
    time: float = math.nan
    bodies: tuple[str, ...] = ()


def check_cells(
    selection: Selection, command: str = "", progress: Progress = lambda *_: None
) -> tuple[dict[str, Any], list[Verdict]]:
    """The results document of the selection (accuracy lane only) and its verdicts."""
    plan = Plan(
        selection.cases, selection.contestants, selection.steps or STEPS, selection.law,
        jobs=selection.jobs, timing="none", until=selection.until,
    )  # fmt: skip
    document = compare(plan, command, progress)
    return document, judge_document(document, selection.cases, selection.overrides, selection.checks, selection.until)


def look_into(selection: Selection, verdicts: Iterable[Verdict], most: int = MOST_FINDINGS) -> list[Finding]:
    """The failures by contestant and check, worst first, at most `most` of them looked into."""
    groups: dict[tuple[str, str], list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.status in ("failed", "error"):
            groups.setdefault((verdict.contestant, verdict.check), []).append(verdict)
    ranked = sorted(groups.values(), key=lambda group: -max(map(_badness, group)))
    found = [Finding(max(group, key=_badness), len(group), "", "") for group in ranked]
    found = [replace(finding, command=command_for(selection, finding.verdict)) for finding in found]
    looked = {finding.command: finding for finding in found[:most]}
    jobs = [job for finding in looked.values() if (job := _look(selection, finding))]
    seen = {outcome.key: outcome.value for outcome in run_jobs(jobs, selection.jobs) if outcome.state == "done"}
    return [_with(selection, finding, seen.get(finding.command)) for finding in found]


def _badness(verdict: Verdict) -> float:
    """Figure over budget; a run that gave no figure is worse than any."""
    return verdict.margin if math.isfinite(verdict.margin) else math.inf


def _look(selection: Selection, finding: Finding) -> Job | None:
    verdict = finding.verdict
    if verdict.status != "failed" or not verdict.measure:
        return None
    case, contestant = _case(selection, verdict), _contestant(selection, verdict)
    cell = cell_of(case, verdict.law, contestant.name, verdict.model, _step(verdict), verdict.phase, selection.until)
    argument = (cell, contestant, verdict.check, verdict.budget)
    return Job(finding.command, contestant.lane, "impactbench.reports.diagnose:diagnose", argument, LOOK_LIMIT)


def _with(selection: Selection, finding: Finding, seen: object) -> Finding:
    if not isinstance(seen, Mapping) or not seen:
        return replace(finding, shortest=finding.command)
    smaller = _fewer_bodies(selection, finding.verdict)
    if smaller:
        name, until = smaller
    else:
        name, until = finding.verdict.case, seen["until"]
    shortest = command_for(selection, replace(finding.verdict, case=name), until)
    return replace(finding, time=seen["time"], bodies=tuple(seen["bodies"]), shortest=shortest)


def _fewer_bodies(selection: Selection, verdict: Verdict) -> tuple[str, float] | None:
    """The case of the same family with the fewest bodies that still fails this check, and the time [s] it needs."""
    contestant = _contestant(selection, verdict)
    for case in _smaller_cases(verdict.case):
        part = replace(selection, cases=[case], contestants=[contestant], steps=[_step(verdict)], jobs=1)
        part = replace(part, checks=[check for check in CHECKS if check.name == verdict.check], until=math.inf)
        _, verdicts = check_cells(part)
        failed = [v for v in verdicts if v.status == "failed" and v.measure]
        if failed:
            finding = Finding(failed[0], 1, command_for(part, failed[0]), "")
            for outcome in run_jobs([job for job in [_look(part, finding)] if job], 1):
                if outcome.state == "done" and isinstance(outcome.value, Mapping) and outcome.value:
                    return case.scene.name, float(outcome.value["until"])
            return case.scene.name, math.inf
    return None


def _smaller_cases(name: str) -> list[Case]:
    """Cases of the same name but for a smaller `count`, fewest first; none where the family counts nothing."""
    counted = re.search(r"\bcount=(\d+)", name)
    if counted is None:
        return []
    found: list[Case] = []
    for count in range(2, int(counted[1])):
        try:
            found += catalogue.select([name.replace(counted[0], f"count={count}")])
        except ValueError:
            continue
        if len(found) == MOST_SMALLER:
            break
    return found


def _case(selection: Selection, verdict: Verdict) -> Case:
    return next(case for case in selection.cases if case.scene.name == verdict.case)


def _contestant(selection: Selection, verdict: Verdict) -> Contestant:
    return next(c for c in selection.contestants if c.name == verdict.contestant)


def _step(verdict: Verdict) -> str:
    return STEPS[0] if verdict.step == "no step" else verdict.step


def command_for(selection: Selection, verdict: Verdict, until: float = math.inf) -> str:
    """A command line that judges this cell by this check again."""
    case, contestant = selection.files.get(verdict.case, verdict.case), _contestant(selection, verdict)
    words = ["impactbench", "check", case, "--engine", selector(contestant), "--step", _step(verdict)]
    if contestant.law == "doc":
        words += ["--law", verdict.law]
    if any(check.name == verdict.check for check in CHECKS):
        words += ["--only", verdict.check]
    elif selection.baseline:
        words += ["--baseline", selection.baseline]
    until = min(until, selection.until)
    if math.isfinite(until):
        words += ["--until", f"{until:.9g}"]
    return shlex.join([*words, *selection.options])


def selector(contestant: Contestant) -> str:
    """What names the contestant on a command line: its name, or where a user's own engine was loaded from."""
    if contestant.factory in {known.factory for known in (*CONTESTANTS, *installed())}:
        return contestant.name
    return contestant.factory
