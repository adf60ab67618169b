"""The comparison: plan the cells, run them in child processes, time them, gather one results document."""

from __future__ import annotations

import math
import os
import platform
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from typing import Any

from impactbench.adapters.contestants import CONTESTANTS, Contestant
from impactbench.adapters.isolation import Job, Outcome, run_jobs
from impactbench.reports import executors, machine, results
from impactbench.reports.cache import Cache
from impactbench.reports.cell import Cell, Times, step_seconds, timing_figures
from impactbench.reports.measures import Figure, law_difference
from impactbench.reports.null import limits_of
from impactbench.reports.replay import replays
from impactbench.scenarios.catalogue import FAMILIES
from impactbench.scenarios.hard import HARD
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case

LADDER = ("1/30", "1/60", "1/120", "1/240", "1/480", "1/960")
ROUNDS = 10
CELL_LIMIT = 60.0
"""Seconds one cell may take: a hundred times the slowest healthy one of the default set."""
TIMED = (
    "free_flight[dimension=1]",
    "equal_masses[bounciness=0.5]",
    "box_of_walls[dimension=2,hit=faces]",
    "bouncing_ball[bounciness=0.8]",
    "stacked_drop[shape=sphere,count=3]",
    "coulomb_slide[heading=0]",
)
"""Timed by default: free flight, one impact, many one-way impacts, gravity with bounces, resting contact, friction."""

Progress = Callable[[str, int, int], None]
Entry = tuple[Cell, Contestant]


@dataclass(frozen=True)
class Plan:
    """What to run. `law` is for the contestants that can choose theirs.

    Cases that are timed run at every one of `phases` [steps], so that no lucky step earns a rung; others at the first.
    `replay`: record one case of each family for the report's replay. `until` [s] ends runs early.
    """

    cases: Sequence[Case]
    contestants: Sequence[Contestant]
    steps: Sequence[str] = LADDER
    law: Law | None = None
    models: Sequence[str] = ("minimal",)
    phases: Sequence[float] = (0.0,)
    jobs: int = 1
    timing: str = "some"
    replay: bool = False
    until: float = math.inf

    def timed(self) -> set[str]:
        """Names of the cases to time. `some`: those of `TIMED`, and one of each family where few are asked for."""
        if self.timing != "some":
            return {case.scene.name for case in self.cases} if self.timing == "all" else set()
        names = [case.scene.name for case in self.cases]
        first = {case.scene.family: case.scene.name for case in reversed(self.cases)}
        few = first if len(first) <= len(TIMED) else {}
        return set((few | {name.partition("[")[0]: name for name in TIMED if name in names}).values())

    def replayed(self) -> list[str]:
        """Names of the cases to record: of each family the one that is timed, else its first."""
        timed = self.timed()
        first = {case.scene.family: case.scene.name for case in reversed(self.cases)}
        first |= {case.scene.family: case.scene.name for case in reversed(self.cases) if case.scene.name in timed}
        return list(dict.fromkeys(first[case.scene.family] for case in self.cases))

    def cells(self) -> list[Entry]:
        """In an order that keeps an engine's cells together."""
        timed = self.timed()
        return [
            (
                cell_of(case, law_of(contestant, case, self.law), contestant.name, model, step, phase, self.until),
                contestant,
            )
            for contestant in self.contestants
            for case in self.cases
            for model in self.models
            for phase in (self.phases if case.scene.phase_free and case.scene.name in timed else self.phases[:1])
            for step in (self.steps if not contestant.stepless else [min(self.steps, key=step_seconds)])
        ]


def cell_of(
    case: Case, law: Law, contestant: str, model: str, step: str, phase: float, until: float = math.inf
) -> Cell:
    """A child gets the scene itself where its catalogue does not hold it: the file is read once."""
    scene = case.scene if case.from_file else None
    return Cell(case.scene.name, law, contestant, model, step, phase, scene, until)


def law_of(contestant: Contestant, case: Case, asked: Law | None) -> Law:
    """Engines realise Newton-Coulomb, the reference the law asked for or the documents'; a scene may allow only one."""
    laws = case.scene.laws
    wanted = asked if asked and contestant.law == "doc" else contestant.law
    return wanted if wanted in laws else laws[0]


def compare(
    plan: Plan,
    command: str,
    progress: Progress = lambda *_: None,
    *,
    cache: Cache | None = None,
    executor: Executor | None = None,
    time_on_workers: bool = False,
) -> dict[str, Any]:
    """Run the plan and return the results document. One cell's fault costs that cell alone.

    `executor` takes the place of `plan.jobs` children here; times are taken here all the same, by one process, unless
    `time_on_workers`: then by one worker. Raises executors.ClusterError where workers are not like this machine.
    """
    begun = time.monotonic()
    cells = plan.cells()
    load = os.getloadavg()[0]
    document: dict[str, Any] = {
        "schema": results.SCHEMA,
        "provenance": provenance(command, plan.contestants, load),
        "cases": [describe(case) | limits_of(case) for case in plan.cases],
        "cells": [],
        "rows": [],
        "law_difference": [
            {"case": case.scene.name, **figure.row()} for case in plan.cases for figure in law_difference(case)
        ],
    }
    outcomes = accuracy_lane(cells, plan.jobs, progress, cache, executor)
    timings, notes = timing_lane(_timed(plan, cells, outcomes), progress, executor if time_on_workers else None)
    document["provenance"]["notes"] += [*(cache.notes(len(cells)) if cache else []), *notes]
    document["provenance"]["cached_cells"] = cache.served if cache else 0
    if plan.replay:
        progress("replays", 0, 1)
        cases = {case.scene.name: case for case in plan.cases}
        document["replays"] = replays(cases, plan.replayed(), cells, outcomes, plan.jobs)
        progress("replays", 1, 1)
    for cell, contestant in cells:
        outcome = outcomes[cell.key]
        repeats = {"repeats": timings[cell.key]["run"]} if timings.get(cell.key) else {}
        document["cells"].append(_cell_record(cell, contestant, outcome) | repeats)
        figures: list[Figure] = outcome.get("figures", [])
        figures = [*figures, *(timing_figures(timings[cell.key]) if timings.get(cell.key) else [])]
        index = len(document["cells"]) - 1
        document["rows"] += [{"cell": index, **figure.row()} for figure in figures]
    document["provenance"]["seconds"] = round(time.monotonic() - begun, 1)
    return document


def accuracy_lane(
    cells: Sequence[Entry],
    jobs: int,
    progress: Progress,
    cache: Cache | None = None,
    executor: Executor | None = None,
) -> dict[str, dict[str, Any]]:
    """Every cell once, in parallel; deterministic whatever the number of workers. What the cache holds is not run."""
    outcomes: dict[str, dict[str, Any]] = {}
    missing = {contestant.name: why for _, contestant in cells if (why := contestant.availability())}
    work: dict[str, Entry] = {}
    for cell, contestant in cells:
        if contestant.name in missing:
            outcomes[cell.key] = {"state": "unavailable", "reason": missing[contestant.name]}
        elif cache and (stored := cache.get(cell, contestant)):
            outcomes[cell.key] = stored
        else:
            work[cell.key] = (cell, contestant)
    for done, outcome in enumerate(_run_cells(work.values(), jobs, progress, executor), 1):
        outcomes[outcome.key] = _as_cell(outcome)
        if cache:
            cache.put(*work[outcome.key], outcomes[outcome.key])
        progress("accuracy", done, len(work))
    return outcomes


def _run_cells(
    cells: Iterable[Entry], jobs: int, progress: Progress, executor: Executor | None
) -> Generator[Outcome, None, None]:
    work = [
        Job(cell.key, contestant.lane, "impactbench.reports.cell:run_cell", (cell, contestant), CELL_LIMIT)
        for cell, contestant in cells
    ]
    if executor:
        return executors.run_on(executor, work)
    if any(job.lane == "reference" for job in work):
        compile_reference(progress)
    return run_jobs(work, jobs)


def compile_reference(progress: Progress) -> None:
    """Compile the reference's kernels before any cell's clock runs: some 40 s of processor time the first time, then
    stored.
    """
    parts = executors.WARM_UPS
    workers = min(len(parts), os.cpu_count() or 1)
    progress("compiling the reference (first run only)", 0, len(parts))
    for done, _ in enumerate(run_jobs(parts, workers), 1):
        progress("compiling the reference (first run only)", done, len(parts))


def _as_cell(outcome: Outcome) -> dict[str, Any]:
    if outcome.state == "done":
        assert isinstance(outcome.value, dict)
        return outcome.value
    return {"state": outcome.state, "reason": outcome.reason}


def _timed(plan: Plan, cells: Sequence[Entry], outcomes: dict[str, dict[str, Any]]) -> list[list[Entry]]:
    """Groups of cells to be timed against one another: one group a case, healthy cells of the first phase only."""
    names = plan.timed()
    groups: dict[str, list[Entry]] = {}
    for cell, contestant in cells:
        if cell.case in names and cell.phase == plan.phases[0] and outcomes[cell.key]["state"] == "ok":
            groups.setdefault(cell.case, []).append((cell, contestant))
    return list(groups.values())


def timing_lane(
    groups: Sequence[list[Entry]], progress: Progress, executor: Executor | None = None
) -> tuple[dict[str, Times], list[str]]:
    """One process, one thread, one case after another. A group that fails has no times but a note that says why."""
    if not groups:
        return {}, []
    limit = CELL_LIMIT * ROUNDS
    work = [
        Job(group[0][0].case, "timing", "impactbench.reports.cell:time_cells", (group, ROUNDS), limit)
        for group in groups
    ]
    work = [machine.check_job("before"), *work, machine.check_job("after")]
    times: dict[str, Times] = {}
    notes: list[str] = []
    checks: dict[str, Any] = {}
    # All of them on one worker: times of two machines do not compare.
    outcomes = executors.run_on(executor, work, len(work)) if executor else run_jobs(work, 1)
    for done, outcome in enumerate(outcomes, 1):
        if outcome.key in machine.CHECKS:
            checks[outcome.key] = outcome.value
        elif outcome.state == "done":
            assert isinstance(outcome.value, dict)
            times |= outcome.value
        else:
            notes.append(f"{outcome.key} was not timed: {outcome.state} ({outcome.reason})")
        progress("timing", done, len(work))
    return times, [*machine.notes(checks, executor is not None), *notes]


def _cell_record(cell: Cell, contestant: Contestant, outcome: dict[str, Any]) -> dict[str, Any]:
    return {
        "case": cell.case,
        "family": cell.case.partition("[")[0],
        "law": cell.law,
        "contestant": cell.contestant,
        "model": cell.model,
        "step": None if contestant.stepless else step_seconds(cell.step),
        "step_text": "no step" if contestant.stepless else cell.step,
        "phase": cell.phase,
        "state": outcome["state"],
        "reason": outcome["reason"],
        "version": contestant.version(),
        "settings": outcome.get("settings", {}),
    }


def describe(case: Case) -> dict[str, Any]:
    """What a reader of the report needs to know of a case."""
    scene = case.scene
    family = FAMILIES.get(scene.family) or HARD.get(scene.family)
    return {
        "name": scene.name,
        "family": scene.family,
        "question": family.question if family else "",
        "headline": case.headline,
        "laws": list(scene.laws),
        "truth": {law: truth.kind for law, truth in case.truths.items()},
        "duration": scene.duration,
        "length": scene.length,
        "speed": scene.speed,
        "energy": scene.energy,
        "parameters": scene.parameters,
        "model": asdict(scene.model),
        "in_catalogue": not case.from_file,
    }


def provenance(command: str, contestants: Iterable[Contestant], load: float) -> dict[str, Any]:
    """Where and with what the figures were made. Everything is deterministic: there are no seeds to store."""
    busy = load > 0.5
    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command,
        "impactbench": metadata.version("impactbench"),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processor": machine.processor(),
        "cores": os.cpu_count() or 1,
        "commit": machine.commit(),
        "versions": {c.engine: c.version() for c in contestants} | {"numpy": metadata.version("numpy")},
        "load": load,
        "clock_seconds": machine.clock_seconds(),
        "engines": {c.name: c.factory for c in contestants if c.factory not in {k.factory for k in CONTESTANTS}},
        "notes": [f"the machine was busy when this began (load {load:.1f}): times may be too long"] if busy else [],
    }
