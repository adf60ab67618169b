"""Metamorphic relations over cases and contestants: trials in child processes, a table of the worst deviations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports.cell import step_seconds
from impactbench.reports.compare import law_of
from impactbench.reports.relations import MEANING, RELATIONS
from impactbench.scenarios.truth import Case

DEFAULT = (
    "equal_masses[bounciness=0.5]",
    "unequal_masses[mass_ratio=100,bounciness=0.5]",
    "oblique_pair[offset=0.5,bounciness=0.5]",
    "oblique_wall[angle=45,bounciness=0.5,dimension=3]",
    "box_of_walls[dimension=2,hit=faces]",
    "bouncing_ball[bounciness=0.8]",
    "stacked_drop[shape=sphere,count=3]",
    "newtons_cradle[count=5,gap=0.01]",
    "coulomb_slide[heading=0]",
    "sliding_on_slab[friction=coulomb]",
    "rolling_onset[friction=0.3]",
    "oblique_friction_impact[angle=60,bounciness=0.5]",
    "rigid_offset_hit[offset=0.25,bounciness=1]",
    "rod_drop[angle=60,bounciness=0.5]",
)
"""Impacts, walls, piles, friction, rolling, rigid bodies: none of them chaotic."""
LIMIT = 120.0
"""Seconds one case may take with one contestant, all relations together."""
GRAVE = 0.01
"""A deviation from here on is no matter of a solver's tolerance."""
Progress = Callable[[str, int, int], None]


def metamorphic(
    cases: Sequence[Case],
    contestants: Sequence[Contestant],
    step: str,
    jobs: int,
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """The section's part: a trial for every case and contestant, and the worst deviation of each relation."""
    from impactbench.reports.compare import compile_reference

    pairs = {f"{c.scene.name} {who.name}": (c, who) for who in contestants for c in cases}
    missing = {key: why for key, (_, who) in pairs.items() if (why := who.availability())}
    work = [
        Job(
            key,
            who.lane,
            "impactbench.reports.relations:try_case",
            (who, law_of(who, case, None), case.scene, step_seconds(step)),
            LIMIT,
        )
        for key, (case, who) in pairs.items()
        if key not in missing
    ]
    if any(job.lane == "reference" for job in work):
        compile_reference(progress)
    found: dict[str, dict[str, Any]] = {
        key: {"state": "unavailable", "reason": why, "rows": []} for key, why in missing.items()
    }
    for done, outcome in enumerate(run_jobs(work, jobs), 1):
        value = outcome.value
        found[outcome.key] = (
            value
            if outcome.state == "done" and isinstance(value, dict)
            else {"state": outcome.state, "reason": outcome.reason, "rows": []}
        )
        progress("relations", done, len(work))
    trials = [{"case": case.scene.name, "contestant": who.name, **found[key]} for key, (case, who) in pairs.items()]
    return {
        "step": step,
        "contestants": [who.name for who in contestants],
        "relations": [{"name": name, "meaning": MEANING[name]} for name in RELATIONS],
        "worst": worst(trials, [who.name for who in contestants]),
        "trials": trials,
    }


def worst(trials: Sequence[dict[str, Any]], contestants: Sequence[str]) -> list[dict[str, Any]]:
    """A record for each relation and contestant: the row furthest above what is allowed, else the largest."""
    records = []
    for relation in RELATIONS:
        for name in contestants:
            rows = [
                {**row, "case": trial["case"]}
                for trial in trials
                if trial["contestant"] == name
                for row in trial["rows"]
                if row["relation"] == relation
            ]
            if not rows:
                continue
            first = max(rows, key=_badness)
            tried = sum(row["state"] in ("exact", "holds", "inexact", "memory", "broken") for row in rows)
            broken = sum(row["state"] in BAD for row in rows)
            records.append({"contestant": name, "tried": tried, "broken": broken, **first})
    return records


BAD = ("broken", "error", "diverged")
ORDER = ("unsupported", "sensitive", "exact", "holds", "inexact", "memory", "broken", "diverged", "error")


def _badness(row: dict[str, Any]) -> tuple[int, float]:
    return ORDER.index(row["state"]), row["deviation"] or 0.0


def text(part: dict[str, Any]) -> str:
    """The table for the terminal, and where the grave ones were found."""
    from impactbench.reports.terminal import table

    rows = view(part)["rows"]
    lines = [[row["name"], *(cell["text"] for cell in row["cells"])] for row in rows]
    names = ["relation", *(name.replace("/", " ") for name in part["contestants"])]
    grave = [
        [f"{r['contestant']}", r["relation"], r["case"], r["label"], _shown(r)] for r in part["worst"] if _grave(r)
    ]
    parts = [table(names, lines, right=1), NOTE]
    if grave:
        head = ["contestant", "relation", "worst case", "variant", "deviation"]
        parts.append(f"Deviations of {GRAVE:.0%} of the scene and more:\n" + table(head, grave, right=4))
    lost = [f"{t['contestant']}, {t['case']}: {t['state']} ({t['reason']})" for t in part["trials"] if _lost(t)]
    return "\n\n".join([*parts, *(["\n".join(lost)] if lost else [])])


NOTE = """\
Worst deviation over all cases and variants, in the scene's length and speed. 0: bit for bit. No mark: within round-off,
or falling with the step where only that can be asked. ~: round-off where bit for bit was possible. !: more than that.
m: in contact, whose memory no state holds. ?: no verdict, small differences grow too much. -: unsupported, or does not
apply."""


def _lost(trial: dict[str, Any]) -> bool:
    return trial["state"] not in ("ok", "unsupported", "unavailable")


def _grave(row: dict[str, Any]) -> bool:
    return row["state"] in BAD and (row["deviation"] is None or row["deviation"] >= GRAVE)


def _shown(row: dict[str, Any] | None) -> str:
    if row is None or row["state"] == "unsupported":
        return "-"
    if row["deviation"] is None:
        return str(row["state"])
    figure = "0" if row["deviation"] == 0 else f"{row['deviation']:.1e}"
    return figure + {"broken": " !", "inexact": " ~", "memory": " m", "sensitive": " ?"}.get(row["state"], "")


def view(part: dict[str, Any]) -> dict[str, Any]:
    """What the page shows."""
    cells = {(row["relation"], row["contestant"]): row for row in part["worst"]}
    rows = [
        {
            **relation,
            "cells": [_cell(cells.get((relation["name"], name))) for name in part["contestants"]],
        }
        for relation in part["relations"]
    ]
    grave = [{**row, "shown": _shown(row)} for row in part["worst"] if _grave(row)]
    cases = sorted({trial["case"] for trial in part["trials"] if trial["rows"]})
    return {"step": part["step"], "contestants": part["contestants"], "rows": rows, "grave": grave, "cases": cases}


def _cell(row: dict[str, Any] | None) -> dict[str, str]:
    title = "" if row is None else f"{row['case']}, {row['label']}"
    return {"text": _shown(row), "title": title}
