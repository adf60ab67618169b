"""Compile kernels, so that later processes load them from disk.

Every kernel takes its time to compile, so each scene compiles what it runs; what many processes are about to need at
the same moment is compiled here beforehand.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from impactbench.reference.contestant import LARGE, Stepped
from impactbench.reference.exact_contestant import Exact
from impactbench.scenarios.crowds import gas, heap
from impactbench.scenarios.records import Body, HalfSpace, Model, Scene, Sphere

STEP = 1 / 60


def warm_up(_: object = None) -> None:
    """The kernels of the scenes that are compared: a ball falls on a floor under either law, a gas in the plane."""
    ball = Body("ball", Sphere(0.5), 1.0, (0.0, 0.0, 1.0))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    scene = Scene("warm_up", (ball, floor), 1.0, Model((2,), gravity=True), 1.0, 1.0, 1.0, gravity=(0.0, 0.0, -9.81))
    with _no_collection():
        for law in scene.laws:
            Exact(scene, law, "exact", scene.model, STEP).advance(1)
        _step(scene, gas(LARGE + 1, 2))


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
