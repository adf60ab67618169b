"""The engine contract as points that hold or do not, each tried in a child process.

Most points are tried in the first case of every family that the engine can build, at one step for up to one second.
A point that leans on a broken one is not tried, so that one fault reads as one failure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports import contract
from impactbench.reports.executors import WARM_UPS
from impactbench.reports.trial import Broken, NotBuilt
from impactbench.scenarios.engine import Unavailable

LIMIT = 60.0
"""Seconds a point may take, start of the child included."""
PASS, FAIL, UNTRIED, UNAVAILABLE = "pass", "FAIL", "not tried", "unavailable"


@dataclass(frozen=True)
class Point:
    expected: str
    check: Callable[[Contestant], str]
    """Returns what was found, or raises `contract.Broken` with it."""
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Verdict:
    point: str
    state: str
    found: str


def conform(contestants: Sequence[Contestant], workers: int = 1) -> dict[str, list[Verdict]]:
    """Verdicts by contestant, in the order of `POINTS`."""
    if any(contestant.lane == "reference" for contestant in contestants):
        list(run_jobs(WARM_UPS, workers))
    found: dict[str, dict[str, Verdict]] = {contestant.name: {} for contestant in contestants}
    jobs = [
        Job(f"{contestant.name} {point}", contestant.lane, f"{__name__}:try_point", (point, contestant), LIMIT)
        for contestant in contestants
        for point in POINTS
    ]
    for outcome in run_jobs(jobs, workers):
        name, point = outcome.key.split(" ", 1)
        verdict = outcome.value
        if not isinstance(verdict, Verdict):  # the point's own code never raises: the engine did
            verdict = Verdict(point, FAIL, f"{outcome.state}: {outcome.reason}")
        found[name][point] = verdict
    return {name: [_settled(point, verdicts) for point in POINTS] for name, verdicts in found.items()}


def try_point(argument: tuple[str, Contestant]) -> Verdict:
    point, contestant = argument
    try:
        return Verdict(point, PASS, POINTS[point].check(contestant))
    except Broken as broken:
        return Verdict(point, FAIL, str(broken))
    except NotBuilt:
        return Verdict(point, UNTRIED, "the engine builds no such scene")
    except Unavailable as why:
        return Verdict(point, UNAVAILABLE, str(why))


def _settled(point: str, verdicts: Mapping[str, Verdict]) -> Verdict:
    broken = [need for need in POINTS[point].needs if verdicts[need].state == FAIL]
    return Verdict(point, UNTRIED, f"needs {broken[0]}") if broken else verdicts[point]


def exit_code(verdicts: Mapping[str, Sequence[Verdict]]) -> int:
    """0 all hold, 1 some point fails, 3 some contestant could not be run at all."""
    states = {name: {verdict.state for verdict in row} for name, row in verdicts.items()}
    if any(FAIL in row for row in states.values()):
        return 1
    return 3 if any(UNAVAILABLE in row or not _ran(verdicts[name]) for name, row in states.items()) else 0


def _ran(verdicts: Sequence[Verdict]) -> bool:
    return any(verdict.point == "initial state" and verdict.state == PASS for verdict in verdicts)


def lines(verdicts: Mapping[str, Sequence[Verdict]]) -> Iterator[str]:
    """A line for each point: what was expected and what was found."""
    for name, row in verdicts.items():
        missing = next((verdict.found for verdict in row if verdict.state == UNAVAILABLE), None)
        if missing is not None:
            yield f"{name}: unavailable: {missing}"
            continue
        held = sum(verdict.state == PASS for verdict in row)
        failed = sum(verdict.state == FAIL for verdict in row)
        yield f"{name}: {held} of {len(row)} points hold, {failed} fail, {len(row) - held - failed} not tried"
        for verdict in row:
            expected = POINTS[verdict.point].expected
            yield f"  {verdict.state:9}  {verdict.point:14}  expected: {expected}; found: {verdict.found}"


POINTS: dict[str, Point] = {}


def _list_points() -> None:
    shape = ("constructor", "methods")
    read = (*shape, "arrays", "statics")
    POINTS["constructor"] = Point("takes (scene, law, profile, model, step)", contract.constructor)
    POINTS["methods"] = Point("has advance, read and close", contract.methods)
    for name, expected, check, needs in (
        ("unsupported", "a scene is built or refused by Unsupported with a reason", contract.unsupported, shape),
        ("settings", "a mapping from text to what JSON holds", contract.everywhere(contract.settings), shape),
        ("arrays", "float64 arrays [n, 3], quaternions [n, 4]", contract.everywhere(contract.arrays), shape),
        ("statics", "a row for each movable body, none for statics", contract.everywhere(contract.statics), shape),
        (
            "initial state",
            "read() at t = 0 is the scene's start, in scene order",
            contract.everywhere(contract.initial_state),
            read,
        ),
        ("mutation", "writing into what read() gave changes nothing", contract.everywhere(contract.mutation), shape),
        ("earlier reads", "what read() gave stays as it was", contract.everywhere(contract.earlier_reads), shape),
        ("advance", "advance(n) is n times advance(1)", contract.everywhere(contract.advance), shape),
        ("free flight", "order 1 or more against the parabola", contract.free_flight, (*read, "initial state")),
        ("fresh builds", "two fresh builds agree to the last bit", contract.everywhere(contract.fresh_builds), shape),
        (
            "two at once",
            "another engine in the process changes nothing",
            contract.everywhere(contract.company),
            (*shape, "fresh builds"),
        ),
        (
            "spins",
            "orientations and spins where rotation is modelled, only there",
            contract.everywhere(contract.spins),
            shape,
        ),
    ):
        POINTS[name] = Point(expected, check, needs)


_list_points()
