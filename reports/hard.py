"""The hard set: plan the cells, run them in child processes, store each as it is finished, gather one document."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from impactbench.adapters import contestants as table
from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports import results
from impactbench.reports.cell import Cell
from impactbench.reports.compare import Progress, compile_reference, law_of, provenance
from impactbench.scenarios.hard import HARD, case_named, criteria_of
from impactbench.scenarios.records import Scene
from impactbench.scenarios.truth import Case

LINES = "hard.jsonl"
"""Cells of a run that is not complete yet, one a line."""
Entry = tuple[Cell, Contestant]
LIMIT, FULL_LIMIT = 120.0, 3600.0
"""Seconds one cell may take: some five times the slowest healthy one of the default set; more with `--full`."""


def plan(cases: Sequence[Case], contestants: Sequence[Contestant], policies: bool) -> list[Entry]:
    """Every case with every contestant at its family's steps; with `policies`, the family's own settings too."""
    entries = []
    for case in cases:
        family = HARD[case.scene.family]
        extra = table.select(family.policies) if policies and family.policies else ()
        for contestant in dict.fromkeys((*contestants, *extra)):
            steps = family.steps(case.scene)
            for step in steps if not contestant.stepless else steps[-1:]:
                law = law_of(contestant, case, None)
                entries.append((Cell(case.scene.name, law, contestant.name, "minimal", step), contestant))
    return entries


def run(
    entries: Sequence[Entry], folder: Path, jobs: int, command: str, progress: Progress, limit: float = LIMIT
) -> dict[str, Any]:
    """Run what FOLDER/hard.jsonl does not hold yet, store every cell the moment it is finished, return the document.

    A run that was killed goes on where it stopped. The caller removes the lines once the document is stored.
    """
    load = os.getloadavg()[0]
    document: dict[str, Any] = {
        "schema": results.SCHEMA,
        "provenance": provenance(command, [c for _, c in entries], load),
    }
    journal = Journal(folder / LINES, {name: document["provenance"][name] for name in ("impactbench", "commit")})
    found = {key: stored for cell, who in entries if (stored := journal.cells.get(key := key_of(cell, who)))}
    for cell, who in entries:
        if key_of(cell, who) not in found and (why := who.availability()):
            found[key_of(cell, who)] = {"state": "unavailable", "reason": why}
    work = [
        Job(key, who.lane, "impactbench.reports.hard_cell:run_hard", (cell, who), limit)
        for cell, who in entries
        if (key := key_of(cell, who)) not in found
    ]
    if any(job.lane == "reference" for job in work):
        compile_reference(progress)
    done = len(entries) - len(work)
    progress("hard cases", done, len(entries))
    for outcome in run_jobs(work, jobs):
        value = outcome.value if outcome.state == "done" else {"state": outcome.state, "reason": outcome.reason}
        assert isinstance(value, dict)
        found[outcome.key] = {**value, "seconds": outcome.seconds}
        journal.add(outcome.key, found[outcome.key])
        done += 1
        progress("hard cases", done, len(entries))
    names = dict.fromkeys(cell.case for cell, _ in entries)
    cases = {name: case for name in names if (case := case_named(name)) is not None}
    document["families"] = [describe_family(name) for name in dict.fromkeys(c.scene.family for c in cases.values())]
    document["cases"] = [describe_case(case.scene) for case in cases.values()]
    document["cells"] = [cell_record(cell, who, found[key_of(cell, who)]) for cell, who in entries]
    return document


def key_of(cell: Cell, contestant: Contestant) -> str:
    """What identifies a stored cell: another version of an engine is another cell."""
    return f"{cell.key} {contestant.version()}"


class Journal:
    """Finished cells, a line each. A line is written by one call, so that a killed run leaves at most its last torn."""

    def __init__(self, path: Path, origin: dict[str, Any]) -> None:
        self.path = path
        self.cells: dict[str, dict[str, Any]] = {}
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        rows = [row for line in lines if (row := _parsed(line)) is not None]
        if rows and rows[0] == origin:
            self.cells = {row["key"]: row["cell"] for row in rows[1:]}
            if lines and _parsed(lines[-1]) is None:
                self._append("\n")  # a torn line ends here, so that the next stands alone
        else:
            results.write_text(path, json.dumps(origin) + "\n")

    def add(self, key: str, cell: dict[str, Any]) -> None:
        self._append(json.dumps({"key": key, "cell": cell}, allow_nan=False) + "\n")

    def _append(self, text: str) -> None:
        with self.path.open("ab", buffering=0) as stream:
            stream.write(text.encode())


def _parsed(line: str) -> dict[str, Any] | None:
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None


def describe_family(name: str) -> dict[str, Any]:
    family = HARD[name]
    made = [family.make(**values).scene for values in family.values]
    criteria = {c.name: c for scene in made for c in criteria_of(scene)}  # boxes are asked what balls are not
    return {
        "name": name,
        "question": family.question,
        "needs": family.needs,
        "policies": list(family.policies),
        "criteria": [
            {"name": c.name, "description": c.description, "limit": c.limit, "derivation": c.derivation}
            for c in criteria.values()
        ],
    }


def describe_case(scene: Scene) -> dict[str, Any]:
    """Parameters and criteria; where the start is drawn at random, its values too: generators may change."""
    case: dict[str, Any] = {
        "name": scene.name,
        "family": scene.family,
        "parameters": scene.parameters,
        "duration": scene.duration,
        "bodies": len(scene.movable),
        "criteria": [criterion.name for criterion in criteria_of(scene)],
    }
    if "seed" in scene.parameters:
        bodies = [scene.bodies[i] for i in scene.movable]
        case["initial"] = {"positions": [b.position for b in bodies], "velocities": [b.velocity for b in bodies]}
    return case


def cell_record(cell: Cell, contestant: Contestant, outcome: dict[str, Any]) -> dict[str, Any]:
    return {
        **{name: value for name, value in asdict(cell).items() if name in ("case", "law", "contestant", "step")},
        "version": contestant.version(),
        "verdicts": [],
        "outcome": "",
        "settings": {},
        **outcome,
    }
