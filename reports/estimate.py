"""How long a comparison will take, from a few short runs of every contestant on every family."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, run_jobs
from impactbench.reports.cell import Cell, build, case_of, run_cell, step_count
from impactbench.scenarios.engine import Unavailable, Unsupported

TRIALS = ("1/30", "1/120")
"""A cell costs so much to begin with and so much a step: two steps tell the two apart."""
TRIAL_LIMIT = 20.0
Entry = tuple[Cell, Contestant]
Sample = tuple[int, float, float, float]  # steps; seconds of the recorded cell, of building, of the steps alone


@dataclass(frozen=True)
class Estimate:
    """Seconds of processor time of all cells to be recorded, and seconds of the serial timing lane."""

    accuracy: float
    timing: float
    jobs: int

    @property
    def seconds(self) -> float:
        return self.accuracy / self.jobs + self.timing

    def __str__(self) -> str:
        parts = f"accuracy {_duration(self.accuracy / self.jobs)}, timing {_duration(self.timing)}"
        return f"this will take about {_duration(self.seconds)} ({parts}), the report not included"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


def estimate(cells: Sequence[Entry], timed: set[str], phase: float, rounds: int, jobs: int) -> Estimate:
    """Of all the cells, as if no cache held any. `phase` is the one that is timed, in `rounds` turns and a warm-up.

    The first case of a family stands for its family. A trial that fails counts nothing: so may its cells.
    """
    trials: dict[tuple[str, str], list[Entry]] = {}
    for cell, contestant in cells:
        if not contestant.availability():
            trials.setdefault((contestant.name, _family(cell)), [(cell, contestant)])
    work = [
        Job(f"{name} {family}", entry[0][1].lane, "impactbench.reports.estimate:samples", entry[0], TRIAL_LIMIT)
        for (name, family), entry in trials.items()
    ]
    found = {outcome.key: outcome.value for outcome in run_jobs(work, jobs) if outcome.state == "done"}
    accuracy = timing = 0.0
    for cell, contestant in cells:
        both = found.get(f"{contestant.name} {_family(cell)}")
        if not isinstance(both, list) or not both:
            continue
        count = step_count(case_of(cell).scene, cell.step_seconds)
        recorded, building, moving = _at(both, count)
        accuracy += recorded
        if cell.case in timed and cell.phase == phase:
            timing += (rounds + 1) * (building + moving)
    return Estimate(accuracy, timing, jobs)


def _family(cell: Cell) -> str:
    return cell.case.partition("[")[0]


def _at(both: Sequence[Sample], count: int) -> tuple[float, float, float]:
    """Seconds of a cell of so many steps: the straight line through the trials, from the shorter one on."""
    (n, recorded, building, moving), (m, more_recorded, _, more_moving) = both[0], both[-1]
    if m == n:
        return recorded, building, moving
    share = (count - n) / (m - n)
    slope = max(more_recorded - recorded, 0.0), max(more_moving - moving, 0.0)
    return max(recorded + share * slope[0], 0.0), building, max(moving + share * slope[1], 0.0)


def samples(entry: Entry) -> list[Sample]:
    """What a child measures of one case: nothing where the engine does not run it."""
    cell, contestant = entry
    found: list[Sample] = []
    try:
        _trial(cell, contestant, TRIALS[0])  # imports and compiles
        found = [_best(_trial(cell, contestant, step), _trial(cell, contestant, step)) for step in TRIALS]
    except (Unsupported, Unavailable):
        return []
    return found


def _best(a: Sample, b: Sample) -> Sample:
    """The faster of two trials, part by part: other work only adds."""
    return a[0], min(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])


def _trial(cell: Cell, contestant: Contestant, step: str) -> Sample:
    trial = replace(cell, step=step)
    count = step_count(case_of(trial).scene, trial.step_seconds)
    clock = time.perf_counter
    begun = clock()
    engine = build(trial, contestant)
    built = clock()
    try:
        engine.advance(count)
    finally:
        moved = clock()
        engine.close()
    again = clock()
    run_cell((trial, contestant))
    return count, clock() - again, built - begun, moved - built
