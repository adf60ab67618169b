"""The stepped runner for particles (documents, rules R3 and R4): detect, impacts, gravity, lasting contacts, move,
keep apart.

Choices that the documents leave open, made so that energy never grows:
- Positions move by the mean of the velocities before and after the step's forces: free flight is the exact parabola.
- A body found d deep in a static one is lifted by d and its approach reduced to the speed it had when it touched
  (`penetration.touching_speed`), so the lift adds nothing. What a slower body cannot pay of m a d is kept as its debt
  and taken from the next approach: the energy never exceeds its start by more than the debt.
- A contact slower than gravity explains is lasting: 2 h |g . n|, since gravity does not push bodies sideways.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.gaps import locate
from impactbench.reference.particles import Bodies, Indices, Pairs
from impactbench.reference.responses import damp, exchange, hold, relative, resolve_impacts
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
def run(bodies: Bodies, pairs: Pairs, rules: Rules, steps: int) -> int:
    """Advance by `steps`. Returns how many were done: fewer if lasting contacts found no common solution in
    `SWEEPS`.
    """
    for done in range(steps):
        if not one_step(bodies, pairs, rules):
            return done
    return steps


@compiled
def start(bodies: Bodies, pairs: Pairs, rules: Rules) -> None:
    """Contacts that touch at t = 0 are lasting ones (documents, rule R3)."""
    detect(bodies, pairs, rules.touch)
    pairs.touched[:] = pairs.touching


@compiled
def one_step(bodies: Bodies, pairs: Pairs, rules: Rules) -> bool:
    active = detect(bodies, pairs, rules.touch)
    slow = slow_approach(pairs, active, rules)
    for p in active:
        pairs.touched[p] |= relative(bodies, pairs, p)[0] >= -slow[p]
    resolve_impacts(bodies, pairs, active, slow, rules.doc, IMPACT_SWEEPS)

    # Lasting contacts carry no approach into the step; what they pushed here is no part of the step's weight.
    weight = pairs.push.copy()
    pairs.push[:] = 0.0
    rest = hold(bodies, pairs, active, False, rules.still, SWEEPS)
    # A pair that parts before gravity acts is in flight: catching it within the step would do work on it.
    lasting = active[parting(bodies, pairs, active) <= 1e3 * rules.still]
    pairs.push[:] = 0.0
    pairs.push[lasting] = weight[lasting]
    before, last = bodies.velocity.copy(), bodies.position.copy()
    for i in range(len(bodies.inverse_mass)):
        if bodies.inverse_mass[i] > 0:
            bodies.velocity[i] += rules.step * rules.gravity
    rest = max(rest, hold(bodies, pairs, lasting, not rules.doc, rules.still, SWEEPS))
    if rules.doc:
        damp(bodies, pairs, lasting, rules.step, rules.still)

    bodies.velocity[:] *= rules.carried
    bodies.position[:] += rules.step / 2 * (before + bodies.velocity) * rules.carried
    pairs.touched[:] = pairs.touching
    if rules.revert:
        revert(bodies, pairs, rules, last, before, slow)
    else:
        project(bodies, pairs, rules)
    # What is left after all sweeps is harmless below the speed that a contact may have anyway: the next step goes on
    # from there.
    return rest <= max(rules.still, 2 * rules.step * math.sqrt((rules.gravity**2).sum()))


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
def look(bodies: Bodies, pairs: Pairs, touch: float) -> None:
    """Bring the gaps up to date; of pairs that cannot have met since they were seen apart, to a lower bound above
    `touch`.
    """
    travel = 0.0
    for i in range(len(bodies.inverse_mass)):
        x = bodies.position[i, 0] - bodies.seen[i, 0]
        y = bodies.position[i, 1] - bodies.seen[i, 1]
        z = bodies.position[i, 2] - bodies.seen[i, 2]
        travel = max(travel, x * x + y * y + z * z)
    bodies.seen[:] = bodies.position
    # Sums of travels lose some of their last digits: a little more keeps the bound sure.
    pairs.odometer[0] += 2 * math.sqrt(travel) * (1 + 1e-9)
    now, gap, clear, reach = pairs.odometer[0], pairs.gap, pairs.clear, pairs.reach
    for p in range(len(gap)):
        if clear[p] - now > 2 * touch and reach[p] == 0.0:
            gap[p] = clear[p] - now
        else:
            locate(bodies, pairs, p)
            clear[p] = now + gap[p]


@compiled
def slow_approach(pairs: Pairs, active: Indices, rules: Rules) -> Floats:
    """Approach speed [m/s] per pair that gravity along its normal alone explains, 2 h |g . n|."""
    slow = np.zeros(len(pairs.first))
    for p in active:
        n, g = pairs.normal[p], rules.gravity
        slow[p] = max(rules.still, 2 * rules.step * abs(g[0] * n[0] + g[1] * n[1] + g[2] * n[2]))
    return slow


@compiled
def parting(bodies: Bodies, pairs: Pairs, active: Indices) -> Floats:
    """u . n [m/s] of the pairs `active`, positive where they part."""
    speeds = np.zeros(len(active))
    for i in range(len(active)):
        speeds[i] = relative(bodies, pairs, active[i])[0]
    return speeds


@compiled
def project(bodies: Bodies, pairs: Pairs, rules: Rules) -> None:
    """Move overlapping bodies apart, shared by mass (documents, rule R4), pair after pair until no overlap is left.

    Sweeps visit the pairs that overlap or soon could; a last look at all pairs finds the others. A heap that needs
    more than `SWEEPS` keeps its rest of overlap for the next step.
    """
    for _ in range(len(bodies.inverse_mass)):
        look(bodies, pairs, rules.touch)
        deepest = 0.0
        for p in range(len(pairs.first)):
            deepest = max(deepest, -pairs.gap[p])
        if deepest <= rules.touch / 2:
            return
        near = np.nonzero(pairs.gap < 4 * deepest)[0]
        if not separate(bodies, pairs, near, rules):
            return


@compiled
def separate(bodies: Bodies, pairs: Pairs, near: Indices, rules: Rules) -> bool:
    """Sweep over the pairs `near` until none overlaps. Returns whether that was reached."""
    for sweep in range(SWEEPS):
        clear = True
        for i in range(len(near)):
            p = near[i] if sweep % 2 == 0 else near[len(near) - 1 - i]
            locate(bodies, pairs, p)
            if pairs.gap[p] < -rules.touch / 2:
                depth = -pairs.gap[p]
                part(bodies, pairs, p, rules.gravity)
                if rules.positions:
                    follow(bodies, pairs, p, depth / rules.step)
                clear = False
        if clear:
            return True
    return False


@compiled
def part(bodies: Bodies, pairs: Pairs, p: int, gravity: Floats) -> None:
    """Take pair p apart along its normal and let its approach pay for what that adds to the energy.

    The common centre of two movable bodies stays, which costs nothing; a lift off a static body costs m a d. What the
    approach cannot pay waits on the upper body for a contact that can: in a column, the blow comes from above.
    """
    a, b, n, depth = pairs.first[p], pairs.second[p], pairs.normal[p], -pairs.gap[p]
    w_a, w_b = bodies.inverse_mass[a], bodies.inverse_mass[b]
    for k in range(3):
        bodies.position[a, k] -= depth * w_a / (w_a + w_b) * n[k]
        bodies.position[b, k] += depth * w_b / (w_a + w_b) * n[k]
    pull = -(gravity[0] * n[0] + gravity[1] * n[1] + gravity[2] * n[2])
    cost = bodies.debt[a] + bodies.debt[b]
    if w_a == 0:
        cost += pull * depth / w_b
    approach, mass = max(0.0, -relative(bodies, pairs, p)[0]), 1 / (w_a + w_b)
    if cost == 0:
        return
    touched = math.sqrt(max(0.0, approach * approach - 2 * cost / mass)) if approach > 0 else 0.0
    blow = mass * (approach - touched)
    exchange(bodies, pairs, p, blow * n[0], blow * n[1], blow * n[2])
    upper = b if w_a == 0 or pull > 0 else a
    bodies.debt[a] = bodies.debt[b] = 0.0
    bodies.debt[upper] = max(0.0, cost - mass * (approach * approach - touched * touched) / 2)


@compiled
def follow(bodies: Bodies, pairs: Pairs, p: int, speed: float) -> None:
    """Velocities from positions (documents, rule R4): what projection moved pair p by, per step, off its approach.

    Never more than the approach, so it takes energy and adds none; the impact that follows finds less to return.
    """
    n, approach = pairs.normal[p], max(0.0, -relative(bodies, pairs, p)[0])
    a, b = pairs.first[p], pairs.second[p]
    blow = min(approach, speed) / (bodies.inverse_mass[a] + bodies.inverse_mass[b])
    exchange(bodies, pairs, p, blow * n[0], blow * n[1], blow * n[2])


@compiled
def revert(bodies: Bodies, pairs: Pairs, rules: Rules, last: Floats, before: Floats, slow: Floats) -> None:
    """Put overlapping bodies back to where the step began, with the velocity they had there (documents, rule R4).

    A body put back may now be in another's way, which goes back as well; at most every body does. Pairs that
    overlapped count as touching across the gap that is left, so that the next step treats their contact; after that
    only across a gap of 2 g h^2, so that a body held further off falls on.
    """
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
        pairs.reach[p] = min(pairs.reach[p], rules.step * slow[p])
        if met[p]:
            locate(bodies, pairs, p)
            pairs.reach[p] = max(0.0, pairs.gap[p])
