"""Breaking points as tables: for the terminal and for the page."""

from __future__ import annotations

from typing import Any

NOTE = """\
The value up to which every run satisfies its truth; the next that was tried, within {precision:.0%} (whole numbers: one
more), does not. >=: the whole range survives. <: the mildest value does not. ~: not monotone, values beyond survive
again. *: runs took too long, the bracket is wider. -: unsupported. With a truth, nearer to it is better."""


def text(part: dict[str, Any]) -> str:
    from impactbench.reports.terminal import table

    shown = view(part)
    names = ["hard family", "knob", "truth", *(name.replace("/", " ") for name in part["contestants"])]
    rows = [[row["name"], row["knob"], row["truth"], *(cell["text"] for cell in row["cells"])] for row in shown["rows"]]
    parts = [table(names, rows, right=2), NOTE.format(precision=part["precision"])]
    if shown["mended"]:
        head = ["hard family", "settings", "default", "tuned", "with these settings"]
        lines = [[m["family"], m["policy"], m["default"], m["tuned"], m["point"]] for m in shown["mended"]]
        parts.append("Settings meant to mend it:\n" + table(head, lines, right=2))
    if shown["odd"]:
        head = ["hard family", "contestant", "first lost at", "why", "survives again at"]
        odd = [[o["family"], o["contestant"], o["fails"], o["why"], o["beyond"]] for o in shown["odd"]]
        parts.append("Not monotone:\n" + table(head, odd))
    return "\n\n".join(parts)


def view(part: dict[str, Any]) -> dict[str, Any]:
    """What the page shows."""
    found = {(s["family"], s["contestant"]): s for s in part["searches"]}
    rows = []
    for family in part["families"]:
        fixed = ", ".join(f"{key} {value}" for key, value in family["fixed"].items())
        rows.append(
            {
                "name": family["name"],
                "question": family["question"],
                "knob": family["parameter"] + (f" ({fixed})" if fixed else ""),
                "truth": "-" if family["truth"] is None else figure(family["truth"], family),
                "cells": [_cell(found.get((family["name"], name)), family) for name in part["contestants"]],
                "criteria": family["criteria"],
            }
        )
    kinds = {family["name"]: family for family in part["families"]}
    odd = [
        {
            "family": s["family"],
            "contestant": s["contestant"],
            "fails": figure(s["fails"], kinds[s["family"]]),
            "why": why(s),
            "beyond": ", ".join(figure(value, kinds[s["family"]]) for value in s["survivors_beyond"]),
        }
        for s in part["searches"]
        if not s["monotone"]
    ]
    return {
        "contestants": part["contestants"],
        "rows": rows,
        "odd": odd,
        "mended": mended(part, found),
        "precision": part["precision"],
    }


def mended(part: dict[str, Any], found: dict[tuple[str, str], dict[str, Any]]) -> list[dict[str, str]]:
    """Breaking points with a family's own settings, beside those of the same engine's profiles."""
    rows = []
    for family in part["families"]:
        name = family["name"]
        for where, policy in found:
            if where == name and policy not in part["contestants"]:
                engine = policy.partition("/")[0]
                named = {"default": f"{engine}/default", "tuned": f"{engine}/tuned", "point": policy}
                points = {key: _cell(found.get((name, who)), family)["text"] for key, who in named.items()}
                rows.append({"family": name, "policy": policy, **points})
    return rows


def _cell(search: dict[str, Any] | None, family: dict[str, Any]) -> dict[str, str]:
    if search is None or search["status"] == "unknown":
        return {"text": "-", "title": search["reason"] if search else "no step"}
    shown = figure(search["survives"] if search["survives"] is not None else search["fails"], family)
    more, less = (">=", "<") if family["breaks"] == "above" else ("<=", ">")
    mark = {"at least": f"{more} ", "below": f"{less} ", "found": ""}[search["status"]]
    mark += shown + ("~" if not search["monotone"] else "") + ("*" if search["stopped"] else "")
    if search["fails"] is None:
        title = search["reason"]
    else:
        title = f"fails at {figure(search['fails'], family)}: {why(search)}"
    return {"text": mark, "title": title}


def why(search: dict[str, Any]) -> str:
    """What broke first, and when."""
    if search["state"] != "failed":
        return f"{search['state']} ({search['reason']})" if search["reason"] else str(search["state"])
    return f"{search['reason']}, after {search['time_to_failure']:.3g} s"


def figure(value: float, family: dict[str, Any]) -> str:
    if family["kind"] == "int":
        return str(round(value))
    if family["parameter"] == "step":
        return f"1/{1 / value:.4g} s"
    return f"{value:.4g}"
