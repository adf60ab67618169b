"""The differences of two results as sentences, Markdown, terminal text and JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from impactbench.reports.diff import BETTER, MARKS, SAME, UNKNOWN, WORSE, Change, Diff
from impactbench.reports.markdown import escape, table
from impactbench.reports.page_data import amount, counted, isolated, words

LISTED = 40  # changes of one kind that a text lists; the page and the JSON hold more


def verdict(diff: Diff) -> list[dict[str, str]]:
    """Lines for the first screen, each with a mark, its word and a sentence."""
    counts = diff.counts()
    kinds = {WORSE: "bad", BETTER: "good", UNKNOWN: "take", SAME: "take"}
    texts = {
        WORSE: _largest(diff, WORSE),
        BETTER: _largest(diff, BETTER),
        UNKNOWN: "; ".join(f"{why}: {count}" for why, count in list(diff.reasons().items())[:3]),
        SAME: "",
    }
    found = []
    for word, mark in MARKS.items():
        number = counted(counts[word], "figure")
        text = f"{number}{': ' if texts[word] else ''}{texts[word]}."
        found.append({"kind": kinds[word] if counts[word] else "take", "mark": mark, "word": word.capitalize()})
        found[-1]["text"] = text if counts[word] else "nothing."
    if ranked := str(diff.rankings):
        found.append({"kind": "take", "mark": "↕", "word": "Rankings", "text": ranked + "."})
    return found


def turned(diff: Diff) -> list[str]:
    """The pairs of policies whose order changed, as many as a text lists."""
    return [str(pair) for pair in diff.rankings.turned[:LISTED]]


def _largest(diff: Diff, verdict: str) -> str:
    found = diff.of(verdict)
    return f"most {sentence(found[0])}" if found else ""


def sentence(change: Change) -> str:
    """One change: who, what, where, from and to."""
    where = f"{isolated(change.policy)} in {isolated(change.case)}"
    if change.before is None or change.after is None:
        return f"{where}: {change.why}"
    old, new = (figure(value, change.unit) for value in (change.before, change.after))
    at = f" at {change.step} s" if "/" in change.step else ""
    return f"{where}: {words(change.measure)} {old} → {new}{at}"


def figure(value: float | None, unit: str) -> str:
    """A figure with its unit; a dash where there is none."""
    if value is None:
        return "–"
    return f"{1e3 * value:.3g} ms/s" if unit == "s/s" else amount(value, unit)


def row(change: Change) -> list[str]:
    """A change as cells of a table."""
    figures = [figure(value, change.unit) for value in (change.before, change.after)]
    word = f"{MARKS[change.verdict]} {change.verdict}"
    return [word, change.case, change.policy, words(change.measure), *figures, change.step, change.why]


COLUMNS = ["verdict", "case", "policy", "measure", "before", "after", "step [s]", "note"]


def markdown(diff: Diff) -> str:
    """Summary for a pull request or a CI step."""
    parts = ["# impactbench: before and after", _runs(diff)]
    parts.append("\n".join(f"- {line['mark']} **{line['word']}**: {escape(line['text'])}" for line in verdict(diff)))
    if diff.notes:
        parts.append("\n".join(f"- {escape(note)}" for note in diff.notes))
    if diff.rankings.turned:
        parts += ["## Changed order", "\n".join(f"- {escape(pair)}" for pair in turned(diff))]
    for kind in (WORSE, BETTER):
        found = diff.of(kind)
        if found:
            parts += [f"## {kind.capitalize()}", table(COLUMNS, [row(change) for change in found[:LISTED]])]
        if len(found) > LISTED:
            parts.append(f"… and {len(found) - LISTED} more.")
    return "\n\n".join(parts) + "\n"


def _runs(diff: Diff) -> str:
    made = [document["provenance"].get("created", "") for document in (diff.before, diff.after)]
    return f"Before: {escape(str(made[0]))}. After: {escape(str(made[1]))}."


def terminal(diff: Diff) -> str:
    """Summary for a terminal."""
    from impactbench.reports.terminal import plain
    from impactbench.reports.terminal import table as aligned

    lines = [plain(f"{line['mark']} {line['word']}: {line['text']}") for line in verdict(diff)]
    lines += [plain(f"  {note}") for note in (*diff.notes, *turned(diff))]
    found = [*diff.of(WORSE), *diff.of(BETTER)]
    if found:
        lines += ["", aligned(COLUMNS, [row(change) for change in found[:LISTED]])]
    if len(found) > LISTED:
        lines.append(f"... and {len(found) - LISTED} more: the page lists them")
    return "\n".join(lines)


def as_json(diff: Diff) -> dict[str, Any]:
    """Everything, for a program."""
    return {
        "before": diff.before["provenance"],
        "after": diff.after["provenance"],
        "counts": diff.counts(),
        "notes": diff.notes,
        "changes": [asdict(change) for change in diff.changes],
        "rankings": asdict(diff.rankings),
    }
