"""Sections of the report that commands of their own measure: hard cases, breaking points, metamorphic relations, ...

Such a command writes its part to OUT/<key>.json. Whoever writes OUT/results.json takes along the parts found there
under "sections", so that the page holds nothing that is not in results.json.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from impactbench.reports import results

SECTIONS: dict[str, tuple[str, str]] = {
    "hard": ("hard.html", "impactbench.reports.hard_view:view"),
    "limits": ("limits.html", "impactbench.reports.limits_view:view"),
    "metamorphic": ("metamorphic.html", "impactbench.reports.metamorphic:view"),
    "predictability": ("predictability.html", "impactbench.reports.predictability_view:view"),
}
"""Key -> (template, "module:function" that turns the part into the template's values), in the page's order."""


COMMANDS = {
    "hard": "hard cases: impactbench hard",
    "limits": "breaking points: impactbench limits",
    "metamorphic": "metamorphic relations: impactbench metamorphic",
    "predictability": "how far motion can be predicted: impactbench predictability",
}
"""Key -> what a part would show and the command that measures it into the same folder."""


def absent(document: dict[str, Any]) -> list[str]:
    """What this page does not hold since nobody asked for it, and how to have it."""
    missing = [told for key, told in COMMANDS.items() if key not in document.get("sections", {})]
    if not any(cell["model"] == "full" for cell in document["cells"]):
        missing.append("what the smallest model saves: impactbench compare --model both")
    return [f"Not measured for this page: {'; '.join(missing)}."] if missing else []


def attach(folder: Path, key: str, part: dict[str, Any]) -> None:
    """Write OUT/<key>.json; where results.json stands beside it, write that and the report again.

    Raises OSError or ResultsError.
    """
    from impactbench.reports import page

    results.save(part, folder / f"{key}.json")
    if (folder / "results.json").exists():
        document = with_sections(results.read(folder / "results.json"), folder)
        results.save(document, folder / "results.json")
        page.write_page(document, folder / "report.html")


def with_sections(document: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The document with the parts that stand beside it."""
    parts = {key: results.load_json(folder / f"{key}.json") for key in SECTIONS if (folder / f"{key}.json").exists()}
    return {**document, "sections": {**document.get("sections", {}), **parts}}


def views(document: dict[str, Any]) -> list[dict[str, Any]]:
    """What the page shows: one entry a part, with its key, template and values."""
    found = []
    for key, part in document.get("sections", {}).items():
        if key in SECTIONS:
            template, place = SECTIONS[key]
            module, _, function = place.partition(":")
            view = getattr(importlib.import_module(module), function)
            found.append({"key": key, "template": template, "view": view(part)})
    return found
