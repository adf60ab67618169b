"""Text and tables in GitHub's Markdown, with names that stay text whatever they hold."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from impactbench.reports.page_data import isolated


def escape(text: str) -> str:
    """The text itself: no markup, no line break, no change of direction beyond it."""
    line = "".join(character if character.isprintable() or ord(character) > 0x1FFF else " " for character in text)
    line = line.replace("\u2028", " ").replace("\u2029", " ")
    line = re.sub(r"([\\`*_\[\]|~#$@])", r"\\\1", line)
    return line.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace("://", ":&#47;&#47;")


def code(text: str) -> str:
    """A code span; one line, with a fence longer than any run of backticks inside."""
    line = " ".join(text.split())
    fence = "`" * (1 + max((len(run) for run in re.findall(r"`+", line)), default=0))
    pad = " " if line.startswith("`") or line.endswith("`") else ""
    return f"{fence}{pad}{line}{pad}{fence}"


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain texts."""
    lines = [columns, ["---"] * len(columns), *([escape(isolated(str(cell))) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
