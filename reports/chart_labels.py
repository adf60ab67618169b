"""Where the labels of a chart go: beside their points, clear of one another and, if it can be had, of the curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

Box = tuple[float, float, float, float]  # left, top, right, bottom in pixels
Segment = tuple[float, float, float, float]  # from x, y to x, y
Wanted = tuple[float, float, str]  # x and y of what is named, and its name
LINE = 13  # height of a label in pixels
LETTER = 6.1  # width of an average letter of a label
SMALL = 5.4  # the same where the font is a point or two smaller


def place(
    wanted: Iterable[Wanted],
    taken: Sequence[Box],
    lines: Sequence[Segment],
    inside: Box,
    gap: float = 9,
    letter: float = LETTER,
) -> list[Box]:
    """Box of every label, right or left of what it names: never over what is `taken` or another label if that can be
    helped, and rather two lines further away than across a curve.
    """
    boxes: list[Box] = []
    for x, y, text in wanted:
        width = letter * len(text)
        best, box = math.inf, (x + gap, y - LINE / 2, x + gap + width, y + LINE / 2)
        for step in range(24):
            top = y + (step + 1) // 2 * LINE * (-1 if step % 2 else 1) - LINE / 2
            for left in (x + gap, x - gap - width):
                option = (left, top, left + width, top + LINE)
                away = abs(top + LINE / 2 - y) / LINE + 100 * outside(option, inside)
                if away >= best:  # whatever it lies over
                    continue
                hits = sum(overlap(option, other) for other in (*taken, *boxes))
                crossed = sum(crosses(line, option) for line in lines)
                cost = away + 2 * min(crossed, 2) + 30 * hits
                if cost < best:
                    best, box = cost, option
        boxes.append(box)
    return boxes


def fit(wanted: Iterable[Wanted], taken: Sequence[Box], lines: Sequence[Segment], inside: Box) -> list[Box | None]:
    """Box of every small label that has room close to its point, right, left, below or above; None for the others."""
    boxes: list[Box] = []
    found: list[Box | None] = []
    for x, y, text in wanted:
        width, middle = SMALL * len(text), y - LINE / 2
        spots = [(x + 6, middle), (x - 6 - width, middle), (x - width / 2, y + 5), (x - width / 2, y - 5 - LINE)]
        options = ((left, top, left + width, top + LINE) for left, top in spots)
        free = (
            one
            for one in options
            if not outside(one, inside)
            and not any(overlap(one, other) for other in (*taken, *boxes))
            and not any(crosses(line, one) for line in lines)
        )
        found.append(next(free, None))
        boxes += [box for box in found[-1:] if box]
    return found


def between(line: Sequence[tuple[float, float]]) -> list[Segment]:
    """Segments of a curve."""
    return [(*start, *end) for start, end in itertools.pairwise(line)]


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share area."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def outside(box: Box, inside: Box) -> bool:
    """Whether a box leaves the one it should stay in."""
    return box[0] < inside[0] or box[1] < inside[1] or box[2] > inside[2] or box[3] > inside[3]


def crosses(line: Segment, box: Box) -> bool:
    """Whether a segment runs through a box: their extents meet, and the box has corners on both sides of it."""
    x0, y0, x1, y1 = line
    if max(x0, x1) < box[0] or min(x0, x1) > box[2] or max(y0, y1) < box[1] or min(y0, y1) > box[3]:
        return False
    sides = [(x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) for x in box[::2] for y in box[1::2]]
    return min(sides) <= 0 <= max(sides)
