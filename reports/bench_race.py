"""Paired, interleaved timing: every contestant goes through the same scene in the same parts, taking turns.

A ratio is taken within each part, where all had the same machine; the figure is their median, with the interval that
holds the true median with at least 95 % (order statistics).
"""

from __future__ import annotations

import gc
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from impactbench.adapters import contestants
from impactbench.reports.cell import median_ranks
from impactbench.scenarios.engine import Engine, Unavailable
from impactbench.scenarios.records import HalfSpace, Scene, Sphere
from impactbench.scenarios.trajectory import Floats, State

OURS = "reference/stepped"
MOST = 1500
"""Bodies up to which overlaps are looked for in every pair."""


@dataclass(frozen=True)
class Race:
    """A scene and who runs it: contestants by name, at one step [s], `steps` in `parts`."""

    scene: Scene
    names: tuple[str, ...]
    step: float
    steps: int
    parts: int


def run_race(race: Race) -> dict[str, Any]:
    """One row a contestant: steps/s, how many times faster ours is, energy and overlap; or why it did not run."""
    engines: dict[str, Engine] = {}
    rows: list[dict[str, Any]] = []
    for name in race.names:
        (contestant,) = contestants.select([name])
        try:
            kind = contestant.load()
            engines[name] = kind(race.scene, "nc", contestant.profile, race.scene.model, race.step)
        except Unavailable as why:
            rows.append({"contestant": name, "missing": str(why)})
    starts = {name: engine.read() for name, engine in engines.items()}
    seconds, overlaps = _take_turns(race, engines)
    for name, engine in engines.items():
        rows.append(
            {
                "contestant": name,
                "steps per second": race.steps / race.parts / float(np.median(seconds[name])),
                **({} if name == OURS or OURS not in engines else _ratio(seconds[name], seconds[OURS])),
                **conservation(race.scene, starts[name], engine.read()),
                **({"deepest overlap after steps [m]": overlaps[name]} if name in overlaps else {}),
                **_inside(engine, race.step),
            }
        )
        engine.close()
    return {"scene": race.scene.name, "step [s]": race.step, "steps": race.steps, "parts": race.parts, "rows": rows}


def _take_turns(race: Race, engines: dict[str, Engine]) -> tuple[dict[str, list[float]], dict[str, float]]:
    """Seconds of each part, and the deepest overlap seen at the parts' ends."""
    seconds: dict[str, list[float]] = {name: [] for name in engines}
    overlaps: dict[str, float] = {}
    each = race.steps // race.parts
    gc.disable()
    try:
        for part in range(race.parts):
            for name in list(engines) if part % 2 else list(reversed(engines)):
                begin = time.perf_counter()
                engines[name].advance(each)
                seconds[name].append(time.perf_counter() - begin)
                if len(race.scene.bodies) <= MOST and all(
                    isinstance(race.scene.bodies[i].shape, Sphere) for i in race.scene.movable
                ):
                    seen = deepest(race.scene, engines[name].read().positions)
                    overlaps[name] = max(overlaps.get(name, 0.0), seen)
    finally:
        gc.enable()
    return seconds, overlaps


def _ratio(theirs: Sequence[float], ours: Sequence[float]) -> dict[str, float]:
    ratios = sorted(t / o for t, o in zip(theirs, ours, strict=True))
    low, high = median_ranks(len(ratios))
    return {"ratio": float(np.median(ratios)), "ratio low": ratios[low], "ratio high": ratios[high]}


def conservation(scene: Scene, start: State, end: State) -> dict[str, float]:
    """Change of the total energy, next to the energy at the start or the scene's own scale."""
    mass = np.array([scene.bodies[i].mass for i in scene.movable], dtype=np.float64)
    pull = np.array(scene.gravity) if scene.model.gravity else np.zeros(3)

    def energy(state: State) -> tuple[float, float]:
        motion = float(mass @ (state.velocities**2).sum(axis=1) / 2)
        return motion, motion - float(mass @ (state.positions @ pull))

    motion, before = energy(start)
    return {"energy change": (energy(end)[1] - before) / max(motion, scene.energy), "speed at end [m/s]": fastest(end)}


def fastest(state: State) -> float:
    return float(np.sqrt((state.velocities**2).sum(axis=1)).max(initial=0.0))


def deepest(scene: Scene, places: Floats) -> float:
    """Deepest overlap [m] of spheres with one another and with walls, from positions [n, 3] alone; 0 where none."""
    radii = np.array([shape.radius for i in scene.movable if isinstance(shape := scene.bodies[i].shape, Sphere)])
    found = 0.0
    for i in range(len(places) - 1):
        apart = np.sqrt(((places[i + 1 :] - places[i]) ** 2).sum(axis=1))
        found = max(found, float((radii[i] + radii[i + 1 :] - apart).max()))
    for i in scene.statics:
        body = scene.bodies[i]
        if isinstance(body.shape, HalfSpace):
            height = (places - np.array(body.position)) @ np.array(body.shape.normal)
            found = max(found, float((radii - height).max()))
    return found


def _inside(engine: Engine, step: float) -> dict[str, float]:
    """What only our runner can say: the overlap before projection, next to the way of the fastest closing pair."""
    figures: dict[str, float] = getattr(engine, "figures", dict)()
    if not figures:
        return {}
    return {
        "deepest overlap before projection [m]": figures["deepest before projection"],
        "step times closing speed [m]": step * figures["largest closing speed"],
    }
