"""Where the labels of a chart go: beside their points, clear of one another and, if it can be had, of the curves."""

from __future__ import annotations

import itertools
import math

Box = tuple[float, float, float, float]  # left, top, right, bottom in pixels
LINE = 13  # height of a label in pixels
LETTER = 6.1  # width of an average letter of a label


def place(
    wanted: list[tuple[float, float, str]], points: list[Box], lines: list[Box], inside: Box
) -> list[tuple[float, float]]:
    """Left edge and middle line of every label (x, y, text): never over a point or another label if that can be
    helped, and rather two lines further away than across a curve.
    """
    taken = list(points)
    spots = []
    for x, y, text in wanted:
        width = LETTER * len(text)
        best, box = math.inf, (x + 9, y - LINE / 2, x + 9 + width, y + LINE / 2)
        for step in range(24):
            top = y + (step + 1) // 2 * LINE * (-1 if step % 2 else 1) - LINE / 2
            for left in (x + 9, x - 9 - width):
                option = (left, top, left + width, top + LINE)
                outside = left < inside[0] or top < inside[1] or option[2] > inside[2] or option[3] > inside[3]
                away = abs(top + LINE / 2 - y) / LINE + 100 * outside
                if away >= best:  # whatever it lies over
                    continue
                hits = sum(overlap(option, other) for other in taken)
                crossed = sum(overlap(option, other) for other in lines)
                cost = away + 2 * min(crossed, 2) + 30 * hits
                if cost < best:
                    best, box = cost, option
        taken.append(box)
        spots.append((box[0], box[1] + LINE / 2))
    return spots


def between(line: list[tuple[float, float]]) -> list[Box]:
    """Small boxes along a curve's segments."""
    boxes = []
    for (x0, y0), (x1, y1) in itertools.pairwise(line):
        for part in (0.15, 0.3, 0.5, 0.7, 0.85):
            x, y = x0 + part * (x1 - x0), y0 + part * (y1 - y0)
            boxes.append((x - 1, y - 1, x + 1, y + 1))
    return boxes


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes (left, top, right, bottom) share area."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
