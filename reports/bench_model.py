"""What modelling only what a scene needs saves: the smallest model against the full one, statics that never meet."""

from __future__ import annotations

import gc
import time
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from impactbench.adapters import contestants
from impactbench.reports.cell import median_ranks
from impactbench.scenarios.crowds import gas
from impactbench.scenarios.engine import Engine, Unavailable, Unsupported
from impactbench.scenarios.records import FULL, Body, Model, Scene, Sphere
from impactbench.scenarios.trajectory import State

STEP = 1 / 240
BODIES = 1000
STATICS = 2000
Row = dict[str, Any]


def smallest(quick: bool) -> dict[str, Any]:
    """1000 balls on a line, smallest against full model, with and without contacts; both take turns."""
    line = gas(BODIES, 1, 0.8)
    apart = replace(line, name=f"{line.name}, no contacts", collide=False)
    rows = []
    for scene, name in product((apart, line), ("mujoco/tuned", "mujoco/default", "pymunk/tuned")):
        rows.append({"contestant": name, "contacts": "yes" if scene.collide else "no", **_models(scene, name, quick)})
    return {"step [s]": STEP, "rows": rows}


def _models(scene: Scene, name: str, quick: bool) -> Row:
    (contestant,) = contestants.select([name])
    try:
        kind = contestant.load()
        both = [kind(scene, "nc", contestant.profile, model, STEP) for model in (scene.model, FULL)]
    except (Unavailable, Unsupported) as why:
        return {"missing": str(why)}
    seconds = take_turns(both, 10 if quick else 30, 4)
    small, full = (engine.read() for engine in both)
    for engine in both:
        engine.close()
    return {
        "ms per step": 1e3 * float(np.median(seconds[0])) / 4,
        "in full": 1e3 * float(np.median(seconds[1])) / 4,
        **ratio(seconds[1], seconds[0]),
        "largest difference [lengths]": difference(small, full) / scene.length,
    }


def take_turns(engines: list[Engine], rounds: int, steps: int) -> list[list[float]]:
    """Seconds of `steps` steps of each engine in each round, order alternating; a round before them warms up."""
    seconds: list[list[float]] = [[] for _ in engines]
    gc.disable()
    try:
        for turn in range(rounds + 1):
            order = range(len(engines)) if turn % 2 else reversed(range(len(engines)))
            for k in order:
                start = time.perf_counter()
                engines[k].advance(steps)
                if turn:
                    seconds[k].append(time.perf_counter() - start)
                else:
                    engines[k].read()
    finally:
        gc.enable()
    return seconds


def ratio(dear: list[float], cheap: list[float]) -> Row:
    """How many times faster, with the 95 % interval of the median."""
    found = sorted(a / b for a, b in zip(dear, cheap, strict=True))
    low, high = median_ranks(len(found))
    return {"times faster": float(np.median(found)), "low": found[low], "high": found[high]}


def difference(a: State, b: State) -> float:
    """Largest distance [m] of two states' bodies."""
    return float(np.linalg.norm(a.positions - b.positions, axis=1).max())


def statics(quick: bool) -> dict[str, Any]:
    """2000 statics that all overlap their neighbours beside ten balls: with filters, and where statics may meet."""
    scene = rubble(STATICS)
    rounds = 10 if quick else 40
    rows: list[Row] = []
    for name in ("pybullet/tuned", "mujoco/tuned", "pymunk/tuned"):
        (contestant,) = contestants.select([name])
        try:
            kind = contestant.load()
        except Unavailable as why:
            rows.append({"contestant": name, "missing": str(why)})
            continue
        seconds, ends = [], []
        # One after the other: a process holds one world of PyBullet.
        for meet in (False, True) if contestant.engine == "pybullet" else (False,):
            engine = kind(scene, "nc", contestant.profile, scene.model, STEP)
            if meet:
                _let_statics_meet(engine)
            seconds += take_turns([engine], rounds, 4)
            ends.append(engine.read())
            engine.close()
        row: Row = {"contestant": name, "ms per step": 1e3 * float(np.median(seconds[0])) / 4}
        if len(ends) > 1:
            row["statics may meet"] = 1e3 * float(np.median(seconds[1])) / 4
            row |= ratio(seconds[1], seconds[0])
            row["largest difference [lengths]"] = difference(*ends) / scene.length
        else:
            row["statics may meet"] = "never, by the engine's own rule"
        rows.append(row)
    return {"statics": STATICS, "step [s]": STEP, "rows": rows}


def rubble(count: int, movers: int = 10) -> Scene:
    """`count` static balls on a square lattice, overlapping their neighbours, and `movers` that pass beside them."""
    side = int(np.ceil(np.sqrt(count)))
    ball, spacing = Sphere(0.5), 0.4
    fixed = [Body(f"static {k}", ball, None, (spacing * (k % side), spacing * (k // side), 0.0)) for k in range(count)]
    moving = [Body(f"ball {k}", ball, 1.0, (3.0 * k, -3.0, 0.0), (1.0, 0.0, 0.0)) for k in range(movers)]
    return Scene(
        name=f"rubble[statics={count}]",
        bodies=(*fixed, *moving),
        duration=1.0,
        model=Model((0, 1)),
        length=1.0,
        speed=1.0,
        energy=0.5 * movers,
    )


def _let_statics_meet(engine: Any) -> None:
    """Give every body of a PyBullet world the same group and mask: what one gets who sets no filter on them."""
    import pybullet as pb

    for index in range(pb.getNumBodies(engine._c)):
        pb.setCollisionFilterGroupMask(pb.getBodyUniqueId(index, engine._c), -1, 1, 1, physicsClientId=engine._c)
