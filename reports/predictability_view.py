"""Horizons of many cases: the runs in child processes, the table for the terminal and for the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.scenarios.truth import Case

DEFAULT = (
    "dispersing_billiard",
    "box_of_walls",
    "oblique_pair[offset=0.5,bounciness=0.5]",
    "bouncing_ball[bounciness=0.8]",
    "mass_chain",
)
LIMIT = 300.0
REFERENCE = "reference"
Progress = Callable[[str, int, int], None]


def predict(
    cases: Sequence[Case], contestants: Sequence[Contestant], jobs: int, progress: Progress = lambda *_: None
) -> dict[str, Any]:
    """The section's part: a row for every case, and for every contestant asked for."""
    from impactbench.reports.compare import compile_reference

    runners: list[Contestant | None] = [*contestants] if contestants else [None]
    asked = {(case.scene.name, who.name if who else REFERENCE): (case, who) for case in cases for who in runners}
    lanes = {key: who.lane if who else REFERENCE for key, (_, who) in asked.items()}
    if REFERENCE in lanes.values():
        compile_reference(progress)
    work = [
        Job("\n".join(key), lanes[key], "impactbench.reports.predictability:try_case", (_sent(case), None, who), LIMIT)
        for key, (case, who) in asked.items()
    ]
    found: dict[str, dict[str, Any]] = {}
    for done, outcome in enumerate(run_jobs(work, jobs), 1):
        value = outcome.value
        failed = {"state": outcome.state, "reason": outcome.reason}
        found[outcome.key] = value if outcome.state == "done" and isinstance(value, dict) else failed
        progress("horizons", done, len(work))
    rows = [
        {"case": name, "asked": runner, "duration": case.scene.duration, "declared": _declared(case), **_of(found, key)}
        for key, (case, _) in asked.items()
        for name, runner in [key]
    ]
    return {"rows": rows}


def _of(found: dict[str, dict[str, Any]], key: tuple[str, str]) -> dict[str, Any]:
    return found["\n".join(key)]


def _sent(case: Case) -> Any:
    """A child builds the catalogue's cases itself; a scene file's goes along without its truth."""
    return case.scene if case.from_file else case.scene.name


def _declared(case: Case) -> float | None:
    known = min(truth.horizon for truth in case.truths.values())
    return known if math.isfinite(known) else None


def text(part: dict[str, Any]) -> str:
    from impactbench.reports.terminal import table

    shown = view(part)["rows"]
    names = [
        "case",
        "copies by",
        "growth",
        "rate [1/s]",
        "amplification",
        "horizon [s]",
        "duration [s]",
        "declared [s]",
    ]
    rows = [[r["case"], r["runner"], r["growth"], *r["figures"]] for r in shown]
    return "\n\n".join([table(names, rows, right=3), NOTE])


NOTE = """\
Growth of the spread of copies 1e-12 ... 1e-3 off. Horizon: when copies that are off by round-off are 1 % of the scene
apart; trajectories are not compared beyond. Declared: what the case's truth holds."""


def view(part: dict[str, Any]) -> dict[str, Any]:
    """What the page shows."""
    return {"rows": [_row(row) for row in part["rows"]]}


def _row(row: dict[str, Any]) -> dict[str, Any]:
    declared = "-" if row["declared"] is None else f"{row['declared']:.3g}"
    if row["state"] != "ok":
        lost = f"{row['state']}: {row['reason']}"
        return {"case": row["case"], "runner": row["asked"], "growth": lost, "figures": ["-"] * 4 + [declared]}
    rate = "-" if row["growth"] == "none" else f"{row['rate']:.4g}"
    horizon = f"{row['time']:.3g}" if row["reached"] else "beyond"
    figures = [rate, f"{row['amplification']:.2g}", horizon, f"{row['duration']:.3g}", declared]
    return {"case": row["case"], "runner": row["runner"], "growth": row["growth"], "figures": figures}
