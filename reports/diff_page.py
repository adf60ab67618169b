"""Before and after as one HTML file in the report's layout; it needs no script."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from impactbench.reports import charts, diff_text, page, results
from impactbench.reports.chart_svg import svg_of
from impactbench.reports.diff import BETTER, MARKS, SAME, UNKNOWN, WORSE, Change, Diff
from impactbench.reports.page_data import Rung, words
from impactbench.reports.page_view import View

ROWS = 1000  # changes a table holds, some 300 bytes each
POLICIES = 4  # in the chart, each twice


def write_page(diff: Diff, path: Path | str) -> None:
    """Write the page; a reader of `path` sees the old one or the new one, never half of it."""
    results.write_text(Path(path), render(diff))


def render(diff: Diff) -> str:
    """The page of two results documents."""
    changed = [*diff.of(WORSE), *diff.of(BETTER)]
    return (
        page.environment()
        .get_template("diff.html")
        .render(
            verdict=diff_text.verdict(diff),
            notes=[*diff.notes, *diff_text.turned(diff)],
            runs=[("before", diff.before["provenance"]), ("after", diff.after["provenance"])],
            chart=chart(diff),
            policies=list(dict.fromkeys(change.policy for change in diff.changes)),
            grid=grid(diff),
            columns=diff_text.COLUMNS,
            rows=[diff_text.row(change) for change in changed[:ROWS]],
            left_out=max(0, len(changed) - ROWS),
            reasons=diff.reasons(),
            marks=MARKS,
        )
    )


def grid(diff: Diff) -> list[dict[str, Any]]:
    """Cases against policies; each cell says its worst verdict over all measures and how many measures have it."""
    policies = list(dict.fromkeys(change.policy for change in diff.changes))
    found: dict[str, dict[str, list[Change]]] = {}
    for change in diff.changes:
        found.setdefault(change.case, {}).setdefault(change.policy, []).append(change)
    rows = [
        {"case": case, "cells": [_cell(cells.get(policy, [])) for policy in policies]} for case, cells in found.items()
    ]
    return sorted(rows, key=lambda row: -sum(cell["kind"] == "missed" for cell in row["cells"]))


def _cell(changes: list[Change]) -> dict[str, str]:
    if not changes:
        return {"kind": "none", "text": "–"}
    verdicts = [change.verdict for change in changes]
    verdict = next(v for v in (WORSE, BETTER, SAME, UNKNOWN) if v in verdicts)
    kind = {WORSE: "missed", BETTER: "met"}.get(verdict, "state")
    both = f", {verdicts.count(BETTER)} better" if verdict == WORSE and BETTER in verdicts else ""
    count = f" ({verdicts.count(verdict)}{both})" if verdict in (WORSE, BETTER) else ""
    return {"kind": kind, "text": f"{MARKS[verdict]} {verdict}{count}"}


def chart(diff: Diff) -> dict[str, Any] | None:
    """Speed against error before and after, in the case and for the policies that changed most."""
    views = View(diff.before), View(diff.after)
    case = _case(diff, views)
    if case is None:
        return None
    order = [change.policy for change in diff.changes if change.case == case and change.verdict in (WORSE, BETTER)]
    wanted = list(dict.fromkeys([*order, *(change.policy for change in diff.changes if change.case == case)]))[
        :POLICIES
    ]
    points: list[Rung] = []
    for view, when in zip(views, ("before", "after"), strict=True):
        profile = "default" if when == "before" else "other"
        found = [point for point in view.points(case) if point["policy"] in wanted]
        points += [{**point, "policy": f"{point['policy']} · {when}", "profile": profile} for point in found]
    timings = {point["timed"] for point in points}
    if len(timings) != 1:
        return None
    described = views[1].cases[case]
    style = charts.Style(*(tuple(dict.fromkeys(point[key] for point in points)) for key in ("engine", "policy")))
    timed = "wall time per simulated second [ms]" if timings == {True} else "steps per simulated second (not timed)"
    titles = (words(described["headline"]), timed)
    spec = charts.work_precision(points, [], style, titles)
    spec["description"] = f"{titles[1]} against {titles[0]}, before and after"
    return {"case": case, "svg": svg_of(spec, "chart")}


def _case(diff: Diff, views: tuple[View, View]) -> str | None:
    """The first case with a change in its headline or its times that both runs can draw, else the featured one."""
    shared = set(views[0].drawable()["case"]) & set(views[1].drawable()["case"])
    for change in diff.changes:
        if change.verdict not in (WORSE, BETTER) or change.case not in shared:
            continue
        if change.measure in ("wall_time", views[1].cases[change.case]["headline"]):
            return change.case
    return views[1].featured if views[1].featured in shared else None
