"""Where everything in a chart of speed against error goes: rows of data for its layers.

Everything that is not a curve (floor rail, rail of cells without a result, labels) is laid out in pixels here and
turned back into data values, so that one pair of logarithmic scales carries the whole picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from impactbench.reports.chart_labels import LETTER, LINE, Box, between, place
from impactbench.reports.page_data import FLOOR, isolated

Row = dict[str, Any]
WIDTH, HEIGHT = 780, 290
FLOOR_RAIL, FAIL_RAIL = 54, 210  # pixels


@dataclass(frozen=True)
class Axes:
    """Two logarithmic scales and the pixel rails beside them; `fail` is 0 when every cell has a result."""

    x: tuple[float, float]
    y: tuple[float, float]
    fail: int

    @property
    def main(self) -> int:
        """Width in pixels of the part that holds curves."""
        return WIDTH - FLOOR_RAIL - self.fail

    def at_x(self, pixel: float) -> float:
        """Error drawn at this pixel from the left."""
        low, high = self.x
        return float(10 ** (low + (pixel - FLOOR_RAIL) / self.main * (high - low)))

    def at_y(self, pixel: float) -> float:
        """Cost drawn at this pixel from the top."""
        low, high = self.y
        return float(10 ** (high - pixel / HEIGHT * (high - low)))

    def pixel(self, error: float, cost: float) -> tuple[float, float]:
        """Where a point is drawn; errors at or below the floor sit on the floor rail."""
        x = FLOOR_RAIL / 2
        if error > FLOOR:
            x = FLOOR_RAIL + (math.log10(error) - self.x[0]) / (self.x[1] - self.x[0]) * self.main
        return x, (self.y[1] - math.log10(cost)) / (self.y[1] - self.y[0]) * HEIGHT


def span(values: list[float], pad: float) -> tuple[float, float]:
    """Decimal logarithms of the smallest and largest value, at least one decade apart, with room around."""
    logs = [math.log10(v) for v in values] or [0.0]
    low, high = min(logs) - pad, max(logs) + pad
    short = max(0.0, 1.0 - (high - low)) / 2
    return low - short, high + short


def short(text: str, length: int = 26) -> str:
    """Label for a chart, cut where it would run over its neighbours; tables show names whole."""
    return isolated(text if len(text) <= length else text[: length - 1] + "…")


def pareto(points: list[Row]) -> list[Row]:
    """Points that no other point beats in both error and cost, by rising error."""
    best, keep = math.inf, []
    for row in sorted(points, key=lambda row: (row["error"], row["cost"])):
        if row["cost"] < best:
            best = row["cost"]
            keep.append(row)
    return keep


def decades(log_span: tuple[float, float]) -> list[float]:
    """Powers of ten inside a span of logarithms, thinned to at most nine."""
    powers = range(math.ceil(log_span[0]), math.floor(log_span[1]) + 1)
    return [10.0**p for p in powers][:: 1 + len(powers) // 10]


def rails(axes: Axes) -> dict[str, list[Row]]:
    """Bands left and right of the curves, and the corner to aim for."""
    bands = [{"x": axes.at_x(0), "x2": axes.at_x(FLOOR_RAIL - 6)}]
    texts = [{"x": axes.at_x(4), "t": "floor"}]
    if axes.fail:
        bands.append({"x": axes.at_x(WIDTH - axes.fail + 10), "x2": axes.at_x(WIDTH)})
        texts.append({"x": axes.at_x(WIDTH - axes.fail + 18), "t": "no result"})
    bands = [{**b, "y": axes.at_y(HEIGHT), "y2": axes.at_y(0)} for b in bands]
    texts = [{**t, "y": axes.at_y(10)} for t in texts]
    texts.append({"x": axes.at_x(FLOOR_RAIL + 4), "y": axes.at_y(HEIGHT - 9), "t": "↙ better"})
    return {"bands": bands, "words": texts}


def target(axes: Axes) -> dict[str, list[Row]]:
    """Line at the error target, which a script may move; not drawn where it would leave the part with curves."""
    low, high = (axes.at_x(pixel) for pixel in (FLOOR_RAIL, WIDTH - axes.fail))
    ends = {"y": axes.at_y(0), "y2": axes.at_y(HEIGHT), "end": axes.at_y(HEIGHT - 9)}
    return {"target": [{**ends, "low": low, "high": high}]}


def bounds(limits: Sequence[tuple[float, str]], axes: Axes) -> dict[str, list[Row]]:
    """Named lines at errors that do not depend on a policy: what a frozen scene scores, what the truth is good for."""
    rows = [{"x": x, "y": axes.at_y(0), "y2": axes.at_y(HEIGHT), "t": name} for x, name in limits if x > FLOOR]
    return {"limits": rows, "limit names": [{**row, "y": axes.at_y(22 + 12 * k)} for k, row in enumerate(rows)]}


DRAWN = ("policy", "engine", "profile", "step", "step_text", "error", "cost")


def curves(points: list[Row], spots: list[tuple[float, float]], axes: Axes) -> dict[str, list[Row]]:
    """Pareto front where everything was timed, interval bars, and the points of the lines."""
    drawn = [
        {**{key: point[key] for key in DRAWN}, "x": axes.at_x(x), "y": point["cost"]}
        for point, (x, _) in zip(points, spots, strict=True)
    ]
    intervals = [
        {**row, "y": point["low"], "high": point["high"]}
        for row, point in zip(drawn, points, strict=True)
        if point["high"] > point["low"]
    ]
    front = pareto(drawn) if all(point["timed"] for point in points) else []
    return {"front": front, "intervals": intervals, "points": drawn}


def labels(points: list[Row], spots: list[tuple[float, float]], axes: Axes) -> dict[str, list[Row]]:
    """Policy and finest step at each line's fine end, the coarsest step at the other."""
    lines: dict[str, list[tuple[Row, tuple[float, float]]]] = {}
    for point, spot in sorted(zip(points, spots, strict=True), key=lambda item: float(item[0]["step"])):
        lines.setdefault(point["policy"], []).append((point, spot))
    wanted: list[tuple[float, float, str]] = []
    segments: list[Box] = []
    for policy in dict.fromkeys(point["policy"] for point in points):
        line = lines[policy]
        segments += between([spot for _, spot in line])
        (finest, start), (coarsest, end) = line[0], line[-1]
        wanted.append((*start, f"{short(policy)}  {finest['step_text']}".rstrip()))
        if len(line) > 1:
            wanted.append((*end, coarsest["step_text"]))
    wanted.sort(key=lambda item: -len(item[2]))  # names first: they are the ones that must stay close
    placed = place(
        wanted,
        [(x - 6, y - 6, x + 6, y + 6) for x, y in spots],
        segments,
        (FLOOR_RAIL / 2, 0, WIDTH - axes.fail, HEIGHT),
    )
    texts, leaders = [], []
    for (x, y, text), (left, middle) in zip(wanted, placed, strict=True):
        texts.append({"x": axes.at_x(left), "y": axes.at_y(middle), "t": text})
        near = left if left > x else left + LETTER * len(text)
        if abs(middle - y) > LINE:  # moved aside: say which point it belongs to
            ends = {"x2": axes.at_x(near), "y2": axes.at_y(middle)}
            leaders.append({"x": axes.at_x(x), "y": axes.at_y(y), **ends})
    return {"labels": texts, "leaders": leaders}


def fail_marks(failed: list[Row], axes: Axes) -> list[Row]:
    """One mark in the right rail for every policy and state without a result, with the reason in its tooltip."""
    pitch = min(26.0, (HEIGHT - 40) / max(1, len(failed)))
    x = axes.at_x(WIDTH - axes.fail + 22)
    return [
        {**row, "x": x, "y": axes.at_y(34 + pitch * i), "t": short(f"{short(row['policy'], 18)} {row['state']}", 31)}
        for i, row in enumerate(failed)
    ]
