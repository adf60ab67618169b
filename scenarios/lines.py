"""Rows of balls in one dimension without gravity: the cradle and the chain of unequal masses."""

from __future__ import annotations

from impactbench.scenarios.chain import chain_truth
from impactbench.scenarios.naming import Parameters, case_name
from impactbench.scenarios.records import Body, Contact, Model, Scene, Sphere
from impactbench.scenarios.truth import Case, Family, Truth

RADIUS, SPEED, DURATION = 0.1, 3.0, 1.0
APPROACH = 0.536  # gap [m] before the first ball, so that the first impact falls on no common multiple of steps


def _row(family: str, parameters: Parameters, masses: list[float], gap: float) -> Scene:
    """The first ball flies along x at a row of resting ones, each `gap` [m] from the next; elastic."""
    places = [-APPROACH - 2 * RADIUS, *(i * (2 * RADIUS + gap) for i in range(len(masses) - 1))]
    return Scene(
        name=case_name(family, parameters),
        bodies=tuple(
            Body(f"ball {i}", Sphere(RADIUS), mass, (x, 0.0, 0.0), (0.0 if i else SPEED, 0.0, 0.0))
            for i, (mass, x) in enumerate(zip(masses, places, strict=True))
        ),
        duration=DURATION,
        model=Model((0,)),
        length=SPEED * DURATION,  # what the first ball would travel alone
        speed=SPEED,
        energy=masses[0] * SPEED**2 / 2,  # kinetic, at the start
        contact=Contact(1.0),
        phase_free=gap > 0,
        parameters=parameters,
    )


def newtons_cradle(count: int, gap: float) -> Case:
    """Equal masses swap velocities (R12), so with gaps the speed runs through the row and the last ball leaves with it.

    With the balls touching, the laws of two-body impacts leave the outcome open (sequential or simultaneous):
    only momentum and kinetic energy are certain, hence no state is given.
    """
    scene = _row("newtons_cradle", {"count": count, "gap": gap}, [1.0] * count, gap)
    truth = chain_truth(scene) if gap > 0 else Truth("invariant", lambda _: None)
    return Case(scene, dict.fromkeys(scene.laws, truth), "position_error" if gap > 0 else "energy_drift")


def mass_chain(count: int, ratio: float) -> Case:
    """Each ball `ratio` times as heavy as the one before. Elastic, in sequence: v_(i+1) = 2 m_i/(m_i + m_(i+1)) v_i."""
    scene = _row("mass_chain", {"count": count, "ratio": ratio}, [ratio**i for i in range(count)], 0.05)
    return Case(scene, dict.fromkeys(scene.laws, chain_truth(scene)))


FAMILIES = (
    Family(
        "newtons_cradle",
        "Does only the last ball leave; and what does an engine do where the balls touch?",
        "1 dimension, two-way impacts",
        lambda: [newtons_cradle(3, 0.01), newtons_cradle(5, 0.01), newtons_cradle(5, 0.0)],
    ),
    Family(
        "mass_chain",
        "Is an impact handed on exactly through unequal masses?",
        "1 dimension, two-way impacts",
        lambda: [mass_chain(5, 0.5), mass_chain(4, 2.0)],
    ),
)
