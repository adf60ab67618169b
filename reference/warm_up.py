"""Compile the kernels of all runners, so that later processes load them from disk.

Those of the bodies that turn are half of it: some 40 s of one core.
"""

from __future__ import annotations

from dataclasses import replace

from impactbench.reference.contestant import LARGE, Stepped
from impactbench.reference.exact_contestant import Exact
from impactbench.scenarios.crowds import gas
from impactbench.scenarios.records import Body, HalfSpace, Model, Scene, Sphere


def warm_up(_: object = None) -> None:
    """Run every kernel once: a ball falls on a floor under either law, alone and as a body that turns, and a gas moves
    along one, two, three axes.
    """
    ball = Body("ball", Sphere(0.5), 1.0, (0.0, 0.0, 1.0))
    floor = Body("floor", HalfSpace((0.0, 0.0, 1.0)), None, (0.0, 0.0, 0.0))
    scene = Scene("warm_up", (ball, floor), 1.0, Model((2,), gravity=True), 1.0, 1.0, 1.0, gravity=(0.0, 0.0, -9.81))
    for law in scene.laws:
        Stepped(scene, law, "stepped", scene.model, 1 / 60).advance(1)
        Exact(scene, law, "exact", scene.model, 1 / 60).advance(1)
    turning = replace(scene, model=Model((0, 2), rotation=True, gravity=True))
    overlapping = replace(turning, bodies=(replace(ball, position=(0.0, 0.0, 0.4), velocity=(0.0, 0.0, -1.0)), floor))
    for rigid in (turning, overlapping):
        Stepped(rigid, "nc", "stepped", rigid.model, 1 / 60).advance(1)
    for dimension in (1, 2, 3):
        crowd = gas(LARGE + 1, dimension)
        Stepped(crowd, "doc", "stepped", crowd.model, 1 / 60).advance(1)
