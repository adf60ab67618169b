"""The benchmarks' figures as tables."""

from __future__ import annotations

from typing import Any

from impactbench.reports.terminal import table


def text_of(name: str, part: dict[str, Any]) -> str:
    """One benchmark: a heading, a table of its rows, and what is said of all of them."""
    rows = part["rows"]
    columns = list(dict.fromkeys(column for row in rows for column in row))
    cells = [[_cell(row.get(column, "")) for column in columns] for row in rows]
    rest = [f"{key}: {_cell(value)}" for key, value in part.items() if key not in ("rows", "what")]
    return f"\n{name}: {part['what']}\n{table(columns, cells)}\n{'; '.join(rest)}"


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
