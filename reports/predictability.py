"""How long a motion can be known: perturbed copies, the growth of their spread, and the horizon.

Copies of 1e-12 ... 1e-3 of the scene's length off are run beside the original. Where their spread grows exponentially,
the size of the copies decides when it reaches 1 % of the scene; extrapolated to the size of round-off, that is the
horizon t*: nobody's truth is known beyond. Where it grows in proportion to time, there is none within the run.
The finest reference runs the copies where it supports the scene: the exact runner, else the stepped one, whose own two
finest steps must agree as well; else the contestant itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from impactbench.adapters.contestants import Contestant, select
from impactbench.reports.compare import law_of
from impactbench.reports.retold import Trial
from impactbench.scenarios import transforms
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Floats, Trajectory
from impactbench.scenarios.truth import Case

SIZES = (1e-12, 1e-9, 1e-6, 1e-3)
COPIES = 3
SEED = 20240
KNOWN, ALIGNED = 0.01, 10.0
ROUNDING = 2.0**-50
"""What a run's first state is off by, next to the scene: a few rounded operations."""
FINEST = 1 / 1920
READINGS = 500
"""Of a run without steps."""


@dataclass(frozen=True)
class Horizon:
    """time [s]: t*, at most the run's duration; `reached` says whether it lies within.

    growth: `exponential`, `linear` or `none`. rate [1/s]: of the exponential, or of the copies' own size a second.
    amplification: largest spread of the smallest copies next to their size. runner: who ran the copies.
    """

    time: float
    reached: bool
    growth: str
    rate: float
    amplification: float
    runner: str
    seed: int = SEED


@dataclass(frozen=True, eq=False)
class Copy:
    """Spread of one perturbed copy next to the scene's length, at all times; its running maximum, so that a moment in
    which paths cross does not count as agreement.
    """

    size: float
    times: Floats
    spread: Floats

    def reaches(self, level: float) -> float | None:
        above = np.flatnonzero(self.spread >= level)
        return float(self.times[above[0]]) if len(above) else None


def horizon(case: Case, law: Law | None = None, contestant: Contestant | None = None) -> Horizon:
    """The case's horizon. `contestant` runs the copies where the reference cannot, or where it is asked for itself.

    Raises Unsupported where nobody can run the scene.
    """
    scene = case.scene
    chosen = law or (law_of(contestant, case, None) if contestant else scene.laws[0])
    for trial, finer, name in _runners(scene, chosen, contestant):
        try:
            base = trial.run(scene)
            copies = spreads(trial, base)
            apart = None if finer is None else _apart(scene, base, finer)
        except Unsupported:
            continue
        return judge(scene, copies, apart, name)
    others = "" if contestant else "; name a contestant to run the copies"
    raise Unsupported(f"{contestant.name if contestant else 'the reference'} does not support the scene{others}")


def _runners(scene: Scene, law: Law, contestant: Contestant | None) -> list[tuple[Trial, Trial | None, str]]:
    exact, stepped = (select([f"reference/{profile}"])[0] for profile in ("exact", "stepped"))
    reading = Trial(exact.load(), exact.profile, law, scene, scene.duration / READINGS)
    coarse = Trial(stepped.load(), stepped.profile, law, scene, 2 * FINEST)
    runners: list[tuple[Trial, Trial | None, str]] = [
        (reading, None, exact.name),
        (coarse, replace(coarse, step=FINEST), stepped.name),
    ]
    if contestant is None:
        return runners
    own = Trial(contestant.load(), contestant.profile, law, scene, 2 * FINEST)
    return [(own, replace(own, step=FINEST), contestant.name)]


def spreads(trial: Trial, base: Trajectory) -> list[Copy]:
    """Copies of every size, their places and velocities off in random directions along the axes that move."""
    scene, random = trial.scene, np.random.default_rng(SEED)
    start, found = base.state(0), []
    moves = np.isin(np.arange(3), scene.model.axes)
    for size in SIZES:
        for _ in range(COPIES):
            x, v = (random.normal(size=start.positions.shape) * moves for _ in range(2))
            x *= size * scene.length / np.linalg.norm(x, axis=1).max()
            v *= size * scene.speed / np.linalg.norm(v, axis=1).max()
            off = replace(start, positions=start.positions + x, velocities=start.velocities + v)
            run = trial.run(transforms.restarted(scene, off))
            distance = np.linalg.norm(run.positions - base.positions, axis=2).max(axis=1) / scene.length
            finite = np.where(np.isfinite(distance), distance, np.inf)
            found.append(Copy(size, base.times, np.maximum.accumulate(finite)))
    return found


def _apart(scene: Scene, base: Trajectory, finer: Trial) -> float | None:
    """The time at which the run and that of half its step are 1 % apart."""
    run = finer.run(scene)
    count = min(len(base.times), (len(run.times) + 1) // 2)
    distance = np.linalg.norm(run.positions[::2][:count] - base.positions[:count], axis=2).max(axis=1) / scene.length
    above = np.flatnonzero(~(distance < KNOWN))
    return float(base.times[above[0]]) if len(above) else None


def judge(scene: Scene, copies: Sequence[Copy], apart: float | None, runner: str) -> Horizon:
    growth, rate = growth_of(copies)
    time = scene.duration
    if growth == "exponential":
        time = min(time, extrapolated(copies, rate))
    if apart is not None:
        time = min(time, apart)
    smallest = min(copy.size for copy in copies)
    amplification = float(np.median([copy.spread[-1] / copy.size for copy in copies if copy.size == smallest]))
    return Horizon(time, time < scene.duration, growth, rate, amplification, runner)


def growth_of(copies: Sequence[Copy]) -> tuple[str, float]:
    """The law of growth and its rate [1/s], from where the spread is below 1 %: a straight line through its logarithm
    or through itself, whichever leaves the smaller squares of the logarithm.
    """
    fits = []
    for copy in copies:
        small = (copy.times > 0) & (copy.spread > 0) & (copy.spread < KNOWN)
        t, spread = copy.times[small], copy.spread[small]
        if len(t) < 5 or spread[-1] < 2 * spread[0]:
            continue
        # At first the copies line up with what grows: only then is the growth a straight line.
        aligned = spread > ALIGNED * copy.size
        long = spread[-1] > ALIGNED**2 * copy.size and aligned.sum() >= 5
        if long:
            t, spread = t[aligned], spread[aligned]
        slope, level = np.polyfit(t, np.log(spread), 1)
        climb, start = np.polyfit(t, spread, 1)
        line = np.maximum(start + climb * t, spread[0] / 2)
        left = [float(np.mean((np.log(spread) - fit) ** 2)) for fit in (slope * t + level, np.log(line))]
        # Less than two decades tell no exponential.
        fits.append((left[0] if long else np.inf, left[1], float(slope), float(climb) / copy.size))
    if len(fits) < len(copies) / 2:
        return "none", 0.0
    exponential, linear, slope, climb = np.median(fits, axis=0)
    return ("exponential", float(slope)) if exponential < linear else ("linear", float(climb))


def extrapolated(copies: Sequence[Copy], rate: float) -> float:
    """When a copy off by round-off would be off by 1 %, from the smallest copies."""
    size = min(copy.size for copy in copies)
    times = []
    for copy in copies:
        if copy.size == size:
            known = copy.reaches(KNOWN)
            # One that never gets there goes on from its end at the same rate.
            rest = 0.0 if known is not None else np.log(KNOWN / copy.spread[-1]) / rate
            times.append((float(copy.times[-1]) if known is None else known) + rest)
    return float(np.median(times)) + float(np.log(size / ROUNDING)) / rate


def try_case(argument: tuple[Scene | str, Law | None, Contestant | None]) -> dict[str, Any]:
    """The horizon as plain data. Runs inside a child process, which knows catalogue cases by name."""
    from impactbench.reports.cell import case_named
    from impactbench.scenarios.engine import Unavailable
    from impactbench.scenarios.scene_file import case_of

    named, law, contestant = argument
    case = case_named(named) if isinstance(named, str) else case_of(named)
    try:
        return {"state": "ok", "reason": "", **asdict(horizon(case, law, contestant))}
    except (Unsupported, Unavailable) as why:
        return {"state": "unsupported", "reason": str(why)}
