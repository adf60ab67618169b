"""Verdicts as a JUnit file, the form that every CI service reads.

A suite is a cell, its test cases are the checks that say something about it. Figures and budgets are properties of the
suite: the common schema knows them there and not in a test case.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from impactbench.reports.gate import Finding
from impactbench.reports.verdict_text import figure
from impactbench.reports.verdicts import BASELINE, Verdict
from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

R = TypeVar("R", Failure, Error)
HOST = "impactbench"
"""A machine's name is nobody's business, but the schema asks for one."""


def junit(verdicts: Sequence[Verdict], findings: Iterable[Finding], provenance: Mapping[str, Any]) -> str:
    """The file's text. Checks that have no meaning in a case are left out, those that could not run are skipped."""
    commands = {id(finding.verdict): finding for finding in findings}
    suites: dict[tuple[str, ...], list[Verdict]] = {}
    cell: tuple[str, ...]
    for verdict in verdicts:
        if verdict.status != "excused":
            words = (verdict.contestant, verdict.case, verdict.step, str(verdict.law), verdict.model)
            cell = (*words, f"{verdict.phase:g}")
            suites.setdefault(cell, []).append(verdict)
    document = JUnitXml("impactbench check")
    for number, (cell, checks) in enumerate(suites.items()):
        document.append(_suite(number, cell, checks, commands, provenance))
    document.update_statistics()
    document._elem.attrib.pop("skipped", None)  # Jenkins' junit-10.xsd knows it in a suite only
    text: bytes = document.tostring()
    return text.decode("utf-8")


def _suite(
    number: int,
    cell: tuple[str, ...],
    verdicts: Sequence[Verdict],
    findings: Mapping[int, Finding],
    provenance: Mapping[str, Any],
) -> TestSuite:
    contestant, case, step, law, model, phase = cell
    suite = TestSuite(f"{contestant} {case} {step}")
    suite.timestamp = str(provenance["created"])[:19]
    suite.hostname = HOST
    suite._elem.set("id", str(number))
    suite._elem.set("package", contestant)
    engine = contestant.partition("/")[0]
    facts = {
        "law": law,
        "model": model,
        "phase": phase,
        "version": str(provenance["versions"].get(engine) or "unknown"),
    }
    for name, value in facts.items():
        suite.add_property(name, value)
    for verdict in verdicts:
        if math.isfinite(verdict.value):
            suite.add_property(f"{verdict.check} {verdict.measure}", f"{verdict.value:.9g}")
        if math.isfinite(verdict.budget):
            suite.add_property(f"{verdict.check} budget", f"{verdict.budget:.9g}")
        if verdict.limit and verdict.status == "passed":
            suite.add_property(f"{verdict.check} limit", verdict.limit)
        suite.add_testcase(_testcase(verdict, findings.get(id(verdict))))
    return suite


def _testcase(verdict: Verdict, finding: Finding | None) -> TestCase:
    testcase = TestCase(verdict.check, f"{verdict.contestant}.{verdict.case}", 0.0)
    message = told(verdict)
    details = message
    if finding is not None:
        first = f"first at t = {finding.time:.6g} s\n" if math.isfinite(finding.time) else ""
        details = f"{message}\n{first}{finding.shortest}"
    match verdict.status:
        case "failed":
            testcase.result = [_with_text(Failure(message, verdict.check), details)]
        case "error":
            testcase.result = [_with_text(Error(message, "could not be measured"), details)]
        case "unsupported" | "unavailable":
            testcase.result = [Skipped(message, verdict.status)]
    return testcase


def _with_text(result: R, text: str) -> R:
    result.text = text
    return result


def told(verdict: Verdict) -> str:
    """Figure and budget with their unit, or why there are none."""
    if not math.isfinite(verdict.value) or verdict.check == BASELINE:
        return verdict.reason
    return f"{verdict.measure} {figure(verdict.value, verdict.unit)}, budget {figure(verdict.budget, verdict.unit)}"
