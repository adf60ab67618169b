"""Benchmarks anyone can run: the reference against the engines on the same scenes, and against its own size.

Ratios carry over to other machines, nanoseconds do not. Engines run tuned, in the smallest model of the scene, on one
thread, through the ordinary adapters.
"""

from __future__ import annotations

import difflib
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from typing import Any

from impactbench.reports.bench_heap import heap
from impactbench.reports.bench_lane import lane
from impactbench.reports.bench_model import smallest, statics
from impactbench.reports.bench_race import OURS, Race, run_race
from impactbench.scenarios import crowds

SOLID = (OURS, "pybullet/tuned", "mujoco/tuned")
PLANAR = (OURS, "pymunk/tuned")
STEP = 1 / 240
Part = dict[str, Any]


def gas(quick: bool) -> Part:
    """1000 elastic spheres in a box, 3D."""
    return run_race(Race(crowds.gas(1000), SOLID, STEP, *((240, 6) if quick else (2400, 24))))


def discs(quick: bool) -> Part:
    """1000 elastic discs in a square, against pymunk."""
    return run_race(Race(crowds.gas(1000, 2, 0.2), PLANAR, STEP, *((480, 6) if quick else (2400, 24))))


def stack(quick: bool) -> Part:
    """A column of 10 boxes that falls 1 cm a gap and comes to rest."""
    return run_race(Race(crowds.column(10), (*SOLID, "pymunk/tuned"), STEP, *((240, 6) if quick else (2400, 24))))


def wall(quick: bool) -> Part:
    """A wall of 10 x 10 bricks in running bond that falls 1 cm a gap and comes to rest."""
    return run_race(Race(crowds.wall(10, 10), (*SOLID, "pymunk/tuned"), STEP, *((240, 6) if quick else (1200, 24))))


def exact(quick: bool) -> Part:
    """Impacts per second of the exact runner, elastic spheres in a box."""
    from impactbench.reference.exact_contestant import Exact

    rows = []
    for count in (100, 1000):
        scene = crowds.gas(count)
        engine = Exact(scene, "doc", "exact", scene.model, 0.01)
        engine.advance(1)
        before, begin = sum(engine.impacts), time.perf_counter()
        engine.advance((200 if quick else 2000) * 1000 // count)
        seconds = time.perf_counter() - begin
        events = sum(engine.impacts) - before
        rows.append({"bodies": count, "impacts": events, "impacts per second": events / seconds})
    return {"rows": rows}


def growth(quick: bool) -> Part:
    """Cost per body and step, and memory per body, from 1e2 to 1e6 spheres; sizes take turns.

    What grows besides memory traffic: of few spheres many have a wall where others have neighbours, and so fewer pairs.
    """
    from impactbench.reference.contestant import Stepped

    sizes = (100, 1000, 10_000, 100_000) if quick else (100, 1000, 10_000, 100_000, 1_000_000)
    built: dict[int, tuple[Stepped, float]] = {}
    for count in sizes:
        begin = time.perf_counter()
        scene = crowds.gas(count)
        engine = Stepped(scene, "doc", "stepped", scene.model, STEP)
        built[count] = engine, time.perf_counter() - begin
        engine.advance(max(60, 20_000 // count))  # past the first list, and into the cache
    before, took = {count: built[count][0].figures() for count in sizes}, dict.fromkeys(sizes, 0)
    costs: dict[int, list[float]] = {count: [] for count in sizes}
    for _ in range(3 if quick else 7):
        for count in sizes:
            steps = max(60, 2_000_000 // count)
            begin = time.perf_counter()
            built[count][0].advance(steps)
            costs[count].append((time.perf_counter() - begin) / steps / count * 1e9)
            took[count] += steps
    rows = []
    for count in sizes:
        engine, seconds = built[count]
        after = engine.figures()
        rows.append(
            {
                "bodies": count,
                "ns per body and step": sorted(costs[count])[len(costs[count]) // 2],
                "least": min(costs[count]),
                "pairs a body": (after["pairs looked at"] - before[count]["pairs looked at"]) / took[count] / count,
                "steps a list": took[count] / (after["builds"] - before[count]["builds"]),
                "bytes per body": after["bytes"] / count,
                "build [s]": seconds,
            }
        )
    reference = next(row for row in rows if row["bodies"] == 1000)
    ratios = {key: rows[-1][key] / reference[key] for key in ("ns per body and step", "least")}
    return {"rows": rows, **{f"growth from 1e3 to the largest, {key}": ratio for key, ratio in ratios.items()}}


def pairs(quick: bool) -> Part:
    """Pairs by rule R2 of spheres, half of them static, and what never looking at two statics saves."""
    from impactbench.reports.bench_pairs import count_pairs

    return count_pairs(200 if quick else 1000, 15)


def startup(quick: bool) -> Part:
    """Start of a process and first step: kernels compiled anew (once per version), and loaded from disk."""
    code = (
        "import time; a = time.perf_counter(); from impactbench.reference.warm_up import warm_up; "
        "b = time.perf_counter(); warm_up(); print(b - a, time.perf_counter() - b, time.process_time())"
    )
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("from disk",) if quick else ("compiled anew", "from disk"):
            own = {} if quick else {"NUMBA_CACHE_DIR": folder}
            done = subprocess.run(
                [sys.executable, "-c", code], env={**os.environ, **own}, capture_output=True, text=True, check=True
            )
            imports, kernels, processor = map(float, done.stdout.split())
            rows.append(
                {"kernels": name, "imports [s]": imports, "run once [s]": kernels, "processor time [s]": processor}
            )
    return {"rows": rows}


BENCHMARKS: dict[str, Callable[[bool], Part]] = {
    "gas": gas,
    "discs": discs,
    "column": stack,
    "wall": wall,
    "pairs": pairs,
    "exact": exact,
    "growth": growth,
    "heap": heap,
    "startup": startup,
    "lane": lane,
    "smallest": smallest,
    "statics": statics,
}


def chosen(names: Sequence[str]) -> list[str]:
    """The benchmarks asked for, all if none; ValueError names the known ones."""
    for name in names:
        if name not in BENCHMARKS:
            near = difflib.get_close_matches(name, BENCHMARKS, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(f"unknown benchmark {name!r}{hint} Known: {', '.join(BENCHMARKS)}")
    return [name for name in BENCHMARKS if name in names or not names]


def measure(name: str, quick: bool) -> Part:
    """One benchmark, in this process."""
    run = BENCHMARKS[name]
    begin = time.perf_counter()
    part = run(quick)
    return {"what": (run.__doc__ or "").partition("\n")[0], **part, "took [s]": time.perf_counter() - begin}


def machine() -> dict[str, Any]:
    """Where this was measured, as far as speeds depend on it."""
    from importlib.metadata import version

    from impactbench.adapters.contestants import CONTESTANTS

    engines = {c.distribution: c.version() for c in CONTESTANTS}
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "python": platform.python_version(),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "load before": load,
        "versions": {**engines, "numba": version("numba")},
    }
