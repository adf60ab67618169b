"""The hard set for readers: one row a case, one column a contestant, in the terminal and on the page."""

from __future__ import annotations

from collections import Counter
from typing import Any

KINDS = {"survived": "met", "failed": "missed"}


SHORT = {"survived": "ok", "unsupported": "-", "unavailable": "-"}


def short(cell: dict[str, Any]) -> str:
    """For the terminal: `ok`, the criterion that failed first and when, or the state."""
    if cell["state"] == "failed":
        return cell_text(cell, worst=False)
    return SHORT.get(cell["state"], str(cell["state"]))


def cell_text(cell: dict[str, Any], worst: bool = True) -> str:
    """`survived`, the first criterion that failed with its time, or the state."""
    if cell["state"] == "failed":
        first = min((v for v in cell["verdicts"] if v["time"] is not None), key=lambda v: v["time"])
        value = f"{first['worst']:.2g} at " if worst else ""
        return f"{first['criterion']} {value}{first['time']:.2g} s"
    return str(cell["state"])


def grid(document: dict[str, Any], family: str) -> tuple[list[str], list[dict[str, Any]]]:
    """Contestants of a family and its rows (case at step), each with a cell per contestant or None."""
    of_case = {case["name"]: case["family"] for case in document["cases"]}
    mine = [cell for cell in document["cells"] if of_case[cell["case"]] == family]
    names = list(dict.fromkeys(cell["contestant"] for cell in mine))
    order = {case["name"]: number for number, case in enumerate(document["cases"])}
    keys = sorted(dict.fromkeys((order[c["case"]], c["case"], c["step"]) for c in mine), key=lambda k: k[0])
    several = len({step for _, _, step in keys}) > 1
    found = {(cell["case"], cell["step"], cell["contestant"]): cell for cell in mine}
    rows = [
        {"case": case, "step": step if several else "", "cells": [found.get((case, step, name)) for name in names]}
        for _, case, step in keys
    ]
    return names, rows


def counts(document: dict[str, Any]) -> list[tuple[str, Counter[str]]]:
    """Cells by state of each contestant."""
    states: dict[str, Counter[str]] = {}
    for cell in document["cells"]:
        states.setdefault(cell["contestant"], Counter())[cell["state"]] += 1
    return list(states.items())


NOTE = """\
ok: survived; a criterion and a time: failed first by it, from then on; -: not run or unsupported (reasons: hard.json).
After the listed contestants come policies: settings meant to mend what breaks in that family."""


def terminal_table(document: dict[str, Any]) -> str:
    """A table a family, failures in words, and a line a contestant at the end."""
    from impactbench.reports.terminal import table

    parts = []
    for family in document["families"]:
        names, rows = grid(document, family["name"])
        heads = [name.replace("/", "/\n") for name in names]
        shown = [
            [
                row["case"] + (f" {row['step']}" if row["step"] else ""),
                *(short(c) if c else "-" for c in row["cells"]),
            ]
            for row in rows
        ]
        parts.append(table([family["name"], *heads], shown))
    totals = [
        [name, str(states["survived"]), str(states["failed"]), others(states)] for name, states in counts(document)
    ]
    parts.append(table(["contestant", "survived", "failed", "other"], totals))
    return "\n\n".join([NOTE, *parts])


def others(states: Counter[str]) -> str:
    return ", ".join(f"{n} {state}" for state, n in states.items() if state not in KINDS) or "-"


def view(document: dict[str, Any]) -> dict[str, Any]:
    """What `hard.html` shows."""
    families = []
    for family in document["families"]:
        names, rows = grid(document, family["name"])
        for row in rows:
            row["cells"] = [_shown(cell) for cell in row["cells"]]
        reasons = [
            {
                "contestant": c["contestant"],
                "case": c["case"],
                "step": c["step"],
                "state": c["state"],
                "why": c["reason"],
            }
            for c in document["cells"]
            if c["case"].partition("[")[0] == family["name"] and c["state"] not in ("survived",)
        ]
        families.append({**family, "names": names, "rows": rows, "reasons": reasons})
    totals = [
        {"name": n, "survived": s["survived"], "failed": s["failed"], "others": others(s)} for n, s in counts(document)
    ]
    return {"families": families, "totals": totals, "provenance": document["provenance"]}


def _shown(cell: dict[str, Any] | None) -> dict[str, str]:
    if cell is None:
        return {"text": "–", "kind": "none", "title": ""}
    return {"text": cell_text(cell), "kind": KINDS.get(cell["state"], "state"), "title": cell["outcome"]}
