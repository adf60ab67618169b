"""Bounciness of a pair from its two materials (documents, rule R10): the scenes' own, as every contestant needs it."""

from impactbench.scenarios.materials import MIXINGS, mix

__all__ = ["MIXINGS", "mix"]
