"""Two results documents compared figure by figure: better, worse, no significant change, or not comparable and why.

Errors are deterministic: the same scene, engine and settings give the same figure, each good to the round-off floor,
so that two figures differ where they are more than twice the floor apart. Times differ where their 95 % intervals do
not overlap.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from impactbench.reports import rankings
from impactbench.reports.page_data import FLOOR, tidy_cells, tidy_rungs
from impactbench.reports.rankings import Rankings

THRESHOLD = 2 * FLOOR
"""Each of the two figures is uncertain by the floor."""
BETTER, WORSE, SAME, UNKNOWN = "better", "worse", "no significant change", "not comparable"
MARKS = {WORSE: "✕", BETTER: "✓", UNKNOWN: "?", SAME: "≈"}
FAULTS = ("diverged", "crashed", "timed out", "error")
MACHINE = ("processor", "cores", "platform", "python")
DEFINITION = ("headline", "truth", "duration", "length", "speed", "energy", "parameters", "model")
SKIPPED = ("wall_", "restitution_measured", "offset_energy", "null_", "floor_")
"""Properties of a run rather than errors of it; of the times only the median is compared, by its interval."""
LARGER_IS_BETTER = ("self_horizon",)
KEY = ["case", "contestant", "model", "law", "step_text"]


@dataclass(frozen=True)
class Change:
    """One measure of one case and policy; `before` and `after` at the step that decides the verdict."""

    case: str
    policy: str
    measure: str
    verdict: str
    why: str = ""
    step: str = ""
    before: float | None = None
    after: float | None = None
    unit: str = "1"
    steps: int = 1

    @property
    def size(self) -> float:
        """How far apart the figures are, in the measure's unit; states and unknowns have none."""
        return 0.0 if self.before is None or self.after is None else abs(abs(self.after) - abs(self.before))


@dataclass(frozen=True)
class Diff:
    """All changes between two documents, worst first, and what is said of both."""

    before: dict[str, Any]
    after: dict[str, Any]
    changes: list[Change]
    notes: list[str] = field(default_factory=list)
    rankings: Rankings = field(default_factory=Rankings)

    def counts(self) -> dict[str, int]:
        """Number of (case, policy, measure) by verdict."""
        found = Counter(change.verdict for change in self.changes)
        return {verdict: found[verdict] for verdict in MARKS}

    def of(self, verdict: str) -> list[Change]:
        """Changes of this verdict, largest first."""
        return [change for change in self.changes if change.verdict == verdict]

    def reasons(self) -> dict[str, int]:
        """Why figures cannot be compared, most frequent first."""
        return dict(Counter(change.why for change in self.of(UNKNOWN)).most_common())


def compare(before: dict[str, Any], after: dict[str, Any]) -> Diff:
    """The differences of two documents, one entry for each case, policy and measure."""
    tables = [_rungs(document) for document in (before, after)]
    units = {row["measure"]: row.get("unit", "1") for document in (before, after) for row in document["rows"]}
    hindrance = _hindrances(before, after)
    machine = [name for name in MACHINE if before["provenance"].get(name) != after["provenance"].get(name)]
    rungs: dict[tuple[str, str, str], list[Change]] = {}
    for change in _rung_changes(tables[0], tables[1], units, hindrance, machine):
        rungs.setdefault((change.case, change.policy, change.measure), []).append(change)
    order = list(MARKS)
    changes = [_worst(found) for found in rungs.values()]
    changes.sort(key=lambda change: (order.index(change.verdict), -change.size))
    return Diff(before, after, changes, _notes(before, after, machine), rankings.compare(before, after))


def _rungs(document: dict[str, Any]) -> pd.DataFrame:
    """Worst phase of every rung, by case, contestant, model, law and step."""
    cells = tidy_cells(document)
    cells["policy"] = cells["contestant"] + "\n" + cells["model"] + "\n" + cells["law"]
    phases = cells.groupby(["case", "policy", "step"])["phase"].agg(lambda found: tuple(sorted(set(found))))
    rungs = tidy_rungs(cells, document["rows"]).join(phases.rename("phases"), on=["case", "policy", "step"])
    return rungs.drop_duplicates(KEY).set_index(KEY)


def _hindrances(before: dict[str, Any], after: dict[str, Any]) -> dict[str, str]:
    """Cases whose figures cannot be compared, and why; every case where the harness itself is another."""
    versions = [document["provenance"].get("impactbench") for document in (before, after)]
    known = [{case["name"]: case for case in document["cases"]} for document in (before, after)]
    found = {}
    for name in known[0].keys() & known[1].keys():
        other = [key for key in DEFINITION if known[0][name].get(key) != known[1][name].get(key)]
        if other:
            found[name] = f"the case is defined otherwise ({', '.join(other)})"
        if versions[0] != versions[1]:
            found[name] = f"other version of impactbench ({versions[0]}, {versions[1]})"
    return found


def _rung_changes(
    a: pd.DataFrame, b: pd.DataFrame, units: dict[str, str], hindrance: dict[str, str], machine: list[str]
) -> Iterator[Change]:
    measures = [m for m in units if not m.startswith(SKIPPED)] + [m for m in ("wall_time",) if m in units]
    rows_a, rows_b = a.to_dict("index"), b.to_dict("index")
    others = _partners(rows_a), _partners(rows_b)
    keys = list(dict.fromkeys([*rows_a, *rows_b]))
    policies = _policies(keys)
    for key in keys:
        case, policy = str(key[0]), policies[key]
        old, new = rows_a.get(key), rows_b.get(key)
        whole = _of_rung(key, old, new, others, hindrance)
        if whole:
            verdict, why = whole
            if verdict:
                yield Change(case, policy, "state", verdict, why, str(key[4]))
            continue
        assert old is not None and new is not None  # noqa: PT018
        for measure in measures:
            values = _value(old, measure), _value(new, measure)
            if values == (None, None):
                continue
            verdict, why = _of_measure(measure, old, new, machine)
            yield Change(case, policy, measure, verdict, why, str(key[4]), *values, units[measure])


def _policies(keys: list[Any]) -> dict[Any, str]:
    """Contestant, with its model where that is not the usual and its law where it ran a case under several."""
    laws: dict[Any, set[str]] = {}
    for case, contestant, _, law, _ in keys:
        laws.setdefault((case, contestant), set()).add(law)
    return {
        key: str(key[1])
        + ("" if key[2] == "minimal" else f" · {key[2]}")
        + (f" · {key[3]}" if len(laws[key[0], key[1]]) > 1 else "")
        for key in keys
    }


def _partners(rungs: dict[Any, Any]) -> dict[Any, Any]:
    """Rungs by case, contestant and step alone: the same run under another law or model."""
    return {(key[0], key[1], key[4]): key for key in rungs}


def _of_rung(key: Any, old: Any, new: Any, others: Any, hindrance: dict[str, str]) -> tuple[str, str] | None:
    """Verdict on a rung as a whole and why; an empty verdict where there is nothing to say; None: look at figures."""
    if old is None or new is None:
        side, there = ("before", others[0]) if old is None else ("after", others[1])
        partner = there.get((key[0], key[1], key[4]))
        if partner is None:
            return UNKNOWN, f"not measured {side}"
        name, at = ("law", 3) if partner[3] != key[3] else ("model", 2)
        return UNKNOWN, f"other {name} ({', '.join(sorted({str(partner[at]), str(key[at])}))})"
    states = old["state"], new["state"]
    if states == ("ok", "ok"):
        if key[0] in hindrance:
            return UNKNOWN, hindrance[key[0]]
        return (UNKNOWN, "other impact phases") if old["phases"] != new["phases"] else None
    if states[0] == states[1]:
        return "", ""
    why = f"{states[0]} before, {states[1]} after" + (f": {new['reason']}" if new["reason"] else "")
    if states[1] in FAULTS and states[0] == "ok":
        return WORSE, why
    return (BETTER if states[0] in FAULTS and states[1] == "ok" else UNKNOWN), why


def _value(rung: Any, measure: str) -> float | None:
    value = rung.get(measure, np.nan)
    return None if pd.isna(value) else float(value)


def _of_measure(measure: str, old: Any, new: Any, machine: list[str]) -> tuple[str, str]:
    before, after = _value(old, measure), _value(new, measure)
    if before is None or after is None:
        return UNKNOWN, f"no {measure} {'before' if before is None else 'after'}"
    if measure == "wall_time":
        if machine:
            return UNKNOWN, f"times of another machine ({', '.join(machine)})"
        return _by_interval(old, new), ""
    rise = abs(after) - abs(before)
    if abs(rise) <= THRESHOLD:
        return SAME, ""
    return (BETTER if (rise < 0) != (measure in LARGER_IS_BETTER) else WORSE), ""


def _by_interval(old: Any, new: Any) -> str:
    """Times differ where the 95 % intervals of their medians do not overlap."""
    nan = float("nan")  # compares as no difference
    low, high = ([float(rung.get(f"wall_time_{end}", nan)) for rung in (old, new)] for end in ("low", "high"))
    if low[1] > high[0]:
        return WORSE
    return BETTER if high[1] < low[0] else SAME


def _worst(found: list[Change]) -> Change:
    """One entry for all steps: worse where any step is, else better where any is; the largest change stands for it."""
    verdict = next(v for v in (WORSE, BETTER, SAME, UNKNOWN) if any(change.verdict == v for change in found))
    decided = [change for change in found if change.verdict == verdict]
    largest = max(decided, key=lambda change: change.size)
    against = BETTER if verdict == WORSE else ""
    opposite = sum(change.verdict == against for change in found)
    why = largest.why or (f"better at {opposite} of {len(found)} steps" if opposite else "")
    return Change(**{**largest.__dict__, "steps": len(decided), "why": why})


def _notes(before: dict[str, Any], after: dict[str, Any], machine: list[str]) -> list[str]:
    """What differs between the two runs as wholes."""
    a, b = before["provenance"], after["provenance"]
    names = [*a.get("versions", {}), *(name for name in b.get("versions", {}) if name not in a.get("versions", {}))]
    pairs = [(name, a.get("versions", {}).get(name), b.get("versions", {}).get(name)) for name in names]
    found = [f"{name} {old or 'absent'} before, {new or 'absent'} after" for name, old, new in pairs if old != new]
    if machine:
        found.append(f"other machine ({', '.join(machine)}): times are not compared, errors are")
    return found
