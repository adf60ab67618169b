"""The search for a breaking point: a coarse sweep that shows whether survival is monotone, then bisection.

Pure bookkeeping: it says which values it wants to know and is told what happened there, in any order. It is the same
search whoever asks, so that answers kept from an earlier run lead to the same end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

Kind = Literal["int", "log", "linear"]
Answer = bool | None
"""Survived or not; None where that could not be found out."""


@dataclass(frozen=True)
class Range:
    """Values from `low` to `high`, spaced evenly (linear), by ratios (log) or whole (int). `breaks` says on which side
    survival is lost.
    """

    low: float
    high: float
    kind: Kind
    breaks: Literal["above", "below"] = "above"

    def grid(self, count: int) -> list[float]:
        """Some `count` values from the mildest to the most severe, both ends included."""
        parts = [k / (count - 1) for k in range(count)]
        if self.kind == "linear":
            values = [self.low + (self.high - self.low) * part for part in parts]
        else:
            values = [self.low * (self.high / self.low) ** part for part in parts]
        values[0], values[-1] = self.low, self.high
        if self.kind == "int":
            values = [float(round(value)) for value in values]
        return self.by_severity(values)

    def by_severity(self, values: list[float]) -> list[float]:
        return sorted(set(values), reverse=self.breaks == "below")

    def between(self, a: float, b: float, precision: float) -> float | None:
        """The value halfway from a to b; None where they are as close as `precision` (a part of the value, or of the
        range where linear).
        """
        low, high = min(a, b), max(a, b)
        if self.kind == "int":
            return float((round(low) + round(high)) // 2) if high - low > 1 else None
        if self.kind == "log":
            return math.sqrt(low * high) if high > low * (1 + precision) else None
        return (low + high) / 2 if high - low > precision * (self.high - self.low) else None


@dataclass
class Search:
    """One breaking point. `most` bounds the probes after the sweep."""

    range: Range
    sweep: int = 9
    precision: float = 0.05
    most: int = 12
    answers: dict[float, Answer] = field(default_factory=dict)

    def wanted(self) -> list[float]:
        """Values to try next; none when done."""
        open_ = [value for value in self.range.grid(self.sweep) if value not in self.answers]
        if open_:
            return open_
        safe, lost = self.bracket()
        if safe is None or lost is None or len(self.answers) >= self.sweep + self.most:
            return []
        value = self.range.between(safe, lost, self.precision)
        return [] if value is None or value in self.answers else [value]

    def put(self, value: float, answer: Answer) -> None:
        self.answers[value] = answer

    def known(self) -> list[tuple[float, bool]]:
        """Answers from the mildest value on, up to the first that could not be found out."""
        found = []
        for value in self.range.by_severity(list(self.answers)):
            answer = self.answers[value]
            if answer is None:
                break
            found.append((value, answer))
        return found

    def bracket(self) -> tuple[float | None, float | None]:
        """The most severe value up to which all survive, and the mildest that does not; None where there is none."""
        safe = None
        for value, survived in self.known():
            if not survived:
                return safe, value
            safe = value
        return safe, None

    def survivors_beyond(self) -> list[float]:
        """Values that survive beyond the first that does not: empty where survival is monotone."""
        _, lost = self.bracket()
        if lost is None:
            return []
        order = self.range.by_severity(list(self.answers))
        return [value for value in order[order.index(lost) :] if self.answers[value]]

    def status(self) -> str:
        """`found`, `at least` (all known survive), `below` (the mildest does not) or `unknown`."""
        safe, lost = self.bracket()
        if safe is None:
            return "below" if lost is not None else "unknown"
        return "found" if lost is not None else "at least"
