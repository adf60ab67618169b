"""The catalogue: every family, and the selection of cases by name."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from functools import cache

from impactbench.scenarios import flight, gravity_drops, lines, pairs, rigid, rolling, sliding, walls
from impactbench.scenarios.truth import Case, Family

FAMILIES: dict[str, Family] = {
    family.name: family
    for family in (
        *flight.FAMILIES,
        *pairs.FAMILIES,
        *walls.FAMILIES,
        *gravity_drops.FAMILIES,
        *lines.FAMILIES,
        *sliding.FAMILIES,
        *rolling.FAMILIES,
        *rigid.FAMILIES,
    )
}


class UnknownCase(ValueError):
    """A pattern that names no family and no case. The message lists the nearest names."""


@cache
def _catalogue() -> tuple[Case, ...]:
    return tuple(case for family in FAMILIES.values() for case in family.cases())


def all_cases() -> list[Case]:
    """Every case, in the order of the catalogue."""
    return list(_catalogue())


def select(patterns: Sequence[str] = ()) -> list[Case]:
    """The cases that any pattern names, in the order of the catalogue; no pattern means all.

    A pattern is a family's name, a case's name, or either with * and ? in it.
    Brackets stand for themselves, as case names hold them.
    """
    matchers = [_matcher(pattern) for pattern in patterns]
    for pattern, matcher in zip(patterns, matchers, strict=True):
        if not any(_named(case, matcher) for case in _catalogue()):
            raise UnknownCase(_complaint(pattern))
    return [c for c in _catalogue() if not matchers or any(_named(c, m) for m in matchers)]


def _matcher(pattern: str) -> re.Pattern[str]:
    return re.compile(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."))


def _named(case: Case, matcher: re.Pattern[str]) -> bool:
    return bool(matcher.fullmatch(case.scene.name) or matcher.fullmatch(case.scene.family))


def _complaint(pattern: str) -> str:
    """One line: the cases of the family where the family is known, else the nearest names of any kind."""
    names = [case.scene.name for case in _catalogue()]
    family = pattern.partition("[")[0]
    known = [n for n in names if n.startswith(f"{family}[")] if family in FAMILIES else [*FAMILIES, *names]
    nearest = difflib.get_close_matches(pattern, known, n=3, cutoff=0.4) or known[:3]
    families = "" if family in FAMILIES else f" (families: {', '.join(FAMILIES)})"
    return f"unknown case {pattern!r}; nearest: {', '.join(nearest)}{families}"
