"""What a CI service shows of a check: a step summary in Markdown, annotations, a script that repeats the failures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from impactbench.reports.gate import Finding
from impactbench.reports.junit import told
from impactbench.reports.verdict_text import limits_used, totals
from impactbench.reports.verdicts import Verdict, counts

MOST_BYTES = 200_000
"""A summary is kept below this; services cut or refuse longer ones."""
MOST_ANNOTATIONS = 9
"""One more says how many there are: a service shows ten of a step."""


def summary(verdicts: Sequence[Verdict], findings: Sequence[Finding], provenance: Mapping[str, Any], code: int) -> str:
    """Verdict, table by contestant, failures with their commands; below `MOST_BYTES`."""
    head = [f"## impactbench check: {_outcome(code)}", "", totals(verdicts), "", *_by_contestant(verdicts), ""]
    versions = ", ".join(f"{name} {version}" for name, version in provenance["versions"].items() if version)
    tail = ["", f"impactbench {provenance['impactbench']}, Python {provenance['python']}, {versions}", ""]
    body = _failures(findings)
    room = MOST_BYTES - len("\n".join([*head, *tail]).encode()) - 200
    kept: list[str] = []
    for block in body:
        room -= len(block.encode()) + 1
        if room < 0:
            kept.append(f"\n... and {len(body) - len(kept)} more; the JUnit file has all of them")
            break
        kept.append(block)
    return "\n".join([*head, *kept, *_limits(verdicts)[: 40 if room > 20_000 else 0], *tail])


def _outcome(code: int) -> str:
    names = {0: "passed", 1: "failed", 3: "could not measure", 4: "no comparable baseline", 5: "nothing was checked"}
    return names.get(code, str(code))


def _by_contestant(verdicts: Sequence[Verdict]) -> list[str]:
    columns = list(counts(()))
    lines = [f"| contestant | {' | '.join(columns)} |", f"|---{'|---:' * len(columns)}|"]
    for name in dict.fromkeys(verdict.contestant for verdict in verdicts):
        own = counts(verdict for verdict in verdicts if verdict.contestant == name)
        lines.append(f"| {_plain(name)} | {' | '.join(str(number) for number in own.values())} |")
    return lines


def _failures(findings: Sequence[Finding]) -> list[str]:
    return [
        f"\n### {_plain(finding.verdict.contestant)}: {finding.verdict.check}"
        f" ({finding.count} {'case' if finding.count == 1 else 'cases'})\n\n"
        f"{_plain(described(finding))}\n\n```\n{finding.shortest or finding.command}\n```"
        for finding in findings
    ]


def _limits(verdicts: Sequence[Verdict]) -> list[str]:
    used = limits_used(verdicts)
    if not used:
        return []
    return ["", "<details><summary>Passed by a limit that is not the derived one</summary>", "",
            *(f"- {_plain(line)}" for line in used), "", "</details>"]  # fmt: skip


def described(finding: Finding) -> str:
    """One failure in one line: case, law, numbers with unit, first time, bodies."""
    verdict = finding.verdict
    parts = [f"{verdict.case} at {verdict.step} s, law {verdict.law}: {told(verdict)}"]
    if math.isfinite(finding.time):
        parts.append(f"first at t = {finding.time:.4g} s")
    if finding.bodies:
        parts.append(f"bodies {', '.join(finding.bodies)}")
    return "; ".join(parts)


def _plain(text: str) -> str:
    """Text that Markdown leaves as it is: names of cases hold brackets, those of a user's own may hold anything."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>|#" else c for c in " ".join(text.split()))


def workflow_commands(verdicts: Sequence[Verdict], findings: Sequence[Finding]) -> list[str]:
    """Annotations: an error for each contestant and check, at most `MOST_ANNOTATIONS`, then one with all counts."""
    lines = [
        _annotation("error", f"{f.verdict.contestant}: {f.verdict.check}", f"{described(f)} ({f.count} in all)")
        for f in findings[:MOST_ANNOTATIONS]
    ]
    level = "error" if findings else "notice"
    more = len(findings) - MOST_ANNOTATIONS
    rest = f"; {more} more contestants and checks are not listed" if more > 0 else ""
    return [*lines, _annotation(level, "impactbench check", totals(verdicts) + rest)]


def _annotation(level: str, title: str, message: str) -> str:
    return f"::{level} title={_escaped(title, ',:')}::{_escaped(message)}"


def _escaped(text: str, more: str = "") -> str:
    return "".join(f"%{ord(c):02X}" if c in "%\r\n" + more else c for c in text)


def script(findings: Sequence[Finding]) -> str:
    """failures.sh: each failure as the shortest command that shows it. Exits 1 if one still fails."""
    lines = ["#!/bin/sh", "# Each command repeats one failure, as briefly as it can be shown.", "failed=0"]
    for finding in findings:
        lines += ["", f"# {' '.join(described(finding).split())}", f"{finding.shortest or finding.command} || failed=1"]
    return "\n".join([*lines, "", "exit $failed", ""])
