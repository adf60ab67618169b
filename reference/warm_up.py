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


def warm_up(part: str | None = None) -> None:
    """The kernels of the scenes that are compared, or one of the `PARTS` of them."""
    with _no_collection():
        for name, run in PARTS.items():
            if part in (None, name):
                run()


def _fall(runner: type[Stepped | Exact], profile: str) -> None:
    """A ball falls on a floor under either law."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.0, 0.0, 1.0))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    scene = Scene("warm_up", (ball, floor), 1.0, Model((2,), gravity=True), 1.0, 1.0, 1.0, gravity=(0.0, 0.0, -9.81))
    for law in scene.laws:
        runner(scene, law, profile, scene.model, STEP).advance(1)


PARTS: dict[str, Callable[[], None]] = {
    "particles": lambda: _fall(Stepped, "stepped"),
    "exact": lambda: _fall(Exact, "exact"),
    "gas": lambda: _step(gas(LARGE + 1, 2)),
}


def warm_up_crowds() -> None:
    """The kernels of crowds besides: gases along one and three axes, and a heap."""
    with _no_collection():
        _step(gas(LARGE + 1, 1), gas(LARGE + 1, 3), heap(LARGE))


def _step(*scenes: Scene) -> None:
    for scene in scenes:
        for law in scene.laws:
            Stepped(scene, law, "stepped", scene.model, STEP).advance(1)


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
