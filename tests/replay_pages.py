"""Pages with replays for the browser tests: one of real runs, one of 300 made-up boxes."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from impactbench.adapters import contestants
from impactbench.reports import page, replay, replay_record
from impactbench.reports.cell import Cell
from impactbench.reports.compare import Plan, compare
from impactbench.scenarios import catalogue
from impactbench.scenarios.records import Body, Box, HalfSpace, Model, Scene
from impactbench.scenarios.trajectory import Trajectory
from impactbench.scenarios.truth import Case, Truth
from test_page import Maker, case, document

BALL, WALL = "bouncing_ball[bounciness=0.8]", "static_wall[bounciness=1]"
STEPS = ("1/30", "1/60", "1/240")


def real(path: Path) -> dict[str, Any]:
    """Write the report of two cases on three contestants; return its document."""
    engines = contestants.select(["mujoco/default", "pymunk/default", "pymunk/tuned"])
    plan = Plan(catalogue.select([BALL, WALL]), engines, STEPS, jobs=2, timing="none", replay=True)
    found = json.loads(json.dumps(compare(plan, "impactbench compare")))
    page.write_page(found, path)
    return dict(found)


def boxes(path: Path, count: int = 300, names: tuple[str, ...] = ("a/one", "b/two", "c/three", "d/four")) -> None:
    """Write a report whose replay holds `count` tumbling boxes for each name, in the plane's half-space."""
    side = math.ceil(math.sqrt(count))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    cells = [(float(i % side), float(i // side), 1.0) for i in range(count)]
    bodies = [floor, *(Body(f"box {i}", Box((0.3, 0.2, 0.1)), 1.0, place) for i, place in enumerate(cells))]
    model = Model((0, 1, 2), rotation=True, gravity=True)
    scene = Scene("crowd", tuple(bodies), 2.0, model, length=1.0, speed=1.0, energy=10.0)
    crowd = Case(scene, {"nc": Truth("invariant", lambda _time: None)})
    entries = [(crowd, [tumbling(scene, name, seed) for seed, name in enumerate(names)], [])]
    maker = Maker()
    for name in names:
        maker.ladder("crowd", name, 0.1, 1e-4)
    page.write_page(document(maker, [case("crowd", "crowd")]) | {"replays": replay.fitted(entries)}, path)


def tumbling(scene: Scene, name: str, seed: int) -> dict[str, Any]:
    """A recorded run in which every box moves on a wave and turns at its own rate."""
    random, count = np.random.default_rng(seed), len(scene.movable)
    times = np.arange(121) / 60
    start = replay_record.start_of(scene).positions[0]
    phase, rate = random.uniform(0, 6, count), random.uniform(-3, 3, (count, 3))
    places = start + 0.4 * np.sin(times[:, None, None] * 3 + phase[:, None]) * [0.3, 0.3, 1.0]
    speeds = 1.2 * np.cos(times[:, None, None] * 3 + phase[:, None]) * [0.3, 0.3, 1.0]
    angle = np.linalg.norm(rate, axis=1) * times[:, None]
    axis = rate / np.linalg.norm(rate, axis=1)[:, None]
    turns = np.concatenate([np.cos(angle / 2)[..., None], np.sin(angle / 2)[..., None] * axis], axis=2)
    run = Trajectory(times, places, speeds, turns, np.broadcast_to(rate, places.shape))
    cell = Cell("crowd", "nc", name, "minimal", "1/60")
    recorded = replay_record.described(Case(scene, {"nc": Truth("invariant", lambda _time: None)}), "nc", run, 1)
    recorded["levels"] = random.integers(0, 5, recorded["levels"].shape)
    return recorded | {"cell": cell, "stepless": False, "state": "ok"}
