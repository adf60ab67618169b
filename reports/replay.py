"""Replays: one case of each family recorded for every contestant, packed for the page and for results.json.

    document["replays"] = {"notes", "limit", "series", "words", "cases": [{case, step_text, frame, bodies, view, camera,
                           truths: {law: track}, runs: [track with contacts, events, summary], "not_recorded"}]}

A *track* is motion over frames `frame` [s] apart: its box (`low`, `span` [m]) and one packed text (see `replay_pack`).
Everything here is for looking at; every number beside it was computed before any thinning (see `replay_record`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports.cell import Cell, step_seconds
from impactbench.reports.replay_record import LEVELS, LIMIT, SERIES
from impactbench.reports.replay_tracks import Recording, every, packed_case
from impactbench.scenarios.records import Scene
from impactbench.scenarios.truth import Case

STEP = 1 / 240
"""The recorded step is the ladder's nearest: fine enough to look smooth, coarse enough to go wrong."""
MOST_BODIES = 300
BUDGET = 600_000
"""Bytes of all packed tracks: a fifth of the page."""
RECORD_LIMIT = 60.0
CALL = "impactbench.reports.replay_record:record_run"


def replays(
    cases: Mapping[str, Case],
    chosen: Sequence[str],
    entries: Sequence[tuple[Cell, Contestant]],
    outcomes: Mapping[str, Mapping[str, Any]],
    jobs: int,
) -> Recording:
    """Record the `chosen` cases among the plan's `entries`, at one step, first phase and first model."""
    found: dict[str, list[Recording]] = {name: [] for name in chosen}
    silent: dict[str, list[dict[str, str]]] = {name: [] for name in chosen}
    jobs_of: list[Job] = []
    cells: dict[str, tuple[Cell, bool]] = {}
    for name in chosen:
        scene = cases[name].scene
        for planned, cell, contestant in recorded_cells([entry for entry in entries if entry[0].case == name]):
            if reason := unrecorded(scene, outcomes[planned.key]):
                silent[name].append({"contestant": cell.contestant, "reason": reason})
                continue
            argument = (cell, contestant, every(scene, cell.step_seconds))
            jobs_of.append(Job(planned.key, contestant.lane, CALL, argument, RECORD_LIMIT))
            cells[planned.key] = (cell, contestant.stepless)
    done = {outcome.key: outcome for outcome in run_jobs(jobs_of, jobs)}
    for key, (cell, stepless) in cells.items():
        outcome = done[key]
        if outcome.state == "done":
            assert isinstance(outcome.value, dict)
            state = outcomes[key]["state"]
            found[cell.case].append(outcome.value | {"cell": cell, "stepless": stepless, "state": state})
        else:
            silent[cell.case].append({"contestant": cell.contestant, "reason": f"{outcome.state}: {outcome.reason}"})
    return fitted([(cases[name], found[name], silent[name]) for name in chosen if found[name]])


def recorded_cells(entries: Sequence[tuple[Cell, Contestant]]) -> list[tuple[Cell, Cell, Contestant]]:
    """The plan's cell and the one to record, for each contestant; a runner without steps is read at the same times."""
    if not entries:
        return []
    steps = sorted({cell.step for cell, c in entries if not c.stepless}, key=lambda text: abs(nearness(text)))
    model, phase = entries[0][0].model, entries[0][0].phase
    text = steps[0] if steps else min((cell.step for cell, _ in entries), key=lambda text: abs(nearness(text)))
    return [
        (cell, replace(cell, step=text), contestant)
        for cell, contestant in entries
        if cell.model == model and cell.phase == phase and (cell.step == text or contestant.stepless)
    ]


def nearness(text: str) -> float:
    """How far a step is from the one to record, as a logarithm."""
    return math.log(step_seconds(text) / STEP)


def unrecorded(scene: Scene, outcome: Mapping[str, Any]) -> str:
    """Why there is no replay of this cell; empty where there is one."""
    if outcome["state"] not in ("ok", "diverged"):
        return f"{outcome['state']}: {outcome['reason']}"
    if len(scene.movable) > MOST_BODIES:
        return f"more than {MOST_BODIES} movable bodies"
    return ""


def fitted(raw: list[tuple[Case, list[Recording], list[dict[str, str]]]]) -> Recording:
    """Packed replays within the budget: the largest case loses every other frame until all fit."""
    thin = [1] * len(raw)
    packed = [packed_case(*entry, 1) for entry in raw]
    while sum(map(size, packed)) > BUDGET:
        largest = max(range(len(raw)), key=lambda i: size(packed[i]))
        if packed[largest]["frames"] < 8:  # a few frames say nothing: without it, rather
            packed[largest] |= {"runs": [], "truths": {}}
            thin[largest] = 0
            continue
        thin[largest] *= 2
        packed[largest] = packed_case(*raw[largest], thin[largest])
    notes = [
        f"Replay of {case['case']}: every {t}nd frame." if t == 2 else f"Replay of {case['case']}: every {t}th frame."
        for case, t in zip(packed, thin, strict=True)
        if t > 1
    ]
    notes += [f"Replay of {c['case']}: left out, too large." for c, t in zip(packed, thin, strict=True) if not t]
    kept = [case for case in packed if case["runs"]]
    return {"notes": notes, "limit": LIMIT, "levels": list(LEVELS), "series": list(SERIES), "cases": kept}


def size(case: Recording) -> int:
    """Bytes of a case's packed tracks."""
    return sum(len(track["data"]) for track in [*case["runs"], *case["truths"].values()])
