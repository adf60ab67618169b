"""Baselines: what was measured when somebody looked and accepted it, in a small file that is committed.

A run is compared with it by invariants, errors against truth and outcome, never bit by bit: a figure has changed where
it moved by more than a hundredth of what its check allows and more than a hundred times the derived round-off. A check
reads baselines and never writes one; `accept` does, and keeps a history of old and new figures, versions and reasons.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from impactbench.reports import results
from impactbench.reports.budget_formulas import EPSILON, MARGIN, Setting
from impactbench.reports.budgets import CHECKS
from impactbench.reports.cell import step_seconds
from impactbench.reports.verdicts import BASELINE, Verdict
from impactbench.scenarios.truth import Case

SCHEMA = 1
"""Raised when figures change their meaning: older baselines are then not comparable."""
NOTICED = 0.01
"""Part of a check's budget that a figure may move by."""
DIGITS = 9
MOST_CHANGES = 200
"""Changes that one entry of the history lists; the others are counted."""
PLACE = ("case", "law", "contestant", "model", "step_text", "phase")


class NotComparable(Exception):
    """There is nothing to compare with. One line: what, where, what is possible instead."""


@dataclass(frozen=True)
class Change:
    """One figure, or the outcome (measure empty), that is no longer what was accepted."""

    cell: tuple[Any, ...]
    measure: str
    old: float | str
    new: float | str
    tolerance: float
    worse: bool

    def size(self) -> float:
        """How much the figure moved; NaN where it is none."""
        numbers = isinstance(self.old, float) and isinstance(self.new, float)
        return abs(float(self.new) - float(self.old)) if numbers else math.nan

    def line(self) -> str:
        case, law, contestant, model, step, _ = self.cell
        values = [f"{v:.4g}" if isinstance(v, float) else v for v in (self.old, self.new)]
        return f"{case} {contestant} {step} law {law} {model}: {self.measure or 'outcome'} {values[0]} -> {values[1]}"


def read(path: Path) -> dict[str, Any]:
    """The baseline at `path`. Raises NotComparable."""
    hint = f'write one with `impactbench baseline accept {path} --reason "..."`'
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise NotComparable(f"cannot read baseline {path}: {error.strerror}; {hint}") from None
    except (ValueError, RecursionError) as error:
        raise NotComparable(f"{path} is not a baseline: {' '.join(str(error).split())}; {hint}") from None
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise NotComparable(f"{path} has baseline schema {schema!r}, this version reads {SCHEMA}; {hint}")
    if not _sound(document):
        raise NotComparable(f"{path} is not a baseline: cells, versions or history are not of its form; {hint}")
    return dict(document)


def _sound(document: Mapping[str, Any]) -> bool:
    cells, history = document.get("cells"), document.get("history")
    if not (isinstance(cells, list) and isinstance(history, list) and isinstance(document.get("versions"), dict)):
        return False
    return all(
        isinstance(cell, dict)
        and {"place", "state", "figures"} <= cell.keys()
        and isinstance(cell["place"], list)
        and len(cell["place"]) == len(PLACE)
        and isinstance(cell["figures"], dict)
        and all(isinstance(v, (int, float)) and math.isfinite(v) for v in cell["figures"].values())
        for cell in cells
    )


def cells_of(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What a results document says that a baseline keeps: outcome and the figures that checks read."""
    kept = {check.measure for check in CHECKS}
    figures: dict[int, dict[str, float]] = {}
    for row in document["rows"]:
        if row["measure"] in kept:
            figures.setdefault(row["cell"], {})[row["measure"]] = float(f"{row['value']:.{DIGITS}g}")
    return [
        {"place": [cell[key] for key in PLACE], "state": cell["state"], "figures": figures.get(number, {})}
        for number, cell in enumerate(document["cells"])
    ]


def changes(old: Iterable[Mapping[str, Any]], new: Iterable[Mapping[str, Any]], cases: Iterable[Case]) -> list[Change]:
    """Every figure and outcome of the cells both have that has changed."""
    before = {tuple(cell["place"]): cell for cell in old}
    by_name = {case.scene.name: case for case in cases}
    found: list[Change] = []
    for cell in new:
        place = tuple(cell["place"])
        if place in before and place[0] in by_name:
            found += _changed(place, before[place], cell, by_name[place[0]])
    return found


def _changed(place: tuple[Any, ...], old: Mapping[str, Any], new: Mapping[str, Any], case: Case) -> list[Change]:
    if old["state"] != new["state"]:
        return [Change(place, "", old["state"], new["state"], 0.0, old["state"] == "ok")]
    step = place[PLACE.index("step_text")]
    setting = Setting(case, place[1], step_seconds(step if step != "no step" else "1/240"))
    found = []
    for measure in sorted(old["figures"].keys() | new["figures"].keys()):
        was, now = old["figures"].get(measure), new["figures"].get(measure)
        if was is None or now is None:
            found.append(Change(place, measure, _shown(was), _shown(now), 0.0, now is None))
            continue
        tolerance = _tolerance(measure, setting)
        if abs(now - was) > tolerance:
            found.append(Change(place, measure, float(was), float(now), tolerance, abs(now) > abs(was)))
    return found


def _shown(value: float | None) -> float | str:
    return "none" if value is None else float(value)


def _tolerance(measure: str, setting: Setting) -> float:
    """A hundredth of the widest budget of the checks that read this figure, or a hundred round-offs a step."""
    readers = [check for check in CHECKS if check.measure == measure]
    speaking = [check for check in readers if not check.excused(setting.case, setting.law)]
    budget = max((check.budget(setting) for check in speaking or readers[:1]), default=0.0)
    return max(NOTICED * budget, MARGIN * setting.steps * EPSILON)


def compare(baseline: Mapping[str, Any], document: Mapping[str, Any], cases: Sequence[Case]) -> list[Verdict]:
    """A verdict a cell: failed where something became worse, incomparable where the baseline does not hold the cell."""
    new = cells_of(document)
    known = {tuple(cell["place"]) for cell in baseline["cells"]}
    by_cell: dict[tuple[Any, ...], list[Change]] = {}
    for change in changes(baseline["cells"], new, cases):
        by_cell.setdefault(change.cell, []).append(change)
    return [_verdict(tuple(cell["place"]), known, by_cell, baseline["versions"], document) for cell in new]


def _verdict(
    place: tuple[Any, ...],
    known: set[tuple[Any, ...]],
    by_cell: Mapping[tuple[Any, ...], list[Change]],
    versions: Mapping[str, Any],
    document: Mapping[str, Any],
) -> Verdict:
    case, law, contestant, model, step, phase = place
    blank = Verdict(BASELINE, case, law, contestant, model, step, phase, "passed")
    if place not in known:
        return replace(blank, status="incomparable", reason="the baseline does not hold this cell")
    moved = by_cell.get(place, [])
    worse = [change for change in moved if change.worse]
    engine = contestant.partition("/")[0]
    then, now = versions.get(engine), document["provenance"]["versions"].get(engine)
    between = "" if then == now else f" ({engine} {then} -> {now})"
    told = "; ".join(change.line().partition(": ")[2] for change in (worse or moved)[:3])
    if not worse:
        return replace(blank, reason=f"better: {told}{between}" if moved else "")
    value, budget = worse[0].size(), worse[0].tolerance
    unit = next((check.unit for check in CHECKS if check.measure == worse[0].measure), "1")
    return replace(
        blank, status="failed", measure=f"change of {worse[0].measure}", value=value, budget=budget, unit=unit,
        reason=f"changed: {told}{between}",
    )  # fmt: skip


def missing(reason: str) -> Verdict:
    """The one verdict of a baseline that cannot be read."""
    return Verdict(BASELINE, "-", "nc", "-", "-", "-", 0.0, "incomparable", reason=reason)


def accept(path: Path, document: Mapping[str, Any], cases: Sequence[Case], reason: str) -> list[Change]:
    """Write what was measured as the baseline at `path`; returns what changed. Cells that were not run stay.

    The history gets an entry: date, reason, versions before and after, old and new figures. Raises NotComparable where
    the file there is no baseline (it stays as it is) and OSError where it cannot be written.
    """
    old = read(path) if path.exists() else {"cells": [], "versions": {}, "history": []}
    new = cells_of(document)
    changed = changes(old["cells"], new, cases)
    fresh = {tuple(cell["place"]): cell for cell in new}
    before = {tuple(cell["place"]) for cell in old["cells"]}
    versions = old["versions"] | document["provenance"]["versions"]
    entry = {
        "accepted": document["provenance"]["created"],
        "reason": reason,
        "versions": {"old": old["versions"], "new": versions},
        "changes": [change.line() for change in changed[:MOST_CHANGES]],
        "not_listed": max(0, len(changed) - MOST_CHANGES),
        "added": len(fresh.keys() - before),
    }
    kept = [fresh.pop(tuple(cell["place"]), cell) for cell in old["cells"]]
    whole = {"versions": versions, "history": [*old["history"], entry], "cells": [*kept, *fresh.values()]}
    results.write_text(path, _text(whole))
    return changed


def _text(document: Mapping[str, Any]) -> str:
    """One line a cell, so that a diff of the file reads well."""
    cells = ",\n".join("  " + json.dumps(cell, allow_nan=False) for cell in document["cells"])
    head = json.dumps({"versions": document["versions"], "history": document["history"]}, indent=1, allow_nan=False)
    return f'{{\n "schema": {SCHEMA},{head[1:-2]},\n "cells": [\n{cells}\n ]\n}}\n'
