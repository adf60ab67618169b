"""Where everything in a chart of speed against error goes: rows of data for its layers.

Everything that is not a curve (floor rail, rail of cells without a result, labels) is laid out in pixels here and
turned back into data values, so that one pair of logarithmic scales carries the whole picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from impactbench.reports.chart_labels import LINE, SMALL, Box, Segment, Wanted, between, fit, place
from impactbench.reports.page_data import FLOOR, TARGET, isolated, percent

Row = dict[str, Any]
Spot = tuple[float, float]  # where a point is drawn, in pixels
BETTER = "↙ better"
FAIL = 10  # pixels from a mark in the right rail to its text
Limit = tuple[float, str]  # an error to draw a line at, and its name


class Frame(NamedTuple):
    """Size of a chart and of the rails beside its curves [px]; `wordy` where there is room for more than names."""

    width: int
    height: int
    floor: int
    fail: int
    wordy: bool


WIDE, NARROW = Frame(780, 290, 54, 210, True), Frame(300, 330, 38, 40, False)


@dataclass(frozen=True)
class Axes:
    """Two logarithmic scales in a frame, whose `fail` is 0 when every cell has a result."""

    x: tuple[float, float]
    y: tuple[float, float]
    frame: Frame

    @property
    def main(self) -> int:
        """Width in pixels of the part that holds curves."""
        return self.frame.width - self.frame.floor - self.frame.fail

    def at_x(self, pixel: float) -> float:
        """Error drawn at this pixel from the left."""
        low, high = self.x
        return float(10 ** (low + (pixel - self.frame.floor) / self.main * (high - low)))

    def at_y(self, pixel: float) -> float:
        """Cost drawn at this pixel from the top."""
        low, high = self.y
        return float(10 ** (high - pixel / self.frame.height * (high - low)))

    def pixel(self, error: float, cost: float) -> tuple[float, float]:
        """Where a point is drawn; errors at or below the floor sit on the floor rail."""
        x = self.frame.floor / 2
        if error > FLOOR:
            x = self.frame.floor + (math.log10(error) - self.x[0]) / (self.x[1] - self.x[0]) * self.main
        return x, (self.y[1] - math.log10(cost)) / (self.y[1] - self.y[0]) * self.frame.height


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


def decades(log_span: tuple[float, float], most: int = 9) -> list[float]:
    """Powers of ten inside a span of logarithms, thinned to at most so many."""
    powers = range(math.ceil(log_span[0]), math.floor(log_span[1]) + 1)
    return [10.0**p for p in powers][:: 1 + len(powers) // (most + 1)]


def rails(axes: Axes, spots: Sequence[Spot]) -> dict[str, list[Row]]:
    """Bands left and right of the curves, and the corner to aim for."""
    width, height, floor, fail, wordy = axes.frame
    bands = [{"x": axes.at_x(0), "x2": axes.at_x(floor - 6)}]
    texts = [{"x": axes.at_x(4), "y": axes.at_y(10), "t": "floor"}]
    if fail:
        bands.append({"x": axes.at_x(width - fail + 10), "x2": axes.at_x(width)})
        words = "no result" if wordy else "none"
        texts.append({"x": axes.at_x(width - fail + 14), "y": axes.at_y(10), "t": words})
    bands = [{**b, "y": axes.at_y(height), "y2": axes.at_y(0)} for b in bands]
    free = wordy and not any(x < floor and y > height - 24 for x, y in spots)
    texts.append({"x": axes.at_x(2 if free else floor + 4), "y": axes.at_y(height - 9), "t": BETTER})
    return {"bands": bands, "words": texts}


def target(axes: Axes) -> dict[str, list[Row]]:
    """Line at the error target, which a script may move; not drawn where it would leave the part with curves."""
    width, height, floor, fail, _ = axes.frame
    ends = {"y": axes.at_y(0), "y2": axes.at_y(height), "end": axes.at_y(height - 9)}
    low, high = axes.at_x(floor), axes.at_x(width - fail)
    return {"target": [{**ends, "low": low, "high": high}]}


def bounds(limits: Sequence[Limit], axes: Axes, spots: Sequence[Spot]) -> dict[str, list[Row]]:
    """Named lines at errors that do not depend on a policy: what a frozen scene scores, what the truth is good for."""
    drawn = [(x, name) for x, name in limits if x > FLOOR]
    rows = [{"x": x, "y": axes.at_y(0), "y2": axes.at_y(axes.frame.height), "t": name} for x, name in drawn]
    wanted = [(axes.pixel(x, 1)[0], 0.0, name) for x, name in drawn]
    boxes = bound_names(limits, axes, spots)
    return {"limits": rows, "limit names": [text(axes, one, box) for one, box in zip(wanted, boxes, strict=True)]}


def bound_names(limits: Sequence[Limit], axes: Axes, spots: Sequence[Spot]) -> list[Box]:
    """Boxes of the names of these lines: near the top, on the side that has room."""
    wanted = [(axes.pixel(x, 1)[0], 10.0, name) for x, name in limits if x > FLOOR]
    return place(wanted, around(spots), rules(limits, axes), curves_part(axes), gap=3, letter=SMALL)


def rules(limits: Sequence[Limit], axes: Axes) -> list[Segment]:
    """Upright lines: of the limits and of the target."""
    across = [axes.pixel(x, 1)[0] for x in (TARGET, *(x for x, _ in limits)) if x > FLOOR]
    return [(x, 0, x, axes.frame.height) for x in across]


def around(spots: Sequence[Spot]) -> list[Box]:
    """Boxes of the marks."""
    return [(x - 6, y - 6, x + 6, y + 6) for x, y in spots]


def curves_part(axes: Axes) -> Box:
    """Where labels may be."""
    return (axes.frame.floor / 2, 0, axes.frame.width - axes.frame.fail, axes.frame.height)


DRAWN = ("policy", "engine", "profile", "step", "step_text", "error", "cost")


def curves(points: list[Row], spots: list[Spot], axes: Axes) -> dict[str, list[Row]]:
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


def labels(points: list[Row], spots: list[Spot], axes: Axes, limits: Sequence[Limit] = ()) -> dict[str, list[Row]]:
    """Policy and finest step at each line's fine end; the other steps where there is room, the coarsest first."""
    lines: dict[str, list[tuple[Row, Spot]]] = {}
    for point, spot in sorted(zip(points, spots, strict=True), key=lambda item: float(item[0]["step"])):
        lines.setdefault(point["policy"], []).append((point, spot))
    names = [(*line[0][1], named(policy, line[0][0], axes)) for policy, line in lines.items()]
    names.sort(key=lambda item: -len(item[2]))
    coarse_to_fine = sorted((item for line in lines.values() for item in line[1:]), key=lambda i: -float(i[0]["step"]))
    steps = [(*spot, point["step_text"]) for point, spot in coarse_to_fine if point["step_text"]]
    segments = [part for line in lines.values() for part in between([spot for _, spot in line])]
    inside = curves_part(axes)
    taken = [*bound_names(limits, axes, spots), *foot(axes), *around(spots)]
    boxes = place(names, taken, [*segments, *rules(limits, axes)], inside)
    pulled = [leader(spot, box) for spot, box in zip(names, boxes, strict=True) if moved(spot, box)]
    fitted = fit(steps, [*taken, *boxes], [*segments, *pulled], inside)
    return {
        "labels": [text(axes, name, box) for name, box in zip(names, boxes, strict=True)],
        "steps": [text(axes, step, box) for step, box in zip(steps, fitted, strict=True) if box],
        "leaders": [
            {"x": axes.at_x(x), "y": axes.at_y(y), "x2": axes.at_x(x2), "y2": axes.at_y(y2)} for x, y, x2, y2 in pulled
        ],
    }


def named(policy: str, finest: Row, axes: Axes) -> str:
    """What stands at a line's fine end."""
    return f"{short(policy)}  {finest['step_text']}".rstrip() if axes.frame.wordy else short(policy, 18)


def foot(axes: Axes) -> list[Box]:
    """Boxes of the words at the foot of the curves: the target, the corner to aim for."""
    _, height, floor, _, _ = axes.frame
    at = axes.pixel(TARGET, 1)[0]
    ends = (at, at + 4 + SMALL * len(percent(TARGET))), (floor, floor + 4 + SMALL * len(BETTER))
    return [(left, height - LINE - 3, right, height) for left, right in ends]


def text(axes: Axes, wanted: Wanted, box: Box) -> Row:
    """A label in its box, set flush with the side on which its point is."""
    side, edge = ("right", box[2]) if box[2] < wanted[0] else ("left", box[0])
    return {"x": axes.at_x(edge), "y": axes.at_y((box[1] + box[3]) / 2), "t": wanted[2], "side": side}


def moved(wanted: Wanted, box: Box) -> bool:
    """Whether a label is so far from its point that a line must say which one it belongs to."""
    return abs((box[1] + box[3]) / 2 - wanted[1]) > LINE / 2


def leader(wanted: Wanted, box: Box) -> Segment:
    """From a point to the near end of its label."""
    x, y, _ = wanted
    return (x, y, box[0] if box[0] > x else box[2], (box[1] + box[3]) / 2)


def fail_marks(failed: list[Row], axes: Axes) -> list[Row]:
    """One mark in the right rail for every policy and state without a result, with the reason in its tooltip."""
    width, height, _, fail, wordy = axes.frame
    pitch = min(26.0, (height - 40) / max(1, len(failed)))
    x = axes.at_x(width - fail + 22)
    texts = [short(f"{short(row['policy'], 18)} {row['state']}", 31) if wordy else "" for row in failed]
    return [{**row, "x": x, "y": axes.at_y(34 + pitch * i), "t": texts[i]} for i, row in enumerate(failed)]
