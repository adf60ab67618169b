"""The checks behind the points of the engine contract. They run in a child process, on the engine under test.

A check returns what it found or raises `Broken` with it; any other exception is the engine's own.
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
from impactbench.adapters.contestants import Contestant
from impactbench.reports.cell import step_count
from impactbench.reports.trial import (
    PARTS,
    STEP,
    Broken,
    NotBuilt,
    Trial,
    arrays_of,
    distance,
    kind_of,
    must_be_same,
    opening,
    part_distance,
    reordered,
)
from impactbench.scenarios import catalogue
from impactbench.scenarios.engine import Unavailable, Unsupported
from impactbench.scenarios.records import FULL
from impactbench.scenarios.truth import Case

FLIGHT_STEPS = (1 / 30, 1 / 60, 1 / 120, 1 / 240)
ROUND_OFF = 1e-12
"""For a state that was only stored and turned: some thousand ulps."""
GROWN = 1e-9
"""For round-off that impacts and 60 steps have carried along, and for free flight that is exact."""
ORDER = 0.9
"""Least order of free flight: first order is exactly 1 on a parabola, the rest is room for a start-up step."""


@cache
def _first_cases() -> tuple[Case, ...]:
    first: dict[str, Case] = {}
    for case in catalogue.all_cases():
        first.setdefault(case.scene.family, case)
    return tuple(first.values())


def everywhere(test: Callable[[Trial], float | None]) -> Callable[[Contestant], str]:
    """The check that a test holds in every scene that builds; the test returns how far it was off, if it knows."""

    def check(contestant: Contestant) -> str:
        tried, worst = 0, 0.0
        for case in _first_cases():
            try:
                worst = max(worst, test(Trial(contestant, case)) or 0.0)
            except NotBuilt:
                continue
            except Broken as broken:
                raise Broken(f"{broken} in {case.scene.name}") from None
            tried += 1
        if not tried:
            raise NotBuilt
        return f"so in {tried} scenes" + (f", off by at most {worst:.1g}" if worst else "")

    return check


def constructor(contestant: Contestant) -> str:
    kind = kind_of(contestant)
    try:
        inspect.signature(kind).bind(*range(5))
    except TypeError as fault:
        raise Broken(str(fault)) from None
    except ValueError:  # compiled classes need not tell; the other points then show it
        return "a signature that cannot be read"
    return "a signature that takes five"


def methods(contestant: Contestant) -> str:
    kind = kind_of(contestant)
    missing = [name for name in ("advance", "read", "close") if not callable(getattr(kind, name, None))]
    if missing:
        raise Broken(f"no {', no '.join(missing)}")
    return "all three"


def unsupported(contestant: Contestant) -> str:
    """Every scene, law and model: built, or refused with a reason."""
    kind, built, refused = kind_of(contestant), 0, 0
    for case in _first_cases():
        scene = case.scene
        for law, model in ((law, model) for law in scene.laws for model in (scene.model, FULL)):
            try:
                kind(scene, law, contestant.profile, model, STEP).close()
                built += 1
            except Unavailable:
                raise
            except Unsupported as why:
                if not str(why).strip():
                    raise Broken(f"Unsupported without a reason for {scene.name}, law {law}") from None
                refused += 1
            except Exception as fault:
                what = " ".join(f"{type(fault).__name__}: {fault}".split())
                raise Broken(f"{what} for {scene.name}, law {law}") from None
    return f"{built} worlds built, {refused} refused with a reason"


def settings(trial: Trial) -> None:
    with trial.world() as engine:
        engine.advance(1)
        settings = getattr(engine, "settings", None)
    if not isinstance(settings, Mapping):
        raise Broken(f"{type(settings).__name__}, no mapping,")
    for name, value in settings.items():
        if not isinstance(name, str):
            raise Broken(f"the name {name!r}, no text,")
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError) as fault:
            raise Broken(f"{name!r} that JSON cannot hold ({fault})") from None


def arrays(trial: Trial) -> None:
    with trial.world() as engine:
        state = engine.read()
    rows = len(state.positions)
    for name, width in (("positions", 3), ("velocities", 3), ("orientations", 4), ("spins", 3)):
        array = getattr(state, name)
        if array is None and name in ("orientations", "spins"):
            continue
        if not isinstance(array, np.ndarray) or array.dtype != np.float64:
            raise Broken(f"{name} of type {getattr(array, 'dtype', type(array).__name__)}")
        if array.shape != (rows, width):
            raise Broken(f"{name} of shape {list(array.shape)} for {rows} rows")


def statics(trial: Trial) -> None:
    with trial.world() as engine:
        rows = len(engine.read().positions)
    movable, bodies = len(trial.case.scene.movable), len(trial.case.scene.bodies)
    if rows != movable:
        raise Broken(f"{rows} rows for {movable} movable bodies of {bodies}")


def initial_state(trial: Trial) -> float:
    scene = trial.case.scene
    with trial.world() as engine:
        state = engine.read()
    expected = opening(trial, state.spins is not None and state.orientations is not None)
    away = distance(state, expected, trial)
    if away <= ROUND_OFF:
        return away
    rows = list(range(len(scene.movable)))
    turned = [rows[k:] + rows[:k] for k in rows] + [rows[k::-1] + rows[:k:-1] for k in rows]
    if any(distance(state, reordered(expected, order), trial) <= ROUND_OFF for order in turned):
        raise Broken("the rows in another order")
    wrong = [part for part in PARTS if part_distance(part, state, expected, trial) > ROUND_OFF]
    raise Broken(f"{' and '.join(wrong)} off by {away:.2g}")


def mutation(trial: Trial) -> None:
    with trial.world() as engine:
        state = engine.read()
        for array in arrays_of(state):
            if array.flags.writeable:
                array += 1.0
        engine.advance(1)
        after = engine.read()
    with trial.world() as engine:
        engine.advance(1)
        away = distance(after, engine.read(), trial)
    if away > GROWN:
        raise Broken(f"a state {away:.2g} off after its arrays were written to")


def earlier_reads(trial: Trial) -> None:
    with trial.world() as engine:
        state = engine.read()
        kept = [array.copy() for array in arrays_of(state)]
        engine.advance(5)
        engine.read()
    if not all(np.array_equal(old, now, equal_nan=True) for old, now in zip(kept, arrays_of(state), strict=True)):
        raise Broken("an earlier read that changed")


def advance(trial: Trial) -> float:
    with trial.world() as engine:
        engine.advance(trial.steps())
        at_once = engine.read()
    away = distance(at_once, trial.end(), trial)
    if away > GROWN:
        raise Broken(f"states {away:.2g} apart after {trial.steps()} steps")
    return away


def fresh_builds(trial: Trial) -> None:
    must_be_same(trial.end(), trial.end(), trial)


def company(trial: Trial) -> None:
    """Another scene at another step, built later, stepped in turn and closed first."""
    alone = trial.end()
    flight = Trial(trial.contestant, _first_cases()[0], 2 * STEP)
    other = replace(trial, step=2 * STEP) if _refuses(flight) else flight
    with trial.world() as engine:
        with other.world() as company:
            for _ in range(trial.steps() - 1):
                engine.advance(1)
                company.advance(1)
            company.read()
        engine.advance(1)
        must_be_same(engine.read(), alone, trial)


def _refuses(trial: Trial) -> bool:
    try:
        with trial.world():
            return False
    except NotBuilt:
        return True


def spins(trial: Trial) -> None:
    with trial.world() as engine:
        state = engine.read()
    given = [name for name in ("orientations", "spins") if getattr(state, name) is not None]
    if trial.case.scene.model.rotation and len(given) < 2:
        raise Broken("rotation modelled but not both orientations and spins given,")
    if given and not trial.case.scene.model.rotation:
        raise Broken(f"{' and '.join(given)} given without rotation modelled,")


def free_flight(contestant: Contestant) -> str:
    found = []
    for case in catalogue.select(["free_flight"]):
        try:
            errors = [_flight_error(Trial(contestant, case, step)) for step in FLIGHT_STEPS]
        except NotBuilt:
            continue
        found.append(f"{len(case.scene.model.axes)}D {_convergence(errors)}")
    if not found:
        raise NotBuilt
    return ", ".join(found)


def _flight_error(trial: Trial) -> float:
    count = step_count(trial.case.scene, trial.step)
    truth = next(iter(trial.case.truths.values())).state(count * trial.step)
    assert truth is not None
    with trial.world() as engine:
        for _ in range(count):
            engine.advance(1)
        return distance(engine.read(), truth, trial)


def _convergence(errors: Sequence[float]) -> str:
    """The order between the two finest steps: finer ones must come closer, at least in proportion."""
    if max(errors) <= GROWN:
        return "exact"
    pairs = [(coarse, fine) for coarse, fine in pairwise(errors) if coarse > GROWN]
    orders = [math.log2(coarse / fine) if 0 < fine < math.inf else -math.inf for coarse, fine in pairs if fine]
    order = min(orders, default=math.inf)
    if order < ORDER:
        raise Broken(f"order {order:.2f}, {errors[-1]:.2g} off at the finest step")
    return f"order {order:.2f}"
