"""Contestants for the gate: pymunk's tuned profile with one fault each."""

from __future__ import annotations

import time
from dataclasses import replace

from impactbench.adapters.pymunk_adapter import Pymunk
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Law, Model, Scene


class Sound(Pymunk):
    """No fault: the same engine under another name."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        super().__init__(scene, law, "tuned", model, step)


class Dull(Sound):
    """Restitution one percent low."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        contact = replace(scene.contact, bounciness=0.99 * scene.contact.bounciness)
        super().__init__(replace(scene, contact=contact), law, profile, model, step)


class Sinking(Sound):
    """Leaves a centimetre of overlap in resting contacts."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        super().__init__(scene, law, profile, model, step)
        self._space.collision_slop = 0.01


class Refusing(Sound):
    def __init__(self, *arguments: object) -> None:
        raise Unsupported("nothing at all")


class Slow(Sound):
    """Takes its time, so that it can be interrupted."""

    def advance(self, steps: int) -> None:
        time.sleep(0.5)
        super().advance(steps)
