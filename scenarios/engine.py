"""The contract between the harness and a contestant: an adapter is a class with this shape and inherits nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from impactbench.scenarios.records import Law, Model, Scene
from impactbench.scenarios.trajectory import State


class Unsupported(Exception):
    """The engine cannot express this scene. The message says why, for the reader of the report."""


class Unavailable(Exception):
    """The engine is not installed or cannot be loaded here. The message says why."""


class Engine(Protocol):
    """One world, built for one cell.

    The constructor takes (scene, law, profile, model, step): the scene's records, the law the run is scored under, the
    profile's name, the model to build (`scene.model` or `FULL`) and the step [s]. It raises `Unsupported` or
    `Unavailable` with a reason.
    """

    settings: Mapping[str, object]
    """What was set, in the engine's own words: everything that is not the scene itself."""

    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None: ...

    def advance(self, steps: int) -> None:
        """Advance by `steps` steps in as few calls as the engine offers; reads nothing."""

    def read(self) -> State:
        """The movable bodies now, in scene order: copies, SI units, world axes; spins only where modelled."""

    def close(self) -> None:
        """Give back what the engine holds. The object is not used afterwards."""
