"""The report as one HTML file that works from disk with the network off.

Verdict, tables and drawn charts stand in the HTML itself; a script that comes with the page only adds to them.
A rung is one (case, policy, step); its error is that of the worst impact phase.
"""

from __future__ import annotations

import base64
import contextlib
import functools
import importlib.metadata
import json
import re
import zlib
from pathlib import Path
from typing import Any

import jinja2
import vl_convert
from impactbench.reports import results, sections
from impactbench.reports.chart_svg import drawer
from impactbench.reports.page_data import number, percent, words
from impactbench.reports.page_family import MAX_CHARTS
from impactbench.reports.page_view import View
from markupsafe import Markup, escape

BUDGET = 3_000_000  # bytes of the whole page
KEPT = Path(__file__).parent / "__pycache__"


def write_page(document: dict[str, Any], path: Path | str) -> None:
    """Write the report; a reader of `path` sees the old page or the new one, never half of it."""
    results.write_text(Path(path), render(document))


def render(document: dict[str, Any]) -> str:
    """The page of one results document, embedding as much of its data as fits the budget; where none does, with fewer
    charts, and at last without the tables that only charts need.
    """
    script = drawer().submit(bundle)
    template = environment().get_template("page.html")
    extra, left = sections.views(document), sections.absent(document)
    for part in (1, 2, 4, MAX_CHARTS):
        view = View(document, MAX_CHARTS // part)
        content = {**view.content(), "extra": extra}
        for note, data in view.embeddable():
            thinned = [*view.thinned, *note, *left]
            page = template.render(**content, thinned=thinned, data=data, bundle=script.result())
            if len(page.encode()) <= BUDGET:
                return page
    return page


@functools.cache
def bundle() -> str:
    """Vega, Vega-Lite and Vega-Embed from the installed vl-convert as one script, deflated, in base64.

    Kept where compiled Python is, since making it takes as long as drawing half of the charts.
    """
    kept = KEPT / f"vega-{importlib.metadata.version('vl-convert-python')}.txt"
    with contextlib.suppress(OSError, ValueError, zlib.error):
        packed = kept.read_text("ascii")
        zlib.decompress(base64.b64decode(packed, validate=True))  # whole, or made again
        return packed
    script = str(vl_convert.javascript_bundle("window.vegaLibrary = vegaEmbed;"))
    packed = base64.b64encode(zlib.compress(script.encode(), 9)).decode()
    with contextlib.suppress(OSError):  # an installation nobody may write to
        KEPT.mkdir(exist_ok=True)
        results.write_text(kept, packed)
    return packed


def environment() -> jinja2.Environment:
    """Templates with escaping on for every value."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    found = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    found.filters.update(
        number=number, percent=percent, safe_json=safe_json, breakable=breakable, words=words, svg=Markup
    )
    found.globals["script"] = lambda name: Markup(
        (Path(__file__).parent / "templates" / name).read_text(encoding="utf-8")
    )
    found.trim_blocks = found.lstrip_blocks = True
    return found


def breakable(name: str) -> Markup:
    """Name that may be wrapped where its parts meet."""
    return Markup(re.sub(r"([\[/,])", r"\1<wbr>", str(escape(name))))


def safe_json(value: Any) -> Markup:
    """JSON for the inside of a script element: no character is left that could close it or open a comment."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)
