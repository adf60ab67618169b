"""What a results document must hold for the programs that read it, and what is wrong with one that does not."""

from __future__ import annotations

import math
from typing import Any

NUMBER = (int, float)
NONE = type(None)
PROVENANCE: dict[str, tuple[type, ...]] = {
    **dict.fromkeys(("created", "command", "impactbench", "python", "platform", "processor"), (str,)),
    **{"cores": NUMBER, "load": NUMBER, "versions": (dict,), "notes": (list,)},
}
LISTS: dict[str, dict[str, tuple[type, ...]]] = {
    "cases": {
        **dict.fromkeys(("name", "family", "question", "headline"), (str,)),
        **dict.fromkeys(("duration", "length", "speed", "energy"), NUMBER),
        **{"laws": (list,), "truth": (dict,), "parameters": (dict,), "model": (dict,)},
    },
    "cells": {
        **dict.fromkeys(("case", "family", "law", "contestant", "model", "step_text", "state", "reason"), (str,)),
        **{"step": (*NUMBER, NONE), "phase": NUMBER, "version": (str, NONE), "settings": (dict,)},
    },
    "rows": {"cell": (int,), "measure": (str,), "value": NUMBER, "unit": (str,)},
    "law_difference": {"case": (str,), "measure": (str,), "value": NUMBER, "unit": (str,)},
}


def damage(document: dict[str, Any]) -> str:
    """The first thing that is missing or of the wrong kind; empty where nothing is."""
    if wrong := _entry("provenance", document.get("provenance"), PROVENANCE):
        return wrong
    for name, keys in LISTS.items():
        entries = document.get(name)
        if not isinstance(entries, list):
            return f"no list of {name}"
        for number, entry in enumerate(entries):
            if wrong := _entry(f"{name}[{number}]", entry, keys):
                return wrong
    if not isinstance(document.get("sections", {}), dict):
        return "sections is no table"
    cases, cells = {case["name"] for case in document["cases"]}, len(document["cells"])
    for number, cell in enumerate(document["cells"]):
        if cell["case"] not in cases:
            return f"cells[{number}] is of a case that is not listed"
    for number, row in enumerate(document["rows"]):
        if not 0 <= row["cell"] < cells:
            return f"rows[{number}] belongs to no cell"
    return ""


def _entry(where: str, entry: object, keys: dict[str, tuple[type, ...]]) -> str:
    if not isinstance(entry, dict):
        return f"no {where}" if entry is None else f"{where} is no table"
    for key, kinds in keys.items():
        if key not in entry:
            return f"{where} has no {key}"
        value = entry[key]
        if isinstance(value, bool) or not isinstance(value, kinds):
            return f"{where} has a {key} of the wrong kind"
        if isinstance(value, float) and not math.isfinite(value):  # 1e999 is JSON
            return f"{where} has a {key} that is not finite"
    return ""
