"""Which pairs are handled, and from when a contact is a lasting one (documents, rules R1-R3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence


def handled_pairs(statics: Sequence[int], movables: Sequence[int]) -> Iterator[tuple[int, int]]:
    """One-way pairs (static, movable), then two-way pairs (documents, rules R1 and R2).

    A static-static pair is not skipped, it is never formed: walls may overlap walls at no cost.
    """
    for static in statics:
        for movable in movables:
            yield static, movable
    for index, first in enumerate(movables):
        for second in movables[index + 1 :]:
            yield first, second


def pair_counts(statics: int, movables: int) -> tuple[int, int, int]:
    """Numbers of static-static (never handled), one-way and two-way pairs (documents, rule R2)."""
    return statics * (statics - 1) // 2, statics * movables, movables * (movables - 1) // 2


def gravity_alone(gravity: float, step: float) -> float:
    """Approach speed [m/s] that gravity alone explains: 2 g h. A slower contact is a resting one, not an impact (rule
    R3).
    """
    return 2 * gravity * step
