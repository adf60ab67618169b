"""Breaking points of the hard families: the value of a family's knob up to which a contestant satisfies its truth.

Every probe is one run in a child process. Probes of all searches go out together, the sweep first, then one step of
every bisection at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from impactbench.adapters.contestants import Contestant, select
from impactbench.adapters.isolation import Job, Outcome, run_jobs
from impactbench.reports.bisect import Range, Search
from impactbench.reports.cell import record, step_count, step_seconds
from impactbench.reports.compare import law_of
from impactbench.reports.probe_store import ProbeStore, key_of
from impactbench.scenarios.engine import Engine, Unavailable, Unsupported
from impactbench.scenarios.hard import HARD, criteria_of, knob_case
from impactbench.scenarios.records import Law
from impactbench.scenarios.survival import Criterion, HardFamily, Knob, judge
from impactbench.scenarios.truth import Case

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Effort:
    """sweep: values tried first. precision: width of a bracket, a part of the value. budget: seconds of runs a search
    may begin new ones within. limit: seconds one run may take.
    """

    sweep: int = 9
    precision: float = 0.02
    budget: float = 120.0
    limit: float = 60.0


QUICK, FULL = Effort(), Effort(17, 0.01, 900.0, 300.0)


@dataclass
class Hunt:
    """The search of one family's breaking point for one contestant."""

    family: HardFamily
    contestant: Contestant
    search: Search
    spent: float = 0.0
    probes: dict[float, dict[str, Any]] | None = None

    @property
    def knob(self) -> Knob:
        assert self.family.knob is not None
        return self.family.knob

    def take(self, value: float, probe: dict[str, Any]) -> None:
        self.probes = {**(self.probes or {}), value: probe}
        self.spent += probe["seconds"]
        self.search.put(value, SURVIVAL[probe["state"]])


SURVIVAL = {
    "survived": True,
    "failed": False,
    "diverged": False,
    "crashed": False,
    "error": False,
    "timed out": None,
    "unsupported": None,
    "unavailable": None,
}
"""What a run's end says of survival: an engine that crashes or gives up has not survived; one that is slow may."""


def families(names: Sequence[str]) -> list[HardFamily]:
    """The families with a knob, or those named. Raises ValueError with what is possible instead."""
    known = {name: family for name, family in HARD.items() if family.knob}
    for name in names:
        if name not in known:
            why = "has no one parameter to search" if name in HARD else "is no hard family"
            raise ValueError(f"{name!r} {why}; breaking points are searched in: {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(names)] if names else list(known.values())


def hunt(
    chosen: Sequence[HardFamily],
    contestants: Sequence[Contestant],
    effort: Effort,
    jobs: int,
    store: ProbeStore,
    progress: Progress = lambda *_: None,
    policies: bool = False,
) -> dict[str, Any]:
    """The section's part: a search for every family and contestant, each with all its probes; with `policies`, for the
    settings too that are meant to mend what breaks in a family.
    """
    hunts = [
        Hunt(family, who, Search(_range(family.knob), effort.sweep, effort.precision))
        for family in chosen
        if family.knob
        for who in dict.fromkeys((*contestants, *(select(family.policies) if policies and family.policies else ())))
        if not (family.knob.step and who.stepless)
    ]
    for each in hunts:
        if why := each.contestant.availability():
            for value in each.search.wanted():
                each.take(value, _lost("unavailable", why, 0.0))
    if any(each.contestant.lane == "reference" for each in hunts):
        from impactbench.reports.compare import compile_reference

        compile_reference(progress)
    turn = 0
    while work := [(each, value) for each in hunts for value in _wanted(each, effort)]:
        turn += 1
        name = "sweep" if turn == 1 else f"bisection {turn - 1}"
        for done, _ in enumerate(_probe_all(work, effort, jobs, store), 1):
            progress(name, done, len(work))
    return {
        "precision": effort.precision,
        "contestants": [who.name for who in contestants],
        "families": [_family(family) for family in chosen],
        "searches": [_result(each) for each in hunts],
    }


def _range(knob: Knob) -> Range:
    return Range(knob.low, knob.high, knob.kind, knob.breaks)


def _wanted(each: Hunt, effort: Effort) -> list[float]:
    wanted = each.search.wanted()
    return wanted if len(each.search.answers) < effort.sweep or each.spent < effort.budget else []


def _probe_all(work: Sequence[tuple[Hunt, float]], effort: Effort, jobs: int, store: ProbeStore) -> Iterator[None]:
    """Answer all of `work`, from the store where it knows; what is new is stored at once."""
    waiting: dict[str, tuple[Hunt, float]] = {}
    tasks = []
    for each, value in work:
        argument = request(each.family, each.contestant, value)
        key = key_of(each.contestant, each.family.name, argument.case.scene, argument.step, _facts(argument.criteria))
        kept = store.get(key)
        # A run that was too slow once may be tried with more patience.
        if kept and not (kept["state"] == "timed out" and kept["seconds"] < effort.limit):
            each.take(value, kept)
            yield
            continue
        waiting[key] = (each, value)
        call = "impactbench.reports.limits:probe"
        tasks.append(Job(key, each.contestant.lane, call, (each.family.name, each.contestant, value), effort.limit))
    for outcome in run_jobs(tasks, jobs):
        each, value = waiting[outcome.key]
        found = _probed(outcome)
        store.put(outcome.key, found)
        each.take(value, found)
        yield


def _probed(outcome: Outcome) -> dict[str, Any]:
    if outcome.state == "done" and isinstance(outcome.value, dict):
        return {**outcome.value, "seconds": outcome.seconds}
    return _lost(outcome.state, outcome.reason, outcome.seconds)


def _lost(state: str, reason: str, seconds: float) -> dict[str, Any]:
    return {"state": state, "reason": reason, "time": None, "criteria": [], "seconds": seconds}


@dataclass(frozen=True, eq=False)
class Request:
    case: Case
    law: Law
    step: float
    criteria: tuple[Criterion, ...]


def request(family: HardFamily, contestant: Contestant, value: float) -> Request:
    """What a probe runs: the case at this value of the knob, and the criteria that count."""
    knob = family.knob
    assert knob is not None
    case = knob_case(family, value)
    step = value if knob.step else step_seconds(family.steps(case.scene)[0])
    criteria = tuple(c for c in criteria_of(case.scene) if not knob.criteria or c.name in knob.criteria)
    return Request(case, law_of(contestant, case, None), step, criteria)


def _facts(criteria: Sequence[Criterion]) -> list[tuple[str, float, str]]:
    return [(criterion.name, criterion.limit, criterion.derivation) for criterion in criteria]


def probe(argument: tuple[str, Contestant, float]) -> dict[str, Any]:
    """One run and the verdict of every criterion. Runs inside a child process."""
    name, contestant, value = argument
    asked = request(HARD[name], contestant, value)
    scene = asked.case.scene
    try:
        engine: Engine = contestant.load()(scene, asked.law, contestant.profile, scene.model, asked.step)
        try:
            trajectory = record(engine, asked.step, step_count(scene, asked.step))
        finally:
            engine.close()
    except Unsupported as why:
        return _lost("unsupported", str(why), 0.0)
    except Unavailable as why:
        return _lost("unavailable", str(why), 0.0)
    if not trajectory.finite():
        return _lost("diverged", "the state is not finite", 0.0)
    try:
        verdicts = judge(scene, asked.criteria, trajectory)
    except OverflowError as why:
        return _lost("diverged", str(why), 0.0)
    failed = [verdict for verdict in verdicts if not verdict.survived]
    first = min(failed, key=lambda verdict: verdict.time or 0.0, default=None)
    return {
        "state": "failed" if first else "survived",
        "reason": first.criterion if first else "",
        "time": first.time if first else None,
        "criteria": [asdict(verdict) for verdict in verdicts],
        "seconds": 0.0,
    }


def _family(family: HardFamily) -> dict[str, Any]:
    knob = family.knob
    assert knob is not None
    criteria = criteria_of(knob_case(family, knob.low).scene)
    return {
        "name": family.name,
        "question": family.question,
        **asdict(knob),
        "fixed": dict(knob.fixed or {}),
        "criteria": [
            {"name": c.name, "description": c.description, "limit": c.limit, "derivation": c.derivation}
            for c in criteria
            if not knob.criteria or c.name in knob.criteria
        ],
    }


def _result(each: Hunt) -> dict[str, Any]:
    search, probes = each.search, each.probes or {}
    safe, lost = search.bracket()
    why = probes[lost] if lost is not None else next((p for p in probes.values() if SURVIVAL[p["state"]] is None), None)
    return {
        "family": each.family.name,
        "parameter": each.knob.parameter,
        "contestant": each.contestant.name,
        "version": each.contestant.version(),
        "status": search.status(),
        "survives": safe,
        "fails": lost,
        "monotone": not search.survivors_beyond(),
        "survivors_beyond": search.survivors_beyond(),
        "state": why["state"] if why else "survived",
        "reason": why["reason"] if why else "",
        "time_to_failure": why["time"] if why else None,
        "stopped": bool(search.wanted()) or any(probe["state"] == "timed out" for probe in probes.values()),
        "seconds": each.spent,
        "probes": [{"value": value, **probes[value]} for value in search.range.by_severity(list(probes))],
    }
