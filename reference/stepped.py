"""The stepped runner for particles (documents, rules R3 and R4): detect, impacts, gravity, lasting contacts, move,
keep apart.

Choices that the documents leave open, made so that energy never grows:
- Positions move by the mean of the velocities before and after the step's forces: free flight is the exact parabola.
- Overlaps are taken back all at once, and bodies that touch one another pay for the lift out of their approach
  (`projection`). What they cannot pay of m a d is kept as their debt and taken from the next approach: the energy never
  exceeds its start by more than the debt.
- A contact slower than gravity explains is lasting: 2 h |g . n|, since gravity does not push bodies sideways.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.gaps import locate
from impactbench.reference.nearby import Rooms, all_listed, look, squared_way
from impactbench.reference.particles import Bodies, Indices, Pairs
from impactbench.reference.progress import BEGIN, MOVED, Progress
from impactbench.reference.projection import follow, project
from impactbench.reference.responses import damp, hold, relative, resolve_impacts
from impactbench.scenarios.trajectory import Floats

SWEEPS = 500
IMPACT_SWEEPS = 200


class Rules(NamedTuple):
    """How to step: `step` [s], `gravity` [m/s^2], `carried` 1 on the axes that carry motion else 0, the law and the
    strategy of R4.

    positions: a projection also changes velocities. touch [m]: gap up to which bodies touch. still [m/s]: a speed that
    counts as none. The last two are round-off next to the scene.
    """

    step: float
    gravity: Floats
    carried: Floats
    doc: bool
    revert: bool
    positions: bool
    touch: float
    still: float


@compiled
def run(bodies: Bodies, pairs: Pairs, rooms: Rooms, progress: Progress, rules: Rules, steps: int) -> int:
    """Advance by `steps`. Returns how many were done: fewer where contacts found no common solution in `SWEEPS`, or
    where a new list of pairs is wanted, as `progress` says.

    One long kernel: handing on so many arrays to another would cost as much as the step of a few bodies.
    """
    before, v, x = progress.before, bodies.velocity, bodies.position
    for done in range(steps):
        if progress.stage[0] == BEGIN:
            active = detect(bodies, pairs, rules.touch)
            slow_approach(pairs, active, rules)
            for p in active:
                pairs.touched[p] |= relative(bodies, pairs, p)[0] >= -pairs.slow[p]
            resolve_impacts(bodies, pairs, active, rules.doc, IMPACT_SWEEPS)

            # Lasting contacts carry no approach into the step; what they pushed here is no part of the step's weight.
            weight = pairs.push.copy()
            pairs.push[:] = 0.0
            rest = hold(bodies, pairs, active, False, rules.still, SWEEPS)
            # A pair that parts before gravity acts is in flight: catching it within the step would do work on it.
            lasting = active[parting(bodies, pairs, active) <= 1e3 * rules.still]
            pairs.push[:] = 0.0
            pairs.push[lasting] = weight[lasting]
            before[:], progress.last[:] = v, x
            for i in range(len(v)):
                if bodies.inverse_mass[i] > 0:
                    v[i] += rules.step * rules.gravity
            progress.rest[0] = max(rest, hold(bodies, pairs, lasting, not rules.doc, rules.still, SWEEPS))
            if rules.doc:
                damp(bodies, pairs, lasting, rules.step, rules.still)

            v[:] *= rules.carried
            x[:] += rules.step / 2 * (before + v) * rules.carried
            pairs.touched[:] = pairs.touching
            pairs.parted[:] = 0.0
            progress.stage[0] = MOVED

        if rules.revert:
            apart = revert(bodies, pairs, rooms, progress, rules)
        else:
            apart = project(bodies, pairs, rooms, progress, rules.gravity, rules.touch, rules.still)
        if not apart:
            return done
        if rules.positions:
            follow(bodies, pairs, rules.step)
        progress.stage[0] = BEGIN
        # What is left after all sweeps is harmless below the speed that a contact may have anyway: the next step goes
        # on from there.
        if progress.rest[0] > max(rules.still, 2 * rules.step * math.sqrt((rules.gravity**2).sum())):
            return done
    return steps


def start(bodies: Bodies, pairs: Pairs, rules: Rules) -> None:
    """Contacts that touch at t = 0 are lasting ones (documents, rule R3)."""
    detect(bodies, pairs, rules.touch)
    pairs.touched[:] = pairs.touching


@compiled
def detect(bodies: Bodies, pairs: Pairs, touch: float) -> Indices:
    """Numbers of the pairs that touch now."""
    look(bodies, pairs, touch)
    for p in range(len(pairs.first)):
        pairs.touching[p] = pairs.gap[p] <= pairs.reach[p] + touch
        if not pairs.touching[p]:
            pairs.reach[p] = 0.0
    return np.nonzero(pairs.touching)[0]


@compiled
def slow_approach(pairs: Pairs, active: Indices, rules: Rules) -> None:
    """Approach speed [m/s] per pair that gravity along its normal alone explains, 2 h |g . n|."""
    pairs.slow[:] = 0.0
    for p in active:
        n, g = pairs.normal[p], rules.gravity
        pairs.slow[p] = max(rules.still, 2 * rules.step * abs(g[0] * n[0] + g[1] * n[1] + g[2] * n[2]))


@compiled
def parting(bodies: Bodies, pairs: Pairs, active: Indices) -> Floats:
    """u . n [m/s] of the pairs `active`, positive where they part."""
    speeds = np.zeros(len(active))
    for i in range(len(active)):
        speeds[i] = relative(bodies, pairs, active[i])[0]
    return speeds


@compiled
def revert(bodies: Bodies, pairs: Pairs, rooms: Rooms, progress: Progress, rules: Rules) -> bool:
    """Put overlapping bodies back to where the step began, with the velocity they had there (documents, rule R4).

    A body put back may now be in another's way, which goes back as well; at most every body does. Pairs that
    overlapped count as touching across the gap that is left, so that the next step treats their contact; after that
    only across a gap of 2 g h^2, so that a body held further off falls on. Returns False, having done nothing, if
    a new list of pairs is wanted.
    """
    last, before, furthest = progress.last, progress.before, 0.0
    for i in range(len(last)):
        furthest = max(furthest, squared_way(bodies.position, last, i))
    if not all_listed(bodies.position, rooms, progress, rules.touch + 2 * math.sqrt(furthest) * (1 + 1e-9)):
        return False
    back = np.zeros(len(bodies.inverse_mass), dtype=np.bool_)
    met = np.zeros(len(pairs.first), dtype=np.bool_)
    for _ in range(len(back) + 1):
        clear = True
        for p in range(len(pairs.first)):
            locate(bodies, pairs, p)
            a, b = pairs.first[p], pairs.second[p]
            if pairs.gap[p] < -rules.touch / 2 and not (back[b] and (back[a] or bodies.inverse_mass[a] == 0)):
                for i in (a, b):
                    back[i] = True
                    bodies.position[i] = last[i]
                    bodies.velocity[i] = before[i]
                met[p] = True
                clear = False
        if clear:
            break
    for p in range(len(met)):
        pairs.reach[p] = min(pairs.reach[p], rules.step * pairs.slow[p])
        if met[p]:
            locate(bodies, pairs, p)
            pairs.reach[p] = max(0.0, pairs.gap[p])
    return True
