"""Compile kernels, so that later processes load them from disk.

Every kernel takes its time to compile, so each scene compiles what it runs; what many processes are about to need at
the same moment is compiled here beforehand.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from impactbench.reference.contestant import LARGE, Stepped
from impactbench.reference.exact_contestant import Exact
from impactbench.scenarios.crowds import gas, heap
from impactbench.scenarios.records import Body, HalfSpace, Model, Scene, Sphere

STEP = 1 / 60
COLUMN, TURNING = Model((2,), gravity=True), Model((0, 2), rotation=True, gravity=True)


def warm_up(part: str | None = None) -> None:
    """The kernels of the scenes that are compared, or one of the `PARTS` of them."""
    with _no_collection():
        for name, run in PARTS.items():
            if part in (None, name):
                run()


def _fall(height: float, model: Model = COLUMN) -> Scene:
    """A ball, its centre this high [m], falls on a floor; below its radius of .5 m it overlaps it."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.0, 0.0, height), (0.0, 0.0, -1.0))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    return Scene("warm_up", (ball, floor), 1.0, model, 1.0, 1.0, 1.0, gravity=(0.0, 0.0, -9.81))


def _step(*scenes: Scene) -> None:
    for scene in scenes:
        for law in scene.laws:
            Stepped(scene, law, "stepped", scene.model, STEP).advance(1)


def _fall_exactly() -> None:
    scene = _fall(1.0)
    for law in scene.laws:
        Exact(scene, law, "exact", scene.model, STEP).advance(1)


PARTS: dict[str, Callable[[], None]] = {
    "turning": lambda: _step(_fall(1.0, TURNING), _fall(0.4, TURNING)),
    "exact": _fall_exactly,
    "particles": lambda: _step(_fall(1.0)),
    "gas": lambda: _step(gas(LARGE + 1, 2)),
}
"""The longest first: bodies that turn take a good third of the whole."""


def warm_up_crowds() -> None:
    """The kernels of crowds besides: gases along one and three axes, and a heap."""
    with _no_collection():
        _step(gas(LARGE + 1, 1), gas(LARGE + 1, 3), heap(LARGE))


@contextmanager
def _no_collection() -> Iterator[None]:
    """Compilers make millions of small objects that last: to search them for garbage takes an eighth of the time."""
    usual = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if usual:
            gc.enable()
