"""The report's summary without a browser: the same verdict and numbers as Markdown and as terminal text."""

from __future__ import annotations

from typing import Any

from impactbench.reports import page_failures, page_verdict
from impactbench.reports.markdown import code, escape, table
from impactbench.reports.page_data import TARGET, number, percent, time_to
from impactbench.reports.page_scores import score
from impactbench.reports.page_view import View
from impactbench.reports.terminal import plain

LISTED = 12  # failures a summary lists


def verdict_lines(document: dict[str, Any]) -> list[str]:
    """Coverage and verdict as lines for a terminal."""
    view = View(document)
    lines = [f"{line['mark']} {line['word']} {line['text']}" for line in page_verdict.verdict(view)]
    return [plain(line) for line in (page_verdict.coverage(view), *lines)]


def markdown(document: dict[str, Any]) -> str:
    """Verdict, time to the target by contestant and case, and the worst failures."""
    view = View(document)
    parts = ["# impactbench", escape(page_verdict.coverage(view))]
    lines = [f"- {line['mark']} **{line['word']}** {escape(line['text'])}" for line in page_verdict.verdict(view)]
    parts += ["\n".join(lines), f"## Time to {percent(TARGET)} error", escape(_legend(view))]
    parts.append(table(*_grid(view)))
    cards = page_failures.cards(view)
    if cards:
        columns = ["contestant", "law", "numbers", "case", "step [s]"]
        rows = [[c["policy"], c["law"], c["numbers"], c["case"], c["step"]] for c in cards[:LISTED]]
        parts += ["## Failures", table(columns, rows)]
        more = f" The {len(cards) - LISTED} others are in the report." if len(cards) > LISTED else ""
        again = next((c["command"] for c in cards if c["command"]), "")
        parts.append((f"The first of them again: {code(again)}." if again else "") + more)
    return "\n\n".join(part for part in parts if part) + "\n"


def _timed(view: View) -> list[str]:
    return [name for name in view.cases if any(rung["timed"] for line in view.of(name).values() for rung in line)]


def _legend(view: View) -> str:
    if not _timed(view):
        return "Nothing was timed; the cases each contestant brings below the target on its ladder of steps."
    return (
        "Milliseconds per simulated second (95 % interval of the median) at the cheapest step that stays below it, as "
        "does every finer one."
    )


def _grid(view: View) -> tuple[list[str], list[list[str]]]:
    timed = _timed(view)
    rows = []
    for policy in view.policies:
        reached = sum(time_to(view.lines[name, policy], TARGET) is not None for name in _known(view, policy))
        cells = [_with_interval(view, name, policy) for name in timed]
        rows.append([policy, *cells, f"{reached} of {len(view.cases)}"])
    return ["contestant", *map(escape, timed), f"cases below {percent(TARGET)}"], rows


def _with_interval(view: View, case: str, policy: str) -> str:
    """The scoreboard's word, and the 95 % interval of the median where a time stands."""
    line = view.lines.get((case, policy))
    rung = None if line is None else time_to(line, TARGET)
    word = str(score(view, case, policy)["text"])
    if rung is None or not rung["timed"] or not rung["high"] > 0:
        return word
    return f"{word} ({number(rung['low'])} to {number(rung['high'])})"


def _known(view: View, policy: str) -> list[str]:
    return [name for name in view.cases if (name, policy) in view.lines]
