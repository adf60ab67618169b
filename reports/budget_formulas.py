"""Budgets as functions of a case, its law and the step. Why they are so stands beside each check in `budgets`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from impactbench.reports.budget_scales import Scales, scales_of
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.truth import Case

EPSILON = float(np.finfo(np.float64).eps)
MARGIN = 100
"""Times the derived round-off: the least any budget allows."""
PER_IMPACT = 8
"""Round-offs of one impact: each of its some eight operations (dot products, sums of impulses) rounds once."""


@dataclass(frozen=True)
class Setting:
    """What a budget is a function of: a case, its law and the step [s]."""

    case: Case
    law: Law
    step: float

    @property
    def scene(self) -> Scene:
        return self.case.scene

    @property
    def scales(self) -> Scales:
        return scales_of(self.case, self.law)

    @property
    def steps(self) -> int:
        return max(1, round(self.scene.duration / self.step))

    def round_off(self, operations: float = 1.0) -> float:
        """100 n eps for each of `operations` sums that lose one round-off a step."""
        return MARGIN * self.steps * operations * EPSILON


def momentum(s: Setting) -> float:
    return s.round_off()


def turning(s: Setting) -> float:
    """Share that free rotation in three dimensions may lose: h T w^2/2 for a scheme of first order."""
    scene = s.scene
    if not (scene.model.rotation and scene.model.dimension == 3):
        return 0.0
    spin = scene.speed / scene.length
    return s.step * scene.duration * spin**2 / 2


def angular_momentum(s: Setting) -> float:
    scales = s.scales
    pushed = s.step * scales.sheared * max(1, scales.impacts)
    return s.round_off() + turning(s) + (pushed / scales.angular if scales.angular else 0.0)


def weight_late(s: Setting) -> float:
    """Energy [J] of a weight that is h late or early at an impact, and of half a step where contact lasts."""
    scales = s.scales
    return s.step * (scales.weight * scales.falling + (scales.power / 2 if scales.lasting else 0.0))


def energy_gain(s: Setting) -> float:
    lifted = sunk(s) if s.scene.model.rotation else 0.0
    return s.round_off() + turning(s) + (weight_late(s) + lifted) / s.scene.energy


def energy_excess(s: Setting) -> float:
    return energy_gain(s) + s.step * s.scales.lossy / s.scene.energy


def energy_loss(s: Setting) -> float:
    return s.round_off() + turning(s) + (weight_late(s) + sunk(s)) / s.scene.energy


def sunk(s: Setting) -> float:
    """Energy [J] of weights that rest one step of falling too low, M g N g h^2."""
    return s.scales.weight * len(s.scene.movable) * fallen(s) if s.scales.lasting else 0.0


def fallen(s: Setting) -> float:
    """g h^2 [m]: what a body at rest falls in a step of a first-order scheme before contact holds it."""
    return float(np.linalg.norm(s.scene.gravity)) * s.step**2


def penetration(s: Setting) -> float:
    depth = s.scales.closing * s.step + fallen(s) * len(s.scene.movable)
    return depth / s.scene.length + s.round_off()


def restitution(_: Setting) -> float:
    return MARGIN * PER_IMPACT * EPSILON


def impact(s: Setting) -> float:
    return MARGIN * PER_IMPACT * EPSILON * max(1.0, s.scene.speed / max(s.scales.closing, 1e-300))


def impact_time(s: Setting) -> float:
    return s.step * ((1.5 if any(s.scene.gravity) else 1.0) + MARGIN * s.steps * EPSILON)


def position(s: Setting) -> float:
    scales, scene = s.scales, s.scene
    flight = float(np.linalg.norm(scene.gravity)) * s.step * scene.duration / 2
    return (flight + (scales.jumps + scales.turned) * s.step) / scene.length + s.round_off()


def friction(s: Setting) -> float:
    sunken = len(s.scene.movable) * fallen(s)
    return (s.scales.fastest * s.step + sunken) / s.scene.length + s.round_off()


def heights(s: Setting) -> float:
    return len(s.scene.movable) * fallen(s) / s.scene.length + s.round_off()


def spin(s: Setting) -> float:
    scene = s.scene
    gravity = float(np.linalg.norm(scene.gravity))
    return s.round_off() + turning(s) + gravity * s.step / scene.speed
