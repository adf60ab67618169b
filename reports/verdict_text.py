"""Verdicts for a terminal and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from impactbench.reports.terminal import table
from impactbench.reports.verdicts import BASELINE, Verdict, counts

if TYPE_CHECKING:
    from impactbench.reports.gate import Finding

MOST_LINES = 40
"""Failures listed in full; the rest are counted."""


def figure(value: float, unit: str) -> str:
    """A number with its unit; 1 is a fraction of the scene's scale and goes without."""
    return "-" if not math.isfinite(value) else f"{value:.3g}" + ("" if unit == "1" else f" {unit}")


def line(verdict: Verdict) -> str:
    """One verdict in one line."""
    head = f"{verdict.status.upper()} {verdict.check}: {verdict.where} law {verdict.law}: "
    if math.isfinite(verdict.value) and verdict.status == "failed" and verdict.check != BASELINE:
        return head + (
            f"{verdict.measure} {figure(verdict.value, verdict.unit)}, budget {figure(verdict.budget, verdict.unit)}"
        )
    return head + verdict.reason


def text(verdicts: Sequence[Verdict], findings: Sequence[Finding] = ()) -> str:
    """Failures with what a look into them found, a table by contestant, and all counts."""
    bad = [verdict for verdict in verdicts if verdict.status in ("failed", "error", "unavailable", "incomparable")]
    looked = {id(finding.verdict): finding for finding in findings}
    bad.sort(key=lambda verdict: id(verdict) not in looked)
    lines = [part for verdict in bad[:MOST_LINES] for part in _told(verdict, looked.get(id(verdict)))]
    if len(bad) > MOST_LINES:
        lines.append(f"... and {len(bad) - MOST_LINES} more")
    if lines:
        lines.append("")
    return "\n".join([*lines, by_contestant(verdicts), "", totals(verdicts)])


def _told(verdict: Verdict, finding: Finding | None) -> list[str]:
    if finding is None:
        return [line(verdict)]
    found = [f"first at t = {finding.time:.4g} s"] if math.isfinite(finding.time) else []
    found += [f"bodies {', '.join(finding.bodies)}"] if finding.bodies else []
    return ["; ".join([line(verdict), *found]), f"    {finding.shortest or finding.command}"]


def by_contestant(verdicts: Sequence[Verdict]) -> str:
    names = list(dict.fromkeys(verdict.contestant for verdict in verdicts))
    columns = list(counts(()))
    rows = []
    for name in names:
        own = [verdict for verdict in verdicts if verdict.contestant == name]
        failed = list(dict.fromkeys(verdict.check for verdict in own if verdict.status == "failed"))
        rows.append([name, *(str(number) for number in counts(own).values()), ", ".join(failed) or "-"])
    return table(["contestant", *columns, "failed checks"], rows)


def totals(verdicts: Sequence[Verdict]) -> str:
    """All counts, always in the same order, and how many passed only by an entry of a budget file."""
    parts = [f"{number} {status}" for status, number in counts(verdicts).items()]
    limited = sum(1 for verdict in verdicts if verdict.status == "passed" and verdict.limit)
    return (
        "checks: "
        + ", ".join(parts)
        + (f"; {limited} passed by a limit that is not the derived one" if limited else "")
    )


def limits_used(verdicts: Sequence[Verdict]) -> list[str]:
    """Entries of budget files by which something passed that the derived budget would fail: for whom and how often."""
    used: dict[tuple[str, str, str], list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.status == "passed" and verdict.limit:
            used.setdefault((verdict.contestant, verdict.check, verdict.limit), []).append(verdict)
    return [f"{who} {check}, {len(those)} times ({limit})" for (who, check, limit), those in used.items()]


def margins(verdicts: Sequence[Verdict]) -> str:
    """Per check and contestant the largest share of its budget that was used, and where."""
    worst: dict[tuple[str, str, str], Verdict] = {}
    for verdict in verdicts:
        if verdict.status in ("passed", "failed") and math.isfinite(verdict.value):
            key = (verdict.check, verdict.contestant, "limit" if verdict.limit else "derived")
            if key not in worst or verdict.margin > worst[key].margin:
                worst[key] = verdict
    rows = [
        [check, name, kind, figure(v.value, v.unit), figure(v.budget, v.unit), f"{v.margin:.2g}", v.case]
        for (check, name, kind), v in worst.items()
    ]
    return table(["check", "contestant", "budget", "worst", "allowed", "share", "case"], sorted(rows))


def as_json(
    verdicts: Sequence[Verdict], document: Mapping[str, Any], code: int, findings: Sequence[Finding] = ()
) -> dict[str, Any]:
    """Everything a program needs; numbers that are none are null. A finding carries its worst verdict, how many there
    are, the first time [s], the bodies and the commands.
    """
    return {
        "exit_code": code,
        "counts": counts(verdicts),
        "provenance": document["provenance"],
        "verdicts": [_nulled(asdict(verdict)) for verdict in verdicts],
        "findings": [_nulled(asdict(finding) | {"verdict": _nulled(asdict(finding.verdict))}) for finding in findings],
    }


def _nulled(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in fields.items()}
