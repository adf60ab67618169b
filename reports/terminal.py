"""What the command line prints: short tables, drawn by rich into plain text."""

from __future__ import annotations

import io
import shutil
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from impactbench.adapters import contestants, policies
from impactbench.scenarios.catalogue import FAMILIES
from impactbench.scenarios.hard import HARD
from rich.console import Console
from rich.table import Table


def _text(table: Table) -> str:
    stream = io.StringIO()
    width = max(shutil.get_terminal_size((150, 24)).columns, 80)
    Console(file=stream, width=width, no_color=True, highlight=False).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


def table(columns: Iterable[str], rows: Iterable[Sequence[str]], right: int = 99) -> str:
    """Columns from number `right` on hold figures and are set flush right."""
    table = Table(box=None, pad_edge=False)
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number >= right else "left", overflow="fold", no_wrap=number == 0)
    for row in rows:
        table.add_row(*(_escape(cell) for cell in row))
    return _text(table)


def _escape(text: str) -> str:
    from rich.markup import escape

    return escape(plain(text))


def plain(text: str) -> str:
    """One line that a terminal shows as text: no control sequence; marks that keep a name's direction to it stay."""
    return "".join(c if c.isprintable() or c in "\u2068\u2069" else "?" for c in text)


def summary(document: dict[str, Any]) -> str:
    """A line per contestant: cells by state, and the worst headline error and conservation at the finest step."""
    headline = {case["name"]: case["headline"] for case in document["cases"]}
    cells = document["cells"]
    states: dict[str, Counter[str]] = {}
    for cell in cells:
        states.setdefault(cell["contestant"], Counter())[cell["state"]] += 1
    finest = min((cell["step"] for cell in cells if cell["step"]), default=None)
    worst: dict[tuple[str, str], tuple[float, str]] = {}
    for row in document["rows"]:
        cell = cells[row["cell"]]
        kind = "error" if row["measure"] == headline[cell["case"]] else row["measure"]
        if cell["step"] in (finest, None) and kind in ("error", "energy_gain", "momentum_drift"):
            key = (cell["contestant"], kind)
            worst[key] = max(worst.get(key, (-1.0, "")), (abs(row["value"]), cell["case"]))
    rows = []
    for name, counts in states.items():
        others = ", ".join(f"{count} {state}" for state, count in counts.items() if state != "ok") or "-"
        figures = [worst.get((name, kind)) for kind in ("error", "energy_gain", "momentum_drift")]
        shown = [f"{figure[0]:.2g}" if figure else "-" for figure in figures]
        rows.append([name, str(counts["ok"]), others, *shown, figures[0][1] if figures[0] else "-"])
    columns = ["contestant", "ok", "other cells", "worst error", "energy gain", "momentum", "worst error in"]
    return table(columns, rows)


def cell_table(document: dict[str, Any]) -> str:
    """One cell: what it was, what was set, and every measure."""
    cell = document["cells"][0]
    head = "{case}  {contestant}  law {law}  model {model}  step {step_text} s: {state}".format(**cell)
    if cell["reason"]:
        head += f" ({cell['reason']})"
    rows = [[r["measure"], f"{r['value']:.6g}", "" if r["unit"] == "1" else r["unit"]] for r in document["rows"]]
    settings = [[name, str(value)] for name, value in cell["settings"].items()]
    parts = [head]
    if rows:
        parts.append(table(["measure", "value", "unit"], rows, right=1))
    if settings:
        parts.append(table(["set", "to"], settings))
    return "\n\n".join(parts)


def scenario_table() -> str:
    rows = []
    for family in FAMILIES.values():
        cases = family.cases()
        kinds = {truth.kind for case in cases for truth in case.truths.values()}
        laws = [law for law in ("doc", "nc") if any(law in case.truths for case in cases)]
        kind = ", ".join(sorted(kinds))
        rows.append([family.name, str(len(cases)), " ".join(laws), kind, family.needs, family.question])
    return table(["scenario", "cases", "laws", "truth", "needs", "question"], rows)


def hard_table() -> str:
    """The hard families, which take part only when named."""
    rows = []
    for family in HARD.values():
        knob = family.knob.parameter if family.knob else "-"
        rows.append([family.name, str(len(family.values)), str(len(family.full)), knob, family.needs, family.question])
    columns = ["hard scenario", "cases", "with --full", "breaking point", "needs", "question"]
    return table(columns, rows) + "\n"


def engine_table() -> str:
    """Contestants, policies that take part when named, and the settings that make further ones."""
    rows = []
    for contestant in (*contestants.CONTESTANTS, *contestants.POLICIES):
        here = contestant.availability() or "available"
        by_name = here if contestant in contestants.CONTESTANTS else f"{here}, by name"
        rows.append([contestant.name, contestant.version() or "-", by_name, policies.SOURCES[contestant.name]])
    rows += [[own.name, own.version() or "-", contestants.HINT, "-"] for own in contestants.installed()]
    settings = [[e, s.name, s.allowed, s.source] for e, all_of in policies.SETTINGS.items() for s in all_of]
    return (
        table(["contestant", "version", "here", "source"], rows)
        + "\n\nSettings for further policies, as in --engine mujoco/tuned:iterations=20,cone=pyramidal\n\n"
        + table(["engine", "setting", "takes", "source"], settings)
    )


def pair_law_table(laws: Iterable[Sequence[str]]) -> str:
    return table(["engine", "restitution of two balls", "of a ball and a wall", "friction of block and plane"], laws)
