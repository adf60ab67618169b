"""Whether two runs rank contestants alike: which is cheaper at a fixed error, where both runs are sure of it.

A run is sure of an order where the 95 % intervals of the two medians do not overlap. An order that turns round between
two runs that are both sure of theirs cannot be put down to scatter within either.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

from impactbench.reports import time_to_error
from impactbench.reports.page_data import counted, percent
from impactbench.reports.page_view import View

Key = tuple[str, float]
"""Case, and target of its error."""
Order = tuple[str, str]
"""The cheaper policy, then the dearer one."""


@dataclass(frozen=True)
class Turned:
    """A pair whose order is another: cheaper and dearer as the first run has it."""

    case: str
    target: float
    cheaper: str
    dearer: str

    def __str__(self) -> str:
        return f"{self.case} to {percent(self.target)}: {self.cheaper} was cheaper than {self.dearer}, now dearer"


@dataclass(frozen=True)
class Rankings:
    """alike: pairs in the same order. unsure: pairs whose intervals overlap in one run at least."""

    alike: int = 0
    unsure: int = 0
    turned: list[Turned] = field(default_factory=list)

    def __str__(self) -> str:
        if not self.alike + self.unsure + len(self.turned):
            return ""
        sure = self.alike + len(self.turned)
        text = (
            f"of {counted(sure, 'pair')} of policies whose cost both runs tell apart, {len(self.turned)} changed order"
        )
        return f"{text}; {self.unsure} with overlapping intervals"


def compare(before: dict[str, Any], after: dict[str, Any]) -> Rankings:
    """The orders of two documents, over all cases and targets that both have timed."""
    one, other = _orders(before), _orders(after)
    found: Counter[str] = Counter()
    turned = []
    for key in one.keys() & other.keys():
        for pair in one[key].keys() & other[key].keys():
            orders = one[key][pair], other[key][pair]
            if orders[0] is None or orders[1] is None:
                found["unsure"] += 1
            elif orders[0] == orders[1]:
                found["alike"] += 1
            else:
                turned.append(Turned(*key, *orders[0]))
    return Rankings(found["alike"], found["unsure"], sorted(turned, key=str))


def _orders(document: dict[str, Any]) -> dict[Key, dict[frozenset[str], Order | None]]:
    """For every pair of policies that reach a target: which is cheaper, None where the run cannot say."""
    costs: dict[Key, list[dict[str, Any]]] = {}
    for row in document.get("time_to_error") or time_to_error.rows(View(document)):
        if "low" in row:
            costs.setdefault((row["case"], row["target"]), []).append(row)
    return {
        key: {frozenset((a["policy"], b["policy"])): _order(a, b) for a, b in combinations(rows, 2)}
        for key, rows in costs.items()
    }


def _order(a: dict[str, Any], b: dict[str, Any]) -> Order | None:
    if a["high"] < b["low"]:
        return a["policy"], b["policy"]
    return (b["policy"], a["policy"]) if b["high"] < a["low"] else None
