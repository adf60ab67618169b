"""The hard families: scenes on which engines break, each with a truth or an invariant and criteria of survival.

They take part only when named. A case's name says all of its parameters, so that any value makes a case:
`tall_stack[shape=box,count=37]`.
"""

from __future__ import annotations

import re
from functools import cache

from impactbench.scenarios import (
    hard_chaos,
    hard_fast,
    hard_gas,
    hard_impacts,
    hard_runs,
    hard_scales,
    hard_sequences,
    hard_stacks,
    hard_structures,
)
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Scene
from impactbench.scenarios.survival import Criterion, HardFamily
from impactbench.scenarios.truth import Case

HARD: dict[str, HardFamily] = {
    family.name: family
    for family in (
        *hard_stacks.FAMILIES,
        *hard_structures.FAMILIES,
        *hard_fast.FAMILIES,
        *hard_impacts.FAMILIES,
        *hard_sequences.FAMILIES,
        *hard_runs.FAMILIES,
        *hard_scales.FAMILIES,
        *hard_gas.FAMILIES,
        *hard_chaos.FAMILIES,
    )
}


def criteria_of(scene: Scene) -> tuple[Criterion, ...]:
    """What the scene's family asks of a run. Raises KeyError for a family that is not hard."""
    return HARD[scene.family].criteria(scene)


def knob_case(family: HardFamily, value: float) -> Case:
    """The family's case with its knob at `value`. A knob that is the step leaves the case as it is."""
    assert family.knob is not None
    knob = family.knob
    fixed = dict(knob.fixed or {})
    if knob.step:
        return family.make(**fixed)
    return family.make(**fixed, **{knob.parameter: round(value) if knob.kind == "int" else float(value)})


@cache
def case_named(name: str) -> Case | None:
    """The hard case of this name, whatever its values; None where the name is not one.

    Values outside what the family is defined for raise ValueError.
    """
    family = HARD.get(name.partition("[")[0])
    parameters = _parameters(name, family) if family else None
    if family is None or parameters is None:
        return None
    return family.make(**parameters)


def _parameters(name: str, family: HardFamily) -> Parameters | None:
    """The values a name holds, in the types of the family's own; None where keys or form differ."""
    pattern = family.values[0]
    if not pattern:
        return {} if name == family.name else None
    inside = re.fullmatch(r"[^\[]+\[(.*)\]", name)
    fields = [part.partition("=") for part in inside[1].split(",")] if inside else []
    if [key for key, _, _ in fields] != list(pattern):
        return None
    try:
        parameters = {key: type(pattern[key])(text) for key, _, text in fields}
    except ValueError:
        return None
    return parameters if case_name(family.name, parameters) == name else None


def select(pattern: str) -> list[Case]:
    """The hard cases a pattern names, none where it names none: a family's default cases, a glob over all of a
    family's, or one case of any values.

    A glob over families reaches the hard ones only where it is asked about them alone (see `catalogue.select`).
    """
    if pattern in HARD:
        return HARD[pattern].cases()
    one = case_named(pattern)
    if one is not None:
        return [one]
    matcher = glob(pattern)
    names = [
        name
        for family in HARD.values()
        if glob(pattern.partition("[")[0]).fullmatch(family.name)
        for name in (family.names(full=False) if "[" not in pattern else family.names())
    ]
    chosen = [name for name in names if matcher.fullmatch(name) or matcher.fullmatch(name.partition("[")[0])]
    return [case for name in chosen if (case := case_named(name)) is not None]


def glob(pattern: str) -> re.Pattern[str]:
    """* and ? as in file names; brackets stand for themselves, as case names hold them."""
    return re.compile(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."))
