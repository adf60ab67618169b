"""The catalogue: every family, and the selection of cases by name."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from impactbench.scenarios import flight, gravity_drops, hard, lines, pairs, rigid, rolling, sliding, walls
from impactbench.scenarios.scene_file import is_scene_file, read_case
from impactbench.scenarios.scene_values import SceneError, printable
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

KNOWN = (*FAMILIES, *hard.HARD)


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
    Brackets stand for themselves, as case names hold them. A pattern that ends in .toml, .xml or .urdf is the path of a
    scene file; such cases come last. Hard cases come before them, and only for a pattern that names no other case.
    """
    files = [pattern for pattern in patterns if is_scene_file(pattern)]
    if files:
        named = [pattern for pattern in patterns if not is_scene_file(pattern)]
        return [*(select(named) if named else []), *_read(files)]
    matchers = [hard.glob(pattern) for pattern in patterns]
    hard_cases: dict[str, Case] = {}
    for pattern, matcher in zip(patterns, matchers, strict=True):
        if not any(_named(case, matcher) for case in _catalogue()):
            found = hard.select(pattern)
            if not found:
                raise UnknownCase(_complaint(pattern))
            hard_cases |= {case.scene.name: case for case in found}
    core = [c for c in _catalogue() if not matchers or any(_named(c, m) for m in matchers)]
    return [*core, *hard_cases.values()]


def _read(files: Sequence[str]) -> list[Case]:
    """The files' cases. Names must tell results apart."""
    cases: dict[str, Case] = {}
    for file in dict.fromkeys(files):
        case = read_case(file)
        name, family = case.scene.name, case.scene.family
        if not family or family in FAMILIES or family in hard.HARD:
            raise SceneError(f"{printable(Path(file).name)}: name {name!r} is kept for the catalogue; choose another")
        if name in cases:
            raise SceneError(f"{printable(Path(file).name)}: another of these scene files is named {name!r} too")
        cases[name] = case
    return list(cases.values())


def _named(case: Case, matcher: re.Pattern[str]) -> bool:
    return bool(matcher.fullmatch(case.scene.name) or matcher.fullmatch(case.scene.family))


def _complaint(pattern: str) -> str:
    """One line: the cases of the family where the family is known, else the nearest names of any kind."""
    names = [case.scene.name for case in _catalogue()]
    family = pattern.partition("[")[0]
    if family in hard.HARD:
        names = hard.HARD[family].names()
    known = [n for n in names if n.startswith(family)] if family in KNOWN else [*KNOWN, *names]
    nearest = difflib.get_close_matches(pattern, known, n=3, cutoff=0.4) or known[:3]
    families = "" if family in KNOWN else f" (families: {', '.join(KNOWN)})"
    return f"unknown case {pattern!r}; nearest: {', '.join(nearest)}{families}"
