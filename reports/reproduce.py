"""Published figures reproduced: the same scene through the ordinary adapters, in the mode that stands for the engine
measured then.

A check of the adapters and the harness, not of the engines: who agrees in all digits does the same arithmetic.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from impactbench.adapters.contestants import CONTESTANTS, Contestant
from impactbench.adapters.isolation import Job, Outcome, run_jobs
from impactbench.reports.cell import record, step_count
from impactbench.reports.conservation import energies, spin_momenta
from impactbench.reports.terminal import table
from impactbench.scenarios.engine import Engine, Unavailable, Unsupported
from impactbench.scenarios.published import BENCHMARKS, DIGITS, UNITS, Benchmark, Cell, Measure, cells, half_step
from impactbench.scenarios.trajectory import Floats, Trajectory

REQUIRED = 4
"""Digits a figure must agree to."""
LIMIT = 300.0
"""Seconds one run may take: a hundred times the slowest healthy one."""

STAND_INS = {
    ("bouncing", "ODE"): ("pybullet/maximal", "pymunk/default"),
    ("bouncing", "Bullet"): ("pybullet/multibody",),
    ("tumbling", "ODE"): ("pybullet/multibody", "mujoco/tuned"),
    ("tumbling", "Bullet"): ("pybullet/maximal", "mujoco/implicit", "mujoco/implicitfast"),
    ("tumbling", "none"): ("mujoco/rk4",),
}
"""Which contestants do the arithmetic of an engine measured then. `none`: no figure was published."""

LARGEST_STEP = {("bouncing", "pymunk/default"): 0.01}
"""Beyond, a fall at 9.8 m/s overlaps by more than pymunk's slop of 0.1 m, is pushed out and is no longer the same."""


class UnknownName(ValueError):
    """A name that is neither a benchmark, a project nor a contestant here."""


@dataclass(frozen=True)
class Row:
    cell: Cell
    contestant: str
    state: str
    reason: str = ""
    measured: float | None = None
    settings: dict[str, object] = field(default_factory=dict)

    @property
    def digits(self) -> int | None:
        """Digits agreed; None where nothing was published or measured."""
        if self.cell.value is None or self.measured is None:
            return None
        return digits_agreed(self.cell.value, self.measured)

    @property
    def holds(self) -> bool:
        return self.state == "ok" and (self.digits is None or self.digits >= REQUIRED)


def digits_agreed(published: float, measured: float) -> int:
    """Leading digits, up to those printed, that are the same to half a unit of the last."""
    first = math.floor(math.log10(abs(published)))
    off = abs(measured - published)
    return next((n for n in range(DIGITS, 0, -1) if off <= 0.5 * 10.0 ** (first - n + 1)), 0)


def plan(names: Sequence[str] = ()) -> list[tuple[Cell, str]]:
    """Each published figure with each contestant that stands for its engine; `names` filters, globs allowed."""
    tumbling = next(benchmark for benchmark in BENCHMARKS if benchmark.name == "tumbling")
    measures: tuple[Measure, ...] = ("position", "angular_momentum", "energy")
    wanted = [*cells(), *(Cell(tumbling, "none", 1e-3, measure, None) for measure in measures)]
    entries = [
        (cell, name)
        for cell in wanted
        for name in STAND_INS[cell.benchmark.name, cell.engine]
        if cell.step <= LARGEST_STEP.get((cell.benchmark.name, name), math.inf)
    ]
    known = [entry_names(cell, name) for cell, name in entries]
    for text in names:
        if not any(fnmatchcase(each, text) for words in known for each in words):
            raise _unknown(text, sorted({each for words in known for each in words}))
    return [
        entry
        for entry, words in zip(entries, known, strict=True)
        if not names or any(fnmatchcase(each, text) for each in words for text in names)
    ]


def entry_names(cell: Cell, contestant: str) -> tuple[str, ...]:
    """What an entry can be asked for by."""
    project = cell.benchmark.project
    return (cell.benchmark.name, project, project.rpartition("/")[2], contestant, contestant.partition("/")[0])


def _unknown(text: str, known: list[str]) -> UnknownName:
    near = difflib.get_close_matches(text, known, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    return UnknownName(f"unknown name {text!r}; {hint}known: {', '.join(known)}")


def reproduce(
    entries: Sequence[tuple[Cell, str]], jobs: int, progress: Callable[[str, int, int], None] = lambda *_: None
) -> list[Row]:
    """One run per benchmark, step and contestant, in child processes; a row per figure."""
    runs = {_key(cell, name): (cell.benchmark.name, cell.step, contestant(name)) for cell, name in entries}
    missing = {key: why for key, (_, _, who) in runs.items() if (why := who.availability())}
    work = [
        Job(key, run[2].lane, "impactbench.reports.reproduce:run_benchmark", run, LIMIT)
        for key, run in runs.items()
        if key not in missing
    ]
    found: dict[str, dict[str, Any]] = {k: {"state": "unavailable", "reason": why} for k, why in missing.items()}
    for done, outcome in enumerate(run_jobs(work, jobs), 1):
        found[outcome.key] = _as_found(outcome)
        progress("published figures", done, len(work))
    return [_row(cell, name, found[_key(cell, name)]) for cell, name in entries]


def contestant(name: str) -> Contestant:
    """The engine's contestant, under a profile that the table of contestants need not list."""
    engine, _, profile = name.partition("/")
    return replace(next(known for known in CONTESTANTS if known.engine == engine), profile=profile)


def run_benchmark(argument: tuple[str, float, Contestant]) -> dict[str, Any]:
    """All figures of one run. Runs inside a child process."""
    name, step, who = argument
    benchmark = next(benchmark for benchmark in BENCHMARKS if benchmark.name == name)
    scene = benchmark.scene
    try:
        engine: Engine = who.load()(scene, "nc", who.profile, scene.model, step)
    except Unsupported as why:
        return {"state": "unsupported", "reason": str(why)}
    except Unavailable as why:
        return {"state": "unavailable", "reason": str(why)}
    try:
        trajectory = record(engine, step, step_count(scene, step))
        settings = {key: str(value) for key, value in engine.settings.items()}
    finally:
        engine.close()
    if not trajectory.finite():
        return {"state": "diverged", "reason": "the state is not finite", "settings": settings}
    return {"state": "ok", "settings": settings, "figures": figures(benchmark, trajectory)}


def figures(benchmark: Benchmark, trajectory: Trajectory) -> dict[Measure, float]:
    """The publication's measures, from positions and velocities alone."""
    scene = benchmark.scene
    energy = benchmark.copies * energies(scene, trajectory)
    if benchmark.name == "bouncing":
        return {"energy_square": float(np.mean((energy[:-1] - energy[0]) ** 2))}
    momenta = spin_momenta(scene, trajectory)[:, 0]
    body = scene.bodies[scene.movable[0]]
    parabola = _parabola(trajectory.times, body.position, body.velocity, scene.gravity)
    return {
        "position": _largest(trajectory.positions[:, 0] - parabola),
        "angular_momentum": _largest(momenta - momenta[0]) / float(np.linalg.norm(momenta[0])),
        "energy": float(np.abs(energy / energy[0] - 1).max()),
    }


def _parabola(times: Floats, *terms: tuple[float, float, float]) -> Floats:
    t = times[:, None]
    position, velocity, gravity = (np.array(term) for term in terms)
    return np.asarray(position + velocity * t + gravity * t**2 / 2)


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _key(cell: Cell, name: str) -> str:
    return f"{cell.benchmark.name} {cell.step!r} {name}"


def _as_found(outcome: Outcome) -> dict[str, Any]:
    if outcome.state == "done":
        assert isinstance(outcome.value, dict)
        return outcome.value
    return {"state": outcome.state, "reason": outcome.reason}


def _row(cell: Cell, name: str, found: dict[str, Any]) -> Row:
    measured = found.get("figures", {}).get(cell.measure)
    return Row(cell, name, found["state"], found.get("reason", ""), measured, found.get("settings", {}))


def exit_code(rows: Sequence[Row]) -> int:
    """1: a figure disagrees; 3: none does, but one could not be measured."""
    if any(row.state == "ok" and not row.holds for row in rows):
        return 1
    return 0 if all(row.holds for row in rows) else 3


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    return [
        {
            "benchmark": row.cell.benchmark.name,
            "project": row.cell.benchmark.project,
            "year": row.cell.benchmark.year,
            "table": row.cell.benchmark.table,
            "engine": row.cell.engine,
            "step": row.cell.step,
            "measure": row.cell.measure,
            "unit": UNITS[row.cell.measure],
            "published": row.cell.value,
            "contestant": row.contestant,
            "version": contestant(row.contestant).version(),
            "settings": row.settings,
            "measured": row.measured,
            "digits": row.digits,
            "half_step_offset": half_step(row.cell.benchmark, row.cell.step, row.cell.measure),
            "state": row.state,
            "reason": row.reason,
            "holds": row.holds,
        }
        for row in rows
    ]


COLUMNS = ("engine then", "step [s]", "measure", "now", "published", "measured", "digits", "half-step offset")
NOTE = """\
digits: leading digits agreed to half a unit of the last; six were published, {required} are required.
half-step offset: what semi-implicit Euler scores with perfect impacts. It keeps E - (1/2) m g h v, not E; over elastic
bounces the mean square of the difference is (1/2 M g h)^2 2 g (H - R)/3. In flight positions are off by g h T/2, the
energy by m g^2 h T/2."""


def text(rows: Sequence[Row]) -> str:
    """A table per benchmark, headed by its source."""
    parts = []
    for benchmark in BENCHMARKS:
        mine = [row for row in rows if row.cell.benchmark is benchmark]
        if mine:
            head = f"{benchmark.name}: {benchmark.project} ({benchmark.year}), {benchmark.table}\n{benchmark.question}"
            parts += [head, table(COLUMNS, map(_shown, mine), right=4)]
    failed = [f"{row.contestant}: {row.state} ({row.reason})" for row in rows if row.state != "ok"]
    parts += ["\n".join(dict.fromkeys(failed))] if failed else []
    return "\n\n".join([*parts, NOTE.format(required=REQUIRED), _verdict(rows)])


def _shown(row: Row) -> list[str]:
    cell, unit = row.cell, UNITS[row.cell.measure]
    return [
        cell.engine,
        f"{cell.step:g}",
        cell.measure if unit == "1" else f"{cell.measure} [{unit}]",
        row.contestant,
        _number(cell.value),
        _number(row.measured) if row.state == "ok" else row.state,
        "-" if row.digits is None else f"{row.digits}" + ("" if row.holds else " !"),
        _number(half_step(cell.benchmark, cell.step, cell.measure)),
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.7g}"


def _verdict(rows: Sequence[Row]) -> str:
    judged = [row for row in rows if row.digits is not None]
    agreed = sum(row.holds for row in judged)
    return f"{agreed} of {len(judged)} published figures agree to {REQUIRED} digits or more"
