"""Coulomb friction of a prolonged contact: the engines' law, not the documents' (theirs is viscous, rule R5)."""

from __future__ import annotations

import math

from impactbench.scenarios.trajectory import Floats


def slide(tangential: Floats, mass: float, normal_impulse: float, friction: float) -> Floats:
    """Sliding velocity [m/s] after a step in which the contact passed `normal_impulse` [N s].

    The impulse is at most mu times the normal one and only ever stops the sliding: v_t' = v_t max(0, 1 - mu i_n / (m
    |v_t|)). For two movable bodies `tangential` is their relative sliding and `mass` the reduced mass.
    """
    speed = math.sqrt(float(tangential @ tangential))
    if speed == 0:
        return tangential.copy()
    return tangential * max(0.0, 1 - friction * normal_impulse / (mass * speed))


def stopping_time(speed: float, friction: float, gravity: float) -> float:
    """v/(mu g) [s] on level ground."""
    return speed / (friction * gravity)


def stopping_distance(speed: float, friction: float, gravity: float) -> float:
    """v^2/(2 mu g) [m] on level ground."""
    return speed**2 / (2 * friction * gravity)
