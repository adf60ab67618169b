"""A chart's specification as the static drawing and the compact data that a page holds."""

from __future__ import annotations

import functools
import re
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from xml.sax.saxutils import quoteattr

import vl_convert


@functools.cache
def drawer() -> ThreadPoolExecutor:
    """A thread that draws while the page is put together: the library draws without holding the interpreter."""
    return ThreadPoolExecutor(1, "drawer")


class Drawing:
    """The static drawing of a specification, begun at once and waited for where it goes into the page."""

    def __init__(self, spec: dict[str, Any], prefix: str) -> None:
        self._drawn = drawer().submit(svg_of, spec, prefix)

    def __html__(self) -> str:
        return self._drawn.result()


def svg_of(spec: dict[str, Any], prefix: str) -> str:
    """Static drawing of a specification whose ids clash with no other chart's on the page, without what only a script
    would use.
    """
    svg = str(vl_convert.vegalite_to_svg(spec))
    svg = re.sub(r'<path class="(?:background|foreground)"[^>]*?(?:display="none"|d="M0,0h0v0h0Z")[^>]*?/>', "", svg)
    svg = re.sub("<[^>]*>", lambda tag: slim(tag[0], prefix), svg)  # tags only: what stands between them is text
    described = f'<svg role="img" aria-label={quoteattr(str(spec.get("description", "chart")))}'
    return svg.replace("<svg", described, 1)


def slim(tag: str, prefix: str) -> str:
    """One tag with ids of its own, without attributes of no use here."""
    tag = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{re.escape(prefix)}-", tag)
    tag = re.sub(r' (?:aria-[a-z]+|role|pointer-events|font-family|class)="[^"]*"', "", tag)
    tag = tag.replace(' opacity="1"', "").replace(' stroke-width="1"', "")
    return re.sub(r"(\d\.\d)\d{2,}", r"\1", tag)  # a tenth of a pixel


def rounded(value: Any) -> Any:
    """The specification with six significant digits, which is far below a pixel."""
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: rounded(inner) for key, inner in value.items()}
    return [rounded(inner) for inner in value] if isinstance(value, list) else value
